//! What a path carries from vertex to vertex, and what it has found.

use glam::{Vec3, Vec4};

use crate::color::Xyz;
use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::bsdf::BsdfSample;
use crate::tracer::light::{Lights, LitPoint};
use crate::tracer::{mis, roulette};

/// A path on its way, or one of its branches.
#[derive(Clone)]
pub(super) struct Carried {
    pub(super) lambda: SampledWavelengths,
    /// Product of the weights so far.
    pub(super) throughput: SampledSpectrum,
    /// Radiance found so far at the present wavelengths.
    radiance: SampledSpectrum,
    /// What was found before the companions were dropped.
    banked: Xyz,
    /// Takes the throughput to what roulette compares with 1: undoes the radiance scaling of refraction and the share
    /// of a branch.
    relative: f32,
    /// How the last direction was chosen; `None` by a delta.
    last: Option<(LitPoint, PdfW)>,
    /// Emission at the wavelengths of the path: light, value.
    emission: Option<(u32, SampledSpectrum)>,
    /// Segments so far.
    pub(super) depth: u32,
    /// The path has split already.
    is_branch: bool,
}

impl Carried {
    pub(super) fn new(lambda: SampledWavelengths) -> Self {
        Self {
            lambda,
            throughput: SampledSpectrum::ONE,
            radiance: SampledSpectrum::ZERO,
            banked: Xyz::BLACK,
            relative: 1.0,
            last: None,
            emission: None,
            depth: 0,
            is_branch: false,
        }
    }

    /// One of `count` equal branches.
    #[inline]
    pub(super) fn branch(&self, count: u32) -> Self {
        let share = 1.0 / count as f32;
        Self {
            throughput: self.throughput * share,
            relative: self.relative * count as f32,
            radiance: SampledSpectrum::ZERO,
            banked: Xyz::BLACK,
            is_branch: true,
            ..*self
        }
    }

    /// True once the path has split.
    #[inline]
    pub(super) fn is_branch(&self) -> bool {
        self.is_branch
    }

    /// Takes over what a branch has found.
    #[inline]
    pub(super) fn gather(&mut self, branch: &Carried) {
        if branch.lambda.is_hero_only() == self.lambda.is_hero_only() {
            self.radiance += branch.radiance;
        } else {
            self.banked += branch.found();
        }
    }

    /// All that was found.
    #[inline]
    pub(super) fn found(&self) -> Xyz {
        self.banked + self.lambda.to_xyz(self.radiance)
    }

    /// Adds radiance that a weight of the path leads to.
    #[inline]
    pub(super) fn add(&mut self, radiance: SampledSpectrum) {
        self.radiance += radiance;
    }

    /// The spectrum of `light` seen along `wi`, remembered if it is the same everywhere: most paths meet one light
    /// again and again.
    #[inline]
    pub(super) fn emission(&mut self, lights: &Lights, light: u32, wi: Vec3) -> SampledSpectrum {
        match self.emission {
            Some((known, value)) if known == light => value,
            _ => {
                let value = lights.spectrum(light, wi, &self.lambda);
                if !lights.is_directional(light) {
                    self.emission = Some((light, value));
                }
                value
            }
        }
    }

    /// Adds the emission of a light met by chance along `wi`; `pdf` is its density for light sampling from a lit point.
    #[inline]
    pub(super) fn meet(
        &mut self,
        lights: &Lights,
        (light, wi): (u32, Vec3),
        pdf: impl FnOnce(LitPoint) -> PdfW,
    ) {
        let weight = self.last.map_or(1.0, |(at, chosen)| mis::power(chosen, pdf(at)));
        let emission = self.emission(lights, light, wi);
        self.radiance += self.throughput * emission * weight;
    }

    /// Goes on by `s` from `at`.
    #[inline]
    pub(super) fn follow(&mut self, s: &BsdfSample, at: impl FnOnce() -> LitPoint) {
        self.throughput *= s.weight;
        self.relative *= s.eta2;
        self.last = (!s.delta).then(|| (at(), s.pdf));
        self.depth += 1;
        if s.hero_only {
            self.drop_companions();
        }
    }

    /// From here on only the hero wavelength is right. What was found so far was right for all and stays so.
    #[cold]
    fn drop_companions(&mut self) {
        self.banked = self.found();
        self.radiance = SampledSpectrum::ZERO;
        self.lambda.terminate_companions();
        self.throughput = SampledSpectrum(self.throughput.0 * Vec4::X);
    }

    /// Ends paths that carry little, in proportion, once they have `rr_depth` segments. False when this one ends.
    #[inline]
    pub(super) fn roulette(&mut self, rr_depth: u32, u: f32) -> bool {
        let policy = if self.is_branch { roulette::OF_BRANCHES } else { roulette::OF_PATHS };
        let armed = self.depth >= rr_depth.min(policy.latest);
        let carried = self.throughput.max_element() * self.relative;
        let factor = roulette::survivor_of(policy.sparing * carried, armed, u);
        factor.map(|factor| self.throughput *= factor).is_some()
    }
}
