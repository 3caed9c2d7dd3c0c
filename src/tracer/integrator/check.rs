//! The check of the plan of effects (`--check-plan`): a share of the paths is also traced without the plan, and must give the
//! same samples.
//!
//! The scene as planned lacks what the plan calls off ([`planned`](crate::tracer::effects::planned)). The scene with everything
//! must give the same samples, bit for bit. One plan changes the arithmetic by design: in a scene without colour, a path carries
//! the wavelengths of its light's white and not wavelengths of its own. There its samples are the general ones times the quotient
//! of white as it is and white as those wavelengths show it, and they are compared within a bound.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use crate::color::Xyz;
use crate::math::bits::mix;
use crate::spectrum::{SampledWavelengths, White};
use crate::stream::{PathCounts, SampleSink};
use crate::tracer::Scene;

use super::{Integrator, RenderContext};

/// Traces paths as `I` does, and a share of them a second time without the plan.
#[derive(Clone, Debug)]
pub struct CheckedIntegrator<I> {
    special: I,
    general: I,
    context: RenderContext,
    white: Option<White>,
    /// The share of paths that are compared, times 2^32.
    share: u64,
    tally: Arc<PlanCheckTally>,
}

/// The numbers of paths that were compared.
#[derive(Debug, Default)]
pub struct PlanCheckTally {
    checked: AtomicU64,
    different: AtomicU64,
    /// First and last index whose samples differ.
    reach: Mutex<Option<(u64, u64)>>,
}

/// Bound of the difference where arithmetic differs by design, relative to the largest component.
const BOUND: f32 = 1e-4;

/// Share of paths, and number beside it, that may differ more there: roulette and choices may fall on either side of a rounding.
const RARE: f64 = 20e-6;
const ANYWAY: f64 = 3.0;

impl PlanCheckTally {
    /// Paths that were traced by both, and those whose samples differ by more than rounding allows for one.
    pub fn counts(&self) -> [u64; 2] {
        [self.checked.load(Ordering::Relaxed), self.different.load(Ordering::Relaxed)]
    }

    /// The first and the last index whose samples differ, if any do. Tracing this range shows it again.
    pub fn reach(&self) -> Option<(u64, u64)> {
        *self.reach.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts a path that differs and returns their number.
    fn differs(&self, index: u64) -> u64 {
        let mut reach = self.reach.lock().unwrap_or_else(PoisonError::into_inner);
        let (first, last) = reach.unwrap_or((index, index));
        *reach = Some((first.min(index), last.max(index)));
        self.different.fetch_add(1, Ordering::Relaxed) + 1
    }
}

impl<I: Integrator + From<RenderContext>> CheckedIntegrator<I> {
    /// Traces with the settings of `context`, and the share `share` in [0, 1] of the paths also in `general`, the same scene
    /// prepared for everything ([`Scene::prepare_general`]).
    pub fn new(context: RenderContext, general: Arc<Scene>, share: f64) -> Self {
        let white = context.scene.white().filter(|_| general.white().is_none());
        let general = I::from(RenderContext { scene: general, ..context.clone() });
        let share = (share.clamp(0.0, 1.0) * (1u64 << 32) as f64) as u64;
        Self { special: I::from(context.clone()), general, context, white, share, tally: Arc::default() }
    }

    /// The outcome so far.
    pub fn tally(&self) -> &Arc<PlanCheckTally> {
        &self.tally
    }

    /// True if path `index` is compared: by a hash, so that no pattern of the sequence is preferred.
    fn takes(&self, index: u64) -> bool {
        mix(index) >> 32 < self.share
    }

