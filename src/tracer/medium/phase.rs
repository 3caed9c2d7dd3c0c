//! Phase functions: the density of directions into which a medium scatters.
//!
//! A vertex in a medium is a vertex whose bsdf is a phase function: [`PhaseFunction`] keeps the contract of
//! [`ScatteringModel`], without a cosine and without a surface. Its frame has any normal; that of microflakes, which lie in space, is world
//! space. It is normalised to 1, so that the weight of a sample is 1: how much a medium absorbs is its albedo's to say.
//!
//! # Microflakes
//!
//! What microflakes hide depends on the direction: they scale extinction by their projected area σ(ω) (Jakob, Arbree, Moon, Bala and
//! Marschner, *A radiative transfer framework for rendering materials with anisotropic structure*, 2010). σ(ωₒ) p(ωₒ → ωᵢ) is the same in both
//! directions, p is not. So [`ScatteringModel::projected_area`] stands where a surface has its cosine, in the throughput of light paths and
//! in the densities of MIS weights. In a blend each part has its own area, and 1 where it has no microflakes. (Mitsuba leaves out the area
//! of microflakes in a blend, with which light and camera paths would not agree.)

use std::f32::consts::{FRAC_1_PI, TAU};
use std::sync::Arc;

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::scene::desc::{MicroflakeDesc, MicroflakeGrid, PhaseDesc};
use crate::spectrum::SampledSpectrum;
use crate::tracer::bsdf::{BsdfSample, ScatteringModel};

use super::microflakes::Microflakes;
use super::phase_table::PhaseTable;

/// Most lobes of a phase function.
pub const MOST_LOBES: usize = PhaseDesc::MOST_PARTS;

/// 1 / (4π).
const UNIFORM: f32 = 0.25 * FRAC_1_PI;

/// From this mean cosine on a lobe is a peak: which light matters depends on it.
const PEAKED: f32 = 0.5;

/// From this mean cosine on a lobe counts as a rough mirror rather than as diffuse.
const NARROW: f32 = 0.9;

/// From this largest density on a table does: that of the lobe of Henyey and Greenstein with the mean cosine [`NARROW`].
const NARROW_PEAK: f32 = UNIFORM * (1.0 + NARROW) / ((1.0 - NARROW) * (1.0 - NARROW));
/// From this largest density on a table has a peak: that of the lobe of Henyey and Greenstein with the mean cosine [`PEAKED`].
const PEAK: f32 = UNIFORM * (1.0 + PEAKED) / ((1.0 - PEAKED) * (1.0 - PEAKED));

/// A phase function: a few lobes, each with its share.
#[derive(Clone, Copy, Debug)]
pub struct PhaseFunction {
    lobes: [PhaseLobe; MOST_LOBES],
    /// Shares of the lobes, whose sum is 1.
    shares: [f32; MOST_LOBES],
    count: u32,
    /// Some lobe is made of microflakes.
    oriented: bool,
}

/// The lobes of a phase function that vary in space.
pub(super) type LobeGrids = Vec<(usize, Arc<MicroflakeGrid>)>;

