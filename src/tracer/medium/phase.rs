//! Phase functions: the density of directions into which a medium scatters.
//!
//! A vertex in a medium is a vertex whose bsdf is a phase function: [`PhaseFunction`] keeps the contract of
//! [`ScatteringModel`], without a cosine and without a surface. Its frame has any normal. It is normalised to 1, so that the weight of a sample
//! is 1: how much a medium absorbs is its albedo's to say.

use std::f32::consts::{FRAC_1_PI, TAU};

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::scene::desc::PhaseDesc;
use crate::spectrum::SampledSpectrum;
use crate::tracer::bsdf::{BsdfSample, ScatteringModel};

/// Most lobes of a phase function.
pub const MOST_LOBES: usize = PhaseDesc::MOST_PARTS;

/// 1 / (4π).
const UNIFORM: f32 = 0.25 * FRAC_1_PI;

/// From this mean cosine on a lobe is a peak: which light matters depends on it.
const PEAKED: f32 = 0.5;

/// From this mean cosine on a lobe counts as a rough mirror rather than as diffuse.
const NARROW: f32 = 0.9;

/// A phase function: a few lobes, each with its share.
#[derive(Clone, Copy, Debug)]
pub struct PhaseFunction {
    lobes: [PhaseLobe; MOST_LOBES],
    /// Shares of the lobes, whose sum is 1.
    shares: [f32; MOST_LOBES],
    count: u32,
}

/// One lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PhaseLobe {
    /// Henyey and Greenstein's (1941) with this mean cosine; all directions alike for 0.
    HenyeyGreenstein(f32),
    /// Rayleigh's.
    Rayleigh,
}

impl PhaseLobe {
    /// The density per steradian of going on in the direction `forward` turned to `wi`, unit vectors.
    #[inline]
    fn eval(self, forward: Vec3, wi: Vec3) -> f32 {
        match self {
            Self::HenyeyGreenstein(g) if g.abs() < f32::EPSILON => UNIFORM,
            Self::HenyeyGreenstein(g) => {
                // 1 ∓ cos θ of unit vectors is half their squared distance, without cancellation at the peak.
                let peak = if g < 0.0 { -forward } else { forward };
                let (g, off) = (g.abs(), 0.5 * peak.distance_squared(wi));
                let d = (1.0 - g) * (1.0 - g) + 2.0 * g * off;
                UNIFORM * (1.0 - g) * (1.0 + g) / (d * d.sqrt())
            }
            Self::Rayleigh => {
                let cos = forward.dot(wi);
                0.75 * UNIFORM * (1.0 + cos * cos)
            }
        }
    }

    /// The cosine of the angle to `forward` as 1 − cos θ if it is below 1, and the sign of the side: exact near either pole.
    #[inline]
    fn sample_cosine(self, u: f32) -> (f32, bool) {
        match self {
            Self::HenyeyGreenstein(g) => {
                let (a, v) = (g.abs(), 1.0 - u);
                // The inverse of the distribution, solved for 1 − cos θ, so that it needs no division by g.
                let (near, step) = (1.0 - a, 1.0 - a + 2.0 * a * u);
                let s = near * (1.0 + a) / step;
                (near * v * (s + near) / step, g < 0.0)
            }
            Self::Rayleigh => {
                // Cardano's solution of the cubic distribution, for the upper half; the lower one mirrors it.
                let z = (4.0 * u - 2.0).abs();
                let root = (z + (z * z + 1.0).sqrt()).cbrt();
                (1.0 - (root - 1.0 / root).min(1.0), u < 0.5)
            }
        }
    }
}

impl PhaseFunction {
    /// All directions alike.
    pub const ISOTROPIC: Self = Self {
        lobes: [PhaseLobe::HenyeyGreenstein(0.0); MOST_LOBES],
        shares: [1.0, 0.0, 0.0, 0.0],
        count: 1,
    };

    /// Prepares a description; `None` for one with more than [`MOST_LOBES`] lobes.
    pub fn new(desc: &PhaseDesc) -> Option<Self> {
        let mut phase =
            Self { lobes: [PhaseLobe::Rayleigh; MOST_LOBES], shares: [0.0; MOST_LOBES], count: 0 };
        phase.add(desc, 1.0)?;
        Some(phase)
    }

