//! The contract between paths and materials, which every model of scattering keeps.

use std::f32::consts::PI;

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::sampler::attainable;
use crate::tracer::wavelength_mis::Dispersion;

use super::diffuse::Diffuse;

/// A lobe number that chooses whatever comes last: transmission.
pub(super) const LAST_LOBE: f32 = 1.0 - f32::EPSILON / 2.0;

/// A lobe with any light in it has at least this probability, 2⁻¹²: rounding to the grid of random numbers is then no step of its
/// density that counts.
pub(super) const LEAST_LOBE: f32 = 1.0 / 4096.0;

/// The probability with which a lobe number is below it, for a lobe that wants the share `p` from 0 to 1 of the samples.
#[inline]
pub(super) fn lobe_probability(p: f32) -> f32 {
    attainable(if p > 0.0 && p < LEAST_LOBE { LEAST_LOBE } else { p })
}

/// The mean of a factor over the wavelengths that a path carries: its first lane, if it carries the hero only.
#[inline]
pub(super) fn carried_mean(factor: SampledSpectrum, hero_only: bool) -> f32 {
    if hero_only { factor.0.x } else { factor.mean() }
}

/// A direction chosen by a material.
#[derive(Clone, Copy, Debug)]
pub struct BsdfSample {
    /// The direction, local.
    pub wi: Vec3,
    /// f·|cos θᵢ| / pdf per lane.
    pub weight: SampledSpectrum,
    /// Density of the choice; of a `delta` the probability that it was chosen.
    pub pdf: PdfW,
    /// The direction was the only possible one.
    pub delta: bool,
    /// The direction went through the surface.
    pub transmitted: bool,
    /// The direction is right for the hero wavelength only: [`ScatteringModel::refract`] gives those of the others.
    pub hero_only: bool,
    /// (nᵢ/nₒ)² for transmission, else 1: undoes the radiance scaling where roulette looks at throughput.
    pub eta2: f32,
}

impl BsdfSample {
    /// A choice of this `probability` between lobes whose direction is the only one of its lobe.
    #[inline]
    pub fn delta(wi: Vec3, weight: SampledSpectrum, probability: f32) -> Self {
        Self { delta: true, ..Self::reflection(wi, weight, PdfW(probability)) }
    }

    /// Light from the mirror direction of `wo`, the only choice of its lobe.
    #[inline]
    pub fn mirror(wo: Vec3, weight: SampledSpectrum, probability: f32) -> Self {
        Self::delta(Vec3::new(-wo.x, -wo.y, wo.z), weight, probability)
    }

    /// A reflection that is not delta.
    #[inline]
    pub fn reflection(wi: Vec3, weight: SampledSpectrum, pdf: PdfW) -> Self {
        Self { wi, weight, pdf, delta: false, transmitted: false, hero_only: false, eta2: 1.0 }
    }
}

/// Result of [`ScatteringModel::delta_lobes`]: reflection, transmission.
pub type DeltaLobes = [Option<BsdfSample>; 2];

/// The point of a surface at which a material is evaluated, in world space; `MaterialEvalContext` in pbrt-v4.
#[derive(Clone, Copy, Debug)]
pub struct MaterialEvalContext {
    /// Shading normal, on the front.
    pub n: Vec3,
    /// Geometric normal, on the front.
    pub ng: Vec3,
    /// ∂p/∂u: exact where the surface has a bump, up to a factor where it is brushed, else 0.
    pub dp_du: Vec3,
    /// ∂p/∂v where the surface has a bump; else 0.
    pub dp_dv: Vec3,
    /// Where textures are asked; 0 where nothing on the surface is textured.
    pub texture: TexturePoint,
}

impl MaterialEvalContext {
    /// A point of a surface on which nothing is textured or brushed.
    #[inline(always)]
    pub fn uniform(n: Vec3, ng: Vec3) -> Self {
        Self { n, ng, dp_du: Vec3::ZERO, dp_dv: Vec3::ZERO, texture: TexturePoint::default() }
    }

    /// A point of a plane that has u along x and v along y.
    pub fn flat(texture: TexturePoint) -> Self {
        Self { n: Vec3::Z, ng: Vec3::Z, dp_du: Vec3::X, dp_dv: Vec3::Y, texture }
    }

    /// The shading frame.
    #[inline(always)]
    pub fn frame(&self) -> Frame {
        if self.dp_du == Vec3::ZERO { Frame::new(self.n) } else { self.frame_along() }
    }

    #[inline(never)]
    fn frame_along(&self) -> Frame {
        Frame::along(self.n, self.dp_du)
    }
}

/// A material before the wavelengths of a path are known: a description made ready for quick evaluation.
pub trait MaterialModel {
    /// The material at the wavelengths of a path.
    type Bsdf: ScatteringModel;