/// One lobe.
#[derive(Clone, Copy, Debug)]
enum PhaseLobe {
    /// Henyey and Greenstein's (1941) with this mean cosine; all directions alike for 0.
    HenyeyGreenstein(f32),
    /// Rayleigh's.
    Rayleigh,
    /// By a table.
    Tabulated(&'static PhaseTable),
    /// Microflakes, in world space.
    Microflakes(Microflakes),
}

impl PhaseLobe {
    /// The density per steradian of scattering from `wo` to `wi`, unit vectors, times the projected area that is seen from `wo`.
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::HenyeyGreenstein(g) if g.abs() < f32::EPSILON => UNIFORM,
            Self::HenyeyGreenstein(g) => {
                // 1 ∓ cos θ of unit vectors is half their squared distance, without cancellation at the peak.
                let peak = if *g < 0.0 { wo } else { -wo };
                let (g, off) = (g.abs(), 0.5 * peak.distance_squared(wi));
                let d = (1.0 - g) * (1.0 - g) + 2.0 * g * off;
                UNIFORM * (1.0 - g) * (1.0 + g) / (d * d.sqrt())
            }
            Self::Rayleigh => {
                let cos = wo.dot(wi);
                0.75 * UNIFORM * (1.0 + cos * cos)
            }
            Self::Tabulated(table) => table.eval(-wo, wi),
            Self::Microflakes(flakes) => flakes.eval(wo, wi),
        }
    }

    /// The area that is seen from `wo`, per area in all; 1 without microflakes.
    #[inline]
    fn projected_area(&self, wo: Vec3) -> f32 {
        if let Self::Microflakes(flakes) = self { flakes.projected_area(wo) } else { 1.0 }
    }

    /// A direction with the density of this lobe, seen from `wo`.
    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let (off, backwards) = match self {
            Self::HenyeyGreenstein(g) => henyey_greenstein_cosine(*g, u[0]),
            Self::Rayleigh => rayleigh_cosine(u[0]),
            Self::Tabulated(table) => table.sample_cosine(u[0]),
            Self::Microflakes(flakes) => return flakes.sample(wo, u),
        };
        let sin = (off * (2.0 - off)).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * u[1]).sin_cos();
        let peak = if backwards { wo } else { -wo };
        Frame::new(peak).to_world(Vec3::new(sin * cos_phi, sin * sin_phi, 1.0 - off)).normalize()
    }

    fn is_peaked(&self) -> bool {
        match self {
            Self::HenyeyGreenstein(g) => g.abs() >= PEAKED,
            Self::Rayleigh => false,
            Self::Tabulated(table) => table.most() >= PEAK,
            Self::Microflakes(flakes) => flakes.is_peaked(),
        }
    }
}

/// The cosine of the angle to the direction of propagation as 1 − cos θ, or as 1 + cos θ and true: exact near the peak.
#[inline]
fn henyey_greenstein_cosine(g: f32, u: f32) -> (f32, bool) {
    let (a, v) = (g.abs(), 1.0 - u);
    // The inverse of the distribution, solved for 1 − cos θ, so that it needs no division by g.
    let (near, step) = (1.0 - a, 1.0 - a + 2.0 * a * u);
    let s = near * (1.0 + a) / step;
    (near * v * (s + near) / step, g < 0.0)
}

/// As [`henyey_greenstein_cosine`], for Rayleigh's lobe.
#[inline]
fn rayleigh_cosine(u: f32) -> (f32, bool) {
    // Cardano's solution of the cubic distribution, for the upper half; the lower one mirrors it.
    let z = (4.0 * u - 2.0).abs();
    let root = (z + (z * z + 1.0).sqrt()).cbrt();
    (1.0 - (root - 1.0 / root).min(1.0), u < 0.5)
}

impl PhaseFunction {
    /// All directions alike.
    pub const ISOTROPIC: Self = Self {
        lobes: [PhaseLobe::HenyeyGreenstein(0.0); MOST_LOBES],
        shares: [1.0, 0.0, 0.0, 0.0],
        count: 1,
        oriented: false,
    };

    /// Prepares a description, the mean of one that varies; `None` for one with more than [`MOST_LOBES`] lobes, and for a table that is none.
    pub fn new(desc: &PhaseDesc) -> Option<Self> {
        Self::with_grids(desc).map(|(phase, _)| phase)
    }

    /// As [`PhaseFunction::new`], with the lobes that vary.
    pub(super) fn with_grids(desc: &PhaseDesc) -> Option<(Self, LobeGrids)> {
        let (mut phase, mut grids) = (Self { count: 0, ..Self::ISOTROPIC }, Vec::new());
        phase.add(desc, 1.0, &mut grids)?;
        Some((phase, grids))
    }

