//! The proof of the plan: a share of the paths is traced by the fully general code too, and must give the same samples.
//!
//! Code for what a scene holds must give what code for everything gives, bit for bit. Where it changes the arithmetic by design it is
//! compared within a bound: in a scene without colour, a path carries the wavelengths of its light's white and not wavelengths of its
//! own, so that its samples are the general ones times the quotient of white as it is to white as those wavelengths show it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::color::Xyz;
use crate::spectrum::{SampledWavelengths, White};
use crate::stream::{PathCounts, SampleSink};
use crate::tracer::Sampler;

use super::{Integrator, Setup};

/// An integrator with special code, which its settings choose.
pub trait Special: Integrator + From<Setup> {
    /// The number that chooses the wavelengths of the path that takes its numbers from `sampler`.
    fn wavelength_number(sampler: &Sampler) -> f32 {
        sampler.camera().wavelength
    }
}

/// Traces paths as `I` does, and a share of them twice.
#[derive(Clone, Debug)]
pub struct Checked<I> {
    special: I,
    general: I,
    seed: u32,
    white: Option<White>,
    /// Of 2^32.
    share: u64,
    tally: Arc<Tally>,
}

/// How many paths were compared.
#[derive(Debug, Default)]
pub struct Tally {
    checked: AtomicU64,
    different: AtomicU64,
}

/// Where arithmetic differs by design: relative to the largest component.
const BOUND: f32 = 1e-4;

/// There, roulette and choices may fall on either side of a rounding: so many paths may differ in a million, and some anyway.
const RARE: f64 = 20e-6;
const ANYWAY: f64 = 3.0;

impl Tally {
    /// Paths that were traced by both, and those whose samples differ by more than rounding allows for one.
    pub fn counts(&self) -> [u64; 2] {
        [self.checked.load(Ordering::Relaxed), self.different.load(Ordering::Relaxed)]
    }
}

impl<I: Special> Checked<I> {
    /// Traces with the settings of `setup`, and the share `share` in [0, 1] of the paths by the general code too.
    pub fn new(setup: Setup, share: f64) -> Self {
        let (seed, white) = (setup.seed, if setup.spectral { None } else { setup.scene.white() });
        let general = I::from(Setup { spectral: true, ..setup.clone() });
        let share = (share.clamp(0.0, 1.0) * (1u64 << 32) as f64) as u64;
        Self { special: I::from(setup), general, seed, white, share, tally: Arc::default() }
    }

    /// What was found so far.
    pub fn tally(&self) -> &Arc<Tally> {
        &self.tally
    }

    /// Whether path `index` is compared: a hash, so that no pattern of the sequence is preferred.
    fn takes(&self, index: u64) -> bool {
        let z = (index ^ (index >> 32)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z >> 32 < self.share
    }

    /// What the samples of the special code should be, from those of the general.
    fn expected(&self, index: u64, sample: Taken) -> Taken {
        let Some(white) = self.white else { return sample };
        let lambda = SampledWavelengths::sample(I::wavelength_number(&Sampler::at(index, self.seed)));
        let drawn = lambda.to_xyz(white.spectrum().sample(&lambda));
        let exact = white.wavelengths();
        let exact = exact.to_xyz(white.spectrum().sample(&exact));
        // Of three components the one that these wavelengths show best tells the size.
        let size = [(sample.value.x, drawn.x), (sample.value.y, drawn.y), (sample.value.z, drawn.z)];
        let (value, unit) =
            size.into_iter().fold((0.0, 0.0), |best, new| if new.1 > best.1 { new } else { best });
        let value = if unit > 0.0 { exact * (value / unit) } else { Xyz::BLACK };
        Taken { value, ..sample }
    }

    /// Compares two lists of samples of path `index`; the first difference, in words.
    fn difference(&self, index: u64, special: &[Taken], general: &[Taken]) -> Option<String> {
        if special.len() != general.len() {
            return Some(format!("{} samples, and {} by the general code", special.len(), general.len()));
        }
        let pairs = special.iter().zip(general).map(|(s, g)| (s, self.expected(index, *g)));
        let differs = |(s, g): &(&Taken, Taken)| match self.white {
            None => **s != *g,
            Some(_) => !s.is_near(g),
        };
        pairs.into_iter().find(differs).map(|(s, g)| format!("{s:?}, and {g:?} by the general code"))
    }

    /// Traces path `index` by the general code and compares.
    ///
    /// # Panics
    ///
    /// When the plan is refuted: the run ends and names the path.
    #[cold]
    fn check(&self, index: u64, scratch: &mut I::Scratch, special: &[Taken]) {
        let mut general = Collected::default();
        self.general.trace(index, scratch, &mut general);
        let checked = self.tally.checked.fetch_add(1, Ordering::Relaxed) + 1;
        let Some(what) = self.difference(index, special, &general.0) else { return };
        let different = self.tally.different.fetch_add(1, Ordering::Relaxed) + 1;
        let allowed = match self.white {
            None => 0.0,
            Some(_) => ANYWAY + RARE * checked as f64,
        };
        assert!(different as f64 <= allowed, "the plan of effects is refuted: {what}");
    }
}

impl<I: Special> Integrator for Checked<I> {
    type Scratch = I::Scratch;