    /// The sample that the special code should find, from that of the general code.
    fn expected(&self, index: u64, sample: PathSample) -> PathSample {
        let Some(white) = self.white else { return sample };
        let lambda = SampledWavelengths::sample(I::wavelength_number(index, &self.context));
        let drawn = lambda.to_xyz(white.spectrum().sample(&lambda));
        let exact = white.wavelengths();
        let exact = exact.to_xyz(white.spectrum().sample(&exact));
        // The component that these wavelengths show best gives the quotient.
        let size = [(sample.value.x, drawn.x), (sample.value.y, drawn.y), (sample.value.z, drawn.z)];
        let (value, unit) =
            size.into_iter().fold((0.0, 0.0), |best, new| if new.1 > best.1 { new } else { best });
        let value = if unit > 0.0 { exact * (value / unit) } else { Xyz::BLACK };
        PathSample { value, ..sample }
    }

    /// Compares two lists of samples of path `index` and describes the first difference.
    fn difference(&self, index: u64, special: &[PathSample], general: &[PathSample]) -> Option<String> {
        if special.len() != general.len() {
            return Some(format!("{} samples, and {} with everything", special.len(), general.len()));
        }
        let pairs = special.iter().zip(general).map(|(s, g)| (s, self.expected(index, *g)));
        let differs = |(s, g): &(&PathSample, PathSample)| match self.white {
            None => **s != *g,
            Some(_) => !s.is_near(g),
        };
        pairs.into_iter().find(differs).map(|(s, g)| format!("{s:?}, and {g:?} with everything"))
    }

    /// Compares the samples of path `index` with and without the plan.
    ///
    /// # Panics
    ///
    /// When the plan is refuted: the run ends and names the path.
    #[cold]
    fn check(&self, index: u64, special: &[PathSample], general: &[PathSample]) {
        let checked = self.tally.checked.fetch_add(1, Ordering::Relaxed) + 1;
        let Some(what) = self.difference(index, special, general) else { return };
        let different = self.tally.differs(index);
        let allowed = match self.white {
            None => 0.0,
            Some(_) => ANYWAY + RARE * checked as f64,
        };
        assert!(
            different as f64 <= allowed,
            "the plan of effects is refuted by {different} of {checked} paths, by this one with {what}"
        );
    }
}

impl<I: Integrator + From<RenderContext>> Integrator for CheckedIntegrator<I> {
    type Scratch = [I::Scratch; 2];

    fn trace(&self, index: u64, [scratch, other]: &mut [I::Scratch; 2], out: &mut impl SampleSink) {
        if !self.takes(index) {
            return self.special.trace(index, scratch, out);
        }
        let special = collect(&self.special, index, scratch, out);
        let general = collect(&self.general, index, other, out);
        // An integrator that is told to stop may have ended in the middle.
        if out.is_wanted() {
            self.check(index, &special, &general);
        }
        for PathSample { uv, value, weight } in special {
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

/// A sample. One of the light stream has no weight.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PathSample {
    uv: [f32; 2],
    value: Xyz,
    weight: Option<f32>,
}

impl PathSample {
    fn is_near(&self, other: &Self) -> bool {
        let (a, b) = (self.value, other.value);
        let size = a.x.max(a.y).max(a.z).max(f32::MIN_POSITIVE);
        let near = |a: f32, b: f32| (a - b).abs() <= BOUND * size;
        let same = self.uv == other.uv && self.weight == other.weight;
        same && near(a.x, b.x) && near(a.y, b.y) && near(a.z, b.z)
    }
}

/// The samples of path `index` that are meant for `out`.
fn collect<I: Integrator>(
    from: &I,
    index: u64,
    scratch: &mut I::Scratch,
    out: &impl SampleSink,
) -> Vec<PathSample> {
    let mut samples = CollectingSink { out, taken: Vec::new() };
    from.trace(index, scratch, &mut samples);
    samples.taken
}

/// Keeps the samples of a path.
struct CollectingSink<'a, S> {
    out: &'a S,
    taken: Vec<PathSample>,
}

impl<S: SampleSink> SampleSink for CollectingSink<'_, S> {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.taken.push(PathSample { uv, value, weight: Some(weight) });
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.taken.push(PathSample { uv, value, weight: None });
    }

    fn is_wanted(&self) -> bool {
        self.out.is_wanted()
    }
}