    fn add(&mut self, desc: &PhaseDesc, share: f64, grids: &mut LobeGrids) -> Option<()> {
        let lobe = match desc {
            PhaseDesc::Isotropic => PhaseLobe::HenyeyGreenstein(0.0),
            PhaseDesc::HenyeyGreenstein { g } => PhaseLobe::HenyeyGreenstein(*g as f32),
            PhaseDesc::Rayleigh => PhaseLobe::Rayleigh,
            PhaseDesc::Tabulated { values } => PhaseLobe::Tabulated(PhaseTable::shared(values)?),
            PhaseDesc::Microflakes(MicroflakeDesc::Uniform(s)) => {
                PhaseLobe::Microflakes(Microflakes::new(*s))
            }
            PhaseDesc::Microflakes(MicroflakeDesc::Grid(grid)) => {
                PhaseLobe::Microflakes(Microflakes::new(grid.mean()))
            }
            PhaseDesc::Blend { weight, phases } => {
                self.add(&phases[0], share * (1.0 - weight), grids)?;
                return self.add(&phases[1], share * weight, grids);
            }
        };
        if share > 0.0 {
            let slot = self.count as usize;
            *self.lobes.get_mut(slot)? = lobe;
            self.shares[slot] = share as f32;
            self.count += 1;
            self.oriented |= matches!(lobe, PhaseLobe::Microflakes(_));
            if let PhaseDesc::Microflakes(MicroflakeDesc::Grid(grid)) = desc {
                grids.push((slot, grid.clone()));
            }
        }
        Some(())
    }

    /// Puts microflakes of another matrix into a lobe.
    pub(super) fn set_microflakes(&mut self, lobe: usize, s: [f32; 6]) {
        self.lobes[lobe] = PhaseLobe::Microflakes(Microflakes::new(s.map(f64::from)));
    }

    /// Bound of the projected area, where these lobes vary.
    pub(super) fn most_area(&self, grids: &[(usize, Arc<MicroflakeGrid>)]) -> f32 {
        let of = |(slot, (lobe, share)): (usize, (&PhaseLobe, f32))| {
            let grid = grids.iter().find(|(varying, _)| *varying == slot).map(|(_, grid)| grid);
            // Fibres that are thinner than the thinnest are made a little thicker.
            let area = match (grid, lobe) {
                (Some(grid), _) => grid.most().sqrt() * (1.0 + 1e-4),
                (None, PhaseLobe::Microflakes(flakes)) => flakes.most_area(),
                (None, _) => 1.0,
            };
            share * area
        };
        self.shared().enumerate().map(of).sum()
    }

    #[inline]
    fn shared(&self) -> impl Iterator<Item = (&PhaseLobe, f32)> {
        self.lobes.iter().zip(self.shares).take(self.count as usize)
    }

    /// True where it has microflakes: directions are those of world space.
    #[inline]
    pub fn is_oriented(&self) -> bool {
        self.oriented
    }

    /// The density per steradian of scattering from `wo` to `wi`; both point away from the vertex.
    #[inline]
    pub fn density(&self, wo: Vec3, wi: Vec3) -> f32 {
        let density = self.shared().map(|(lobe, share)| share * lobe.eval(wo, wi)).sum::<f32>();
        if !self.oriented {
            return density;
        }
        let area = self.projected_area(wo);
        if area > 0.0 { density / area } else { 0.0 }
    }
}