    /// Evaluates textures at a point of a surface, and spectra and indices, at the wavelengths of a path. Called once per path vertex.
    fn bsdf(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> Self::Bsdf;

    /// The same where a path is: only what tilts the shading frame asks for more than textures do.
    #[inline]
    fn at(&self, context: &MaterialEvalContext, lambda: &SampledWavelengths) -> Self::Bsdf {
        self.bsdf(&context.texture, lambda)
    }

    /// The albedo of its diffuse part, if it has one.
    fn diffuse_texture(&self) -> Option<&SpectrumTexture> {
        None
    }

    /// Its colour in a layer beside the picture, Mitsuba's diffuse reflectance: that of its diffuse part if it has one, otherwise π times
    /// what it scatters from the normal to `wo`.
    fn diffuse_reflectance(
        &self,
        at: &TexturePoint,
        lambda: &SampledWavelengths,
        wo: Vec3,
    ) -> SampledSpectrum {
        if let Some(texture) = self.diffuse_texture() {
            return texture.sample(at, lambda);
        }
        self.bsdf(at, lambda).eval(wo, Vec3::Z).map_or(SampledSpectrum::ZERO, |(value, _)| value * PI)
    }
}

/// A model of scattering at one point and at the wavelengths of one path, in the conventions of [the module](super).
pub trait ScatteringModel: Copy {
    /// f·|cos θᵢ| and the density with which [`sample`](Self::sample) chooses `wi`; `None` where that is zero, and always for a delta.
    #[inline]
    fn eval(&self, _wo: Vec3, _wi: Vec3) -> Option<(SampledSpectrum, PdfW)> {
        None
    }

    /// Chooses a direction with the numbers `u` (direction) and `lobe`; `None` where the path ends.
    fn sample(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample>;

    /// As [`sample`](Self::sample), for a path from a light: `wo` points to where the light comes from, and the weight is
    /// f·|cos θᵢ| / pdf with f of light that goes from `wo` to `wi`, but for what [the walk](crate::tracer::subpath) does for smooth
    /// normals and refraction. Differs for what has normals of its own.
    #[inline]
    fn sample_from_light(&self, wo: Vec3, u: [f32; 2], lobe: f32) -> Option<BsdfSample> {
        self.sample(wo, u, lobe)
    }

    /// The density with which [`sample_from_light`](Self::sample_from_light) chooses `wi`, per steradian.
    #[inline]
    fn pdf_from_light(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.eval(wo, wi).map_or(0.0, |(_, pdf)| pdf.0)
    }

    /// For a vertex in a medium, in place of the cosine of a surface: the area that the particles of the medium have, seen from the direction
    /// `d`, over that of particles that look alike from everywhere.
    #[inline]
    fn projected_area(&self, _d: Vec3) -> f32 {
        1.0
    }

    /// The material, where it is diffuse and nothing else.
    #[inline]
    fn as_diffuse(&self) -> Option<&Diffuse> {
        None
    }

    /// True when the material has a diffuse part: photons lie there and are gathered there. This depends on the material alone, not on
    /// directions or wavelengths: both ends of a path must agree.
    #[inline]
    fn has_diffuse_part(&self) -> bool {
        false
    }

    /// True when [`eval`](Self::eval) is always `None`: no light needs to be sampled.
    #[inline]
    fn is_delta(&self) -> bool {
        false
    }

    /// True when [`eval`](Self::eval) has a peak: which light matters depends on it.
    #[inline]
    fn is_glossy(&self) -> bool {
        false
    }

    /// True when [`eval`](Self::eval) may be positive for directions on opposite sides.
    #[inline]
    fn transmits(&self) -> bool {
        false
    }

    /// True when each lane is refracted into another direction, or by each part of a mixture: [`dispersion`](Self::dispersion) must be asked.
    #[inline]
    fn is_dispersive(&self) -> bool {
        false
    }

    /// The shares of the lanes in the results of [`eval`](Self::eval) and [`sample`](Self::sample), for rough refraction.
    #[inline]
    fn dispersion(&self, _wo: Vec3, _wi: Vec3) -> Dispersion {
        Dispersion::NONE
    }

    /// The reflection and the transmission that [`sample`](Self::sample) may choose as deltas, each as if it were the only choice: its weight is
    /// f·|cos| itself. All of them, in the very directions of `sample`, which then never ends the path; or none, which costs nothing but noise.
    /// A model that returns any must be listed in `continues` in `tracer/prepare/specular.rs`.
    #[inline]
    fn delta_lobes(&self, _wo: Vec3) -> DeltaLobes {
        [None; 2]
    }

    /// A lobe number that chooses the same delta as `lobe` did for `wo`, reflection or transmission, at all wavelengths that choose it at all.
    #[inline]
    fn delta_lobe(&self, _wo: Vec3, _lobe: f32, transmitted: bool) -> f32 {
        if transmitted { LAST_LOBE } else { 0.0 }
    }

    /// The direction into which a delta refracts `lane`, and its (nᵢ/nₒ)²; `None` on total reflection.
    #[inline]
    fn refract(&self, _wo: Vec3, _lane: usize) -> Option<(Vec3, f32)> {
        None
    }
}
