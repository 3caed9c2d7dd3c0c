//! What a path carries from vertex to vertex, and what it has found.

use glam::{Vec3, Vec4};

use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::bsdf::{BsdfSample, Scattering};
use crate::tracer::light::{Lights, LitPoint};
use crate::tracer::wavelength_mis::WavelengthMis;
use crate::tracer::{mis, roulette};

/// A path on its way, or one of its branches.
#[derive(Clone)]
pub(super) struct Carried {
    /// What materials and lights are evaluated at: the wavelengths of the path, or one of them alone.
    pub(super) lambda: SampledWavelengths,
    /// Product of the weights so far.
    pub(super) throughput: SampledSpectrum,
    /// Radiance found so far at the wavelengths of the path.
    pub(super) radiance: SampledSpectrum,
    /// The wavelengths that would have chosen the same way, and what it counts for.
    wavelength_mis: (WavelengthMis, f32),
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
    /// It never will.
    whole: bool,
}

impl Carried {
    /// A path that starts at these wavelengths; `whole`: it does not split.
    pub(super) fn new(lambda: SampledWavelengths, whole: bool) -> Self {
        Self {
            lambda,
            throughput: SampledSpectrum::ONE,
            radiance: SampledSpectrum::ZERO,
            wavelength_mis: (WavelengthMis::ALL, 1.0),
            relative: 1.0,
            last: None,
            emission: None,
            depth: 0,
            is_branch: false,
            whole,
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
            is_branch: true,
            ..*self
        }
    }

    /// True for a path that splits where it can.
    #[inline]
    pub(super) fn splits(&self) -> bool {
        !(self.is_branch || self.whole)
    }

    /// Adds radiance that a weight of the path leads to, or that a part of it has found.
    #[inline]
    pub(super) fn add(&mut self, radiance: SampledSpectrum) {
        self.radiance += radiance;
    }

    /// The wavelength of `lane` alone, which parts from the others with the weight `w`; `eta2` as in [`BsdfSample`].
    pub(super) fn alone(&self, lane: usize, (w, eta2): (SampledSpectrum, f32)) -> Self {
        Self {
            lambda: self.lambda.alone(lane),
            throughput: self.throughput * SampledSpectrum(w.0 * Vec4::AXES[lane]),
            radiance: SampledSpectrum::ZERO,
            relative: self.relative * eta2,
            last: None,
            emission: None,
            depth: self.depth + 1,
            ..*self
        }
    }

    /// What the path counts for that goes on from a vertex of `bsdf` from `wo` to `wi`.
    #[inline]
    pub(super) fn counts_after(&self, bsdf: &impl Scattering, (wo, wi): (Vec3, Vec3)) -> f32 {
        match bsdf.parts_colors() {
            true => self.wavelength_mis.0.and(bsdf.part(wo, wi).wavelength_mis).weight(),
            false => self.wavelength_mis.1,
        }
    }

    /// The spectrum of `light` seen along `wi`, remembered if it is the same everywhere: most paths meet one light
    /// again and again.
    #[inline(always)]
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
        self.radiance += self.throughput * emission * (weight * self.wavelength_mis.1);
    }

    /// Goes on by `s` from a vertex of `bsdf` at `at`, which it came to from `wo`.
    #[inline]
    pub(super) fn follow(
        &mut self,
        s: &BsdfSample,
        (bsdf, wo): (&impl Scattering, Vec3),
        at: impl FnOnce() -> LitPoint,
    ) {
        self.throughput *= s.weight;
        self.relative *= s.eta2;
        self.last = (!s.delta).then(|| (at(), s.pdf));
        self.depth += 1;
        if s.transmitted && bsdf.parts_colors() {
            let wavelength_mis = self.wavelength_mis.0.and(bsdf.part(wo, s.wi).wavelength_mis);
            self.wavelength_mis = (wavelength_mis, wavelength_mis.weight());
        }
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