impl ScatteringModel for PhaseFunction {
    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        let density = self.density(wo, wi);
        Some((SampledSpectrum::splat(density), PdfW(density)))
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        let mut left = lobe * self.projected_area(wo);
        let mut chosen = &self.lobes[0];
        for (lobe, share) in self.shared() {
            chosen = lobe;
            left -= share * lobe.projected_area(wo);
            if left < 0.0 {
                break;
            }
        }
        let wi = chosen.sample(wo, u);
        let pdf = PdfW(self.density(wo, wi));
        // Rounding may lead to where a table is 0.
        (pdf.0 > 0.0).then(|| BsdfSample::reflection(wi, SampledSpectrum::ONE, pdf))
    }

    #[inline]
    fn projected_area(&self, d: Vec3) -> f32 {
        match self.oriented {
            true => self.shared().map(|(lobe, share)| share * lobe.projected_area(d)).sum(),
            false => 1.0,
        }
    }

    #[inline]
    fn is_glossy(&self) -> bool {
        self.shared().any(|(lobe, _)| lobe.is_peaked())
    }

    /// Photons show what is scattered into all directions: those around a vertex rarely come from where a narrow peak scatters from.
    #[inline]
    fn has_diffuse_part(&self) -> bool {
        self.shared().any(|(lobe, _)| match lobe {
            PhaseLobe::HenyeyGreenstein(g) => g.abs() < NARROW,
            PhaseLobe::Tabulated(table) => table.most() < NARROW_PEAK,
            PhaseLobe::Rayleigh | PhaseLobe::Microflakes(_) => true,
        })
    }

    #[inline]
    fn transmits(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    fn hg(g: f64) -> PhaseDesc {
        PhaseDesc::HenyeyGreenstein { g }
    }

    fn table(values: &[f64]) -> PhaseDesc {
        PhaseDesc::Tabulated { values: values.into() }
    }

    fn flakes(s: [f64; 6]) -> PhaseDesc {
        PhaseDesc::Microflakes(MicroflakeDesc::Uniform(s))
    }

    fn blend(weight: f64, a: PhaseDesc, b: PhaseDesc) -> PhaseDesc {
        PhaseDesc::Blend { weight, phases: Box::new([a, b]) }
    }

    /// Those that look alike from everywhere.
    fn rotational() -> Vec<PhaseDesc> {
        let mut all: Vec<PhaseDesc> = [0.0, 1e-9, 0.3, -0.6, 0.9, 0.999, -0.999].map(hg).into();
        all.extend([PhaseDesc::Isotropic, PhaseDesc::Rayleigh, blend(0.3, hg(0.8), PhaseDesc::Rayleigh)]);
        all.push(blend(0.5, blend(0.2, hg(-0.3), PhaseDesc::Isotropic), hg(0.95)));
        all.extend([table(&[1.0, 1.0]), table(&[0.0, 3e30]), table(&[0.0, 0.0, 1.0, 0.0, 2.0, 7.0])]);
        all.push(blend(0.7, table(&[5.0, 0.0, 0.0, 1e-3, 1.0]), hg(0.5)));
        all
    }

    /// Those of microflakes: a ball, fibres, flat flakes, turned ones, and blends.
    fn oriented() -> Vec<PhaseDesc> {
        let turned = [0.5, 0.7, 0.3, 0.1, -0.05, 0.08];
        let mut all =
            [[1.0, 1.0, 1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.05, 0.0, 0.0, 0.0], turned].map(flakes).to_vec();
        all.extend([flakes([0.09, 0.09, 1.0, 0.0, 0.0, 0.0]), blend(0.4, hg(0.6), flakes(turned))]);
        all.push(blend(0.5, flakes(turned), flakes([0.2, 0.04, 0.6, 0.0, 0.1, 0.0])));
        all
    }

    /// The mean cosine of the angle between the directions of propagation before and after.
    fn mean_cosine(desc: &PhaseDesc) -> f64 {
        match desc {
            PhaseDesc::HenyeyGreenstein { g } => *g,
            PhaseDesc::Tabulated { values } => {
                let (mut sum, mut moment) = (0.0, 0.0);
                let step = 2.0 / (values.len() - 1) as f64;
                for (i, pair) in values.windows(2).enumerate() {
                    let [a, b] = [pair[0], pair[1]];
                    let [from, to] = [-1.0 + step * i as f64, -1.0 + step * (i + 1) as f64];
                    sum += 0.5 * (a + b);
                    moment += (from * a + to * b) / 3.0 + (from * b + to * a) / 6.0;
                }
                moment / sum
            }
            PhaseDesc::Blend { weight, phases } => {
                (1.0 - weight) * mean_cosine(&phases[0]) + weight * mean_cosine(&phases[1])
            }
            _ => 0.0,
        }
    }

    /// The density integrates to 1 and has the stated mean cosine; samples have it too.
    #[test]
    fn densities_are_normalised_and_sampled() {
        let wo = Vec3::new(0.36, -0.48, 0.8);
        for desc in rotational() {
            let phase = PhaseFunction::new(&desc).expect("few lobes");
            // Steps that are fine near both poles, cos θ = tanh x, up to far within the narrowest peak.
            let (mut sum, mut cosine) = (0.0, 0.0);
            let frame = Frame::new(-wo);
            let steps = 40_000;
            for i in 0..steps {
                let x = 14.0 * ((i as f64 + 0.5) / f64::from(steps) * 2.0 - 1.0);
                let (cos, sin) = (x.tanh(), 1.0 / x.cosh());
                let wi = frame.to_world(Vec3::new(sin as f32, 0.0, cos as f32));
                let weight = std::f64::consts::TAU * sin * sin * 28.0 / f64::from(steps);
                let density = f64::from(phase.density(wo, wi)) * weight;
                (sum, cosine) = (sum + density, cosine + density * cos);
            }
            assert!((sum - 1.0).abs() < 2e-3, "{desc:?}: {sum}");
            let mean = mean_cosine(&desc);
            assert!((cosine - mean).abs() < 2e-3, "{desc:?}: {cosine} {mean}");
            let (count, mut sampled) = (1 << 14, 0.0);
            for i in 0..count {
                let u = [(i as f32 + 0.5) / count as f32, (i as f32 * 0.618_034).fract()];
                let s = phase.sample(wo, u, (i as f32 * 0.754_877_7).fract()).expect("always");
                assert!((s.wi.length() - 1.0).abs() < 1e-5 && s.pdf.0 > 0.0 && s.pdf.0.is_finite());
                sampled += f64::from(-wo.dot(s.wi)) / f64::from(count);
            }
            assert!((sampled - mean).abs() < 5e-3, "{desc:?}: {sampled} {mean}");
        }
    }

    /// Microflakes and tables: how many samples fall into each of 16 × 32 cells of the sphere, against the integral of the density there. What a flake
    /// sees in one direction it sees in the other.
    #[test]
    fn samples_have_the_density_in_every_direction() {
        let (rows, columns, fine) = (16, 32, 24);
        let all = oriented().into_iter().chain(rotational().into_iter().skip(11));
        for (number, desc) in all.enumerate() {
            let phase = PhaseFunction::new(&desc).expect("few lobes");
            for wo in [Vec3::new(0.36, -0.48, 0.8), Vec3::new(0.6, 0.8, 0.0), Vec3::NEG_Z] {
                let mut expected = vec![0.0; rows * columns];
                let cell_area = 2.0 * std::f64::consts::TAU / ((rows * columns * fine * fine) as f64);
                for row in 0..rows * fine {
                    for column in 0..columns * fine {
                        let z = 1.0 - 2.0 * (row as f32 + 0.5) / (rows * fine) as f32;
                        let (sin, cos) = (TAU * (column as f32 + 0.5) / (columns * fine) as f32).sin_cos();
                        let r = (1.0 - z * z).sqrt();
                        let wi = Vec3::new(r * cos, r * sin, z);
                        let density = phase.density(wo, wi);
                        let cell = (row / fine) * columns + column / fine;
                        expected[cell] += f64::from(density) * cell_area;
                        if column % 17 == 0 {
                            let [there, back] = [
                                phase.projected_area(wo) * density,
                                phase.projected_area(wi) * phase.density(wi, wo),
                            ];
                            assert!(
                                (there - back).abs() <= 1e-3 * there.max(back),
                                "{desc:?}: {there} {back}"
                            );
                        }
                    }
                }
                let sum: f64 = expected.iter().sum();
                assert!((sum - 1.0).abs() < 5e-3, "{desc:?} from {wo}: {sum}");
                let count = 1 << 16;
                let (mut found, mut random) = (vec![0.0; rows * columns], Random(number as u64));
                for _ in 0..count {
                    let s = phase.sample(wo, [random.f32(), random.f32()], random.f32());
                    let Some(s) = s else { continue };
                    assert!((s.pdf.0 - phase.density(wo, s.wi)).abs() <= 1e-6 * s.pdf.0, "{desc:?}");
                    let row = ((1.0 - s.wi.z) * 0.5 * rows as f32) as usize;
                    let column = (s.wi.y.atan2(s.wi.x).rem_euclid(TAU) / TAU * columns as f32) as usize;
                    found[row.min(rows - 1) * columns + column.min(columns - 1)] += 1.0;
                }
                for (found, share) in found.into_iter().zip(expected) {
                    let wanted = share * f64::from(count);
                    let off: f64 = (found - wanted) / (wanted + 1e-4 * wanted * wanted + 4.0).sqrt();
                    assert!(off.abs() < 6.0, "{desc:?} from {wo}: {found} in a cell, not {wanted}");
                }
            }
        }
    }

    /// The densities of `eval_pdf` and the area of `projected_area` in Mitsuba 3.9.1.
    #[test]
    fn densities_are_those_of_mitsuba() {
        let wo = Vec3::new(0.36, -0.48, 0.8);
        let near = |found: f32, wanted: f32| {
            assert!((found - wanted).abs() < 1e-5 * wanted, "{found}, not {wanted}")
        };
        let phase = PhaseFunction::new(&flakes([0.5, 0.7, 0.3, 0.1, -0.05, 0.08])).expect("one lobe");
        near(phase.projected_area(wo), 0.541_553_4);
        near(phase.density(wo, Vec3::new(0.6, 0.48, 0.64)), 0.038_470_55);
        let phase = PhaseFunction::new(&table(&[0.5, 1.0, 1.5, 4.0])).expect("one lobe");
        near(phase.density(wo, -wo), 0.201_037_8);
        near(phase.density(wo, Vec3::new(0.6, 0.48, 0.64)), 0.044_067_48);
    }

    /// Flakes that are flat, fibres without thickness, and those that are large, small or nothing.
    #[test]
    fn extreme_microflakes_stay_sound() {
        let mut random = Random(1);
        for s in [
            [1.0, 1.0, 0.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            [1.0; 6],
            [1e6, 1e6, 1e-6, 0.0, 0.0, 0.0],
            [1e-30, 2e-30, 1e-30, 0.0, 5e-31, 0.0],
            [0.0; 6],
        ] {
            let phase = PhaseFunction::new(&flakes(s)).expect("one lobe");
            for _ in 0..1000 {
                let [wo, wi] = [warp_sphere(&mut random), warp_sphere(&mut random)];
                let (area, density) = (phase.projected_area(wo), phase.density(wo, wi));
                let bound = (s[0] + s[1] + s[2]).sqrt() as f32;
                assert!((0.0..=bound * 1.001).contains(&area), "{s:?}: {area}");
                assert!(density >= 0.0 && density.is_finite(), "{s:?}: {density}");
                assert_eq!(phase.density(wo, -wo), 0.0, "{s:?}");
                if let Some(sample) = phase.sample(wo, [random.f32(), random.f32()], 0.5) {
                    assert!((sample.wi.length() - 1.0).abs() < 1e-5, "{s:?}: {}", sample.wi);
                    assert!(sample.pdf.0 > 0.0 && sample.pdf.0.is_finite(), "{s:?}: {}", sample.pdf.0);
                } else {
                    assert_eq!(s, [0.0; 6], "a flake that is seen scatters");
                }
            }
        }
    }

    fn warp_sphere(random: &mut Random) -> Vec3 {
        crate::math::warp::sphere([random.f32(), random.f32()])
    }

    /// A table without a density is none, and equal ones are kept once.
    #[test]
    fn tables_are_shared() {
        for values in [&[][..], &[1.0], &[0.0, 0.0], &[1.0, -1.0], &[f64::NAN, 1.0], &[f64::INFINITY, 1.0]] {
            assert!(PhaseFunction::new(&table(values)).is_none(), "{values:?}");
        }
        let kept =
            [[1.0, 2.0, 5.0], [2.0, 4.0, 10.0]].map(|values| PhaseTable::shared(&values).expect("a table"));
        assert!(std::ptr::eq(kept[0], kept[1]));
    }

    #[test]
    fn too_many_lobes_are_refused() {
        let three = blend(0.5, blend(0.5, hg(0.1), hg(0.2)), hg(0.3));
        assert!(PhaseFunction::new(&three).is_some());
        assert!(PhaseFunction::new(&blend(0.5, three.clone(), three)).is_none());
    }
}