    fn add(&mut self, desc: &PhaseDesc, share: f64) -> Option<()> {
        let lobe = match desc {
            PhaseDesc::Isotropic => PhaseLobe::HenyeyGreenstein(0.0),
            PhaseDesc::HenyeyGreenstein { g } => PhaseLobe::HenyeyGreenstein(*g as f32),
            PhaseDesc::Rayleigh => PhaseLobe::Rayleigh,
            PhaseDesc::Blend { weight, phases } => {
                self.add(&phases[0], share * (1.0 - weight))?;
                return self.add(&phases[1], share * weight);
            }
        };
        if share > 0.0 {
            let slot = self.count as usize;
            *self.lobes.get_mut(slot)? = lobe;
            self.shares[slot] = share as f32;
            self.count += 1;
        }
        Some(())
    }

    #[inline]
    fn shared(&self) -> impl Iterator<Item = (PhaseLobe, f32)> {
        self.lobes.into_iter().zip(self.shares).take(self.count as usize)
    }

    /// The density per steradian of scattering from `wo` to `wi`; both point away from the vertex.
    #[inline]
    pub fn density(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.shared().map(|(lobe, share)| share * lobe.eval(-wo, wi)).sum()
    }

    /// The mean cosine of the angle between the directions of propagation before and after.
    pub fn mean_cosine(&self) -> f32 {
        let of = |lobe| if let PhaseLobe::HenyeyGreenstein(g) = lobe { g } else { 0.0 };
        self.shared().map(|(lobe, share)| share * of(lobe)).sum()
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
        let mut left = lobe;
        let mut chosen = self.lobes[0];
        for (lobe, share) in self.shared() {
            chosen = lobe;
            left -= share;
            if left < 0.0 {
                break;
            }
        }
        let (off, backwards) = chosen.sample_cosine(u[0]);
        let sin = (off * (2.0 - off)).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * u[1]).sin_cos();
        let peak = if backwards { wo } else { -wo };
        let wi = Frame::new(peak).to_world(Vec3::new(sin * cos_phi, sin * sin_phi, 1.0 - off)).normalize();
        Some(BsdfSample::reflection(wi, SampledSpectrum::ONE, PdfW(self.density(wo, wi))))
    }

    #[inline]
    fn is_glossy(&self) -> bool {
        self.shared().any(|(lobe, _)| matches!(lobe, PhaseLobe::HenyeyGreenstein(g) if g.abs() >= PEAKED))
    }

    /// Photons show what is scattered into all directions: those around a vertex rarely come from where a narrow peak scatters from.
    #[inline]
    fn has_diffuse_part(&self) -> bool {
        self.shared().any(|(lobe, _)| match lobe {
            PhaseLobe::HenyeyGreenstein(g) => g.abs() < NARROW,
            PhaseLobe::Rayleigh => true,
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

    fn all() -> Vec<PhaseDesc> {
        let hg = |g| PhaseDesc::HenyeyGreenstein { g };
        let blend = |weight, a, b| PhaseDesc::Blend { weight, phases: Box::new([a, b]) };
        let mut all: Vec<PhaseDesc> = [0.0, 1e-9, 0.3, -0.6, 0.9, 0.999, -0.999].map(hg).into();
        all.extend([PhaseDesc::Isotropic, PhaseDesc::Rayleigh, blend(0.3, hg(0.8), PhaseDesc::Rayleigh)]);
        all.push(blend(0.5, blend(0.2, hg(-0.3), PhaseDesc::Isotropic), hg(0.95)));
        all
    }

    /// The density integrates to 1 and has the stated mean cosine; samples have it too.
    #[test]
    fn densities_are_normalised_and_sampled() {
        let wo = Vec3::new(0.36, -0.48, 0.8);
        for desc in all() {
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
            let mean = f64::from(phase.mean_cosine());
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

    #[test]
    fn too_many_lobes_are_refused() {
        let hg = |g| PhaseDesc::HenyeyGreenstein { g };
        let blend = |a, b| PhaseDesc::Blend { weight: 0.5, phases: Box::new([a, b]) };
        let three = blend(blend(hg(0.1), hg(0.2)), hg(0.3));
        assert!(PhaseFunction::new(&three).is_some());
        assert!(PhaseFunction::new(&blend(three.clone(), three)).is_none());
    }
}