    fn trace(&self, index: u64, scratch: &mut I::Scratch, out: &mut impl SampleSink) {
        if !self.takes(index) {
            return self.special.trace(index, scratch, out);
        }
        let mut special = Collected::default();
        self.special.trace(index, scratch, &mut special);
        self.check(index, scratch, &special.0);
        for Taken { uv, value, weight } in special.0 {
            match weight {
                Some(weight) => out.camera(uv, value, weight),
                None => out.light(uv, value),
            }
        }
    }

    fn paths_per_index(&self) -> PathCounts {
        self.special.paths_per_index()
    }
}

/// A sample; of the light stream without weight.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Taken {
    uv: [f32; 2],
    value: Xyz,
    weight: Option<f32>,
}

impl Taken {
    fn is_near(&self, other: &Self) -> bool {
        let (a, b) = (self.value, other.value);
        let size = a.x.max(a.y).max(a.z).max(f32::MIN_POSITIVE);
        let near = |a: f32, b: f32| (a - b).abs() <= BOUND * size;
        let same = self.uv == other.uv && self.weight == other.weight;
        same && near(a.x, b.x) && near(a.y, b.y) && near(a.z, b.z)
    }
}

/// Keeps the samples of a path.
#[derive(Default)]
struct Collected(Vec<Taken>);

impl SampleSink for Collected {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.0.push(Taken { uv, value, weight: Some(weight) });
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.0.push(Taken { uv, value, weight: None });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load_str;
    use crate::tracer::{Camera, Scene};

    /// Its special code is right but for one path in a thousand.
    #[derive(Clone)]
    struct Wrong(Setup);

    impl Integrator for Wrong {
        type Scratch = ();

        fn trace(&self, index: u64, (): &mut (), out: &mut impl SampleSink) {
            let off = if !self.0.spectral && index % 1000 == 7 { 1e-3 } else { 0.0 };
            out.camera([0.5; 2], Xyz::new(1.0, 1.0 + off, 1.0), 1.0);
        }

        fn paths_per_index(&self) -> PathCounts {
            PathCounts { camera: 1, light: 0 }
        }
    }

    impl From<Setup> for Wrong {
        fn from(setup: Setup) -> Self {
            Self(setup)
        }
    }

    impl Special for Wrong {}

    #[test]
    fn a_wrong_plan_is_refuted() {
        let colored = "<scene version='3.0.0'><sensor type='perspective'/><shape type='sphere'>\
            <bsdf type='diffuse'><rgb name='reflectance' value='0.8, 0.2, 0.1'/></bsdf></shape>\
            <emitter type='constant'/></scene>";
        let loaded = load_str("check.xml", colored, &[]).expect("a scene");
        let scene = Arc::new(Scene::prepare(&loaded.desc).expect("a scene"));
        let camera = Camera::of(&loaded.desc).expect("a camera");
        let setup = Setup::new(scene, camera, &loaded.desc.integrator, 0, crate::stream::UvWindow::PICTURE);
        let checked = Checked::<Wrong>::new(setup.clone(), 1.0);
        let mut sink = Collected::default();
        (0..7).for_each(|index| checked.trace(index, &mut (), &mut sink));
        assert_eq!((checked.tally().counts(), sink.0.len()), ([7, 0], 7));
        let caught = std::panic::catch_unwind(|| checked.trace(7, &mut (), &mut Collected::default()));
        let message = *caught.expect_err("it differs").downcast::<String>().expect("words");
        assert!(message.contains("refuted") && message.contains("1.001"), "{message}");
        // A hundredth of the paths is a hundredth of the paths.
        let some = Checked::<Wrong>::new(Setup { spectral: true, ..setup }, 0.01);
        (0..100_000).for_each(|index| some.trace(index, &mut (), &mut Collected::default()));
        assert!((900..1100).contains(&some.tally().counts()[0]), "{:?}", some.tally());
    }
}
