//! The interface of lights.

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::SurfacePoint;

use super::bounds::LightBounds;
use super::emission::EmissionPdf;
use super::sample::{LightSample, LightSampleContext};

/// A light of one kind. Densities here are without the probability of choosing the light, unless said.
pub trait LightSource {
    /// Samples a direction from the lit point `at` by the numbers `u`.
    fn sample(&self, at: LightSampleContext, u: [f32; 2]) -> Option<LightSample>;

    /// The density of [`LightSource::sample`] for the direction `wi`, which hit the light at `hit`; that is `None` for an
    /// environment.
    fn pdf(&self, at: LightSampleContext, wi: Vec3, hit: Option<&SurfacePoint>) -> PdfW;

    /// Power over π of a light of spectrum 1: its area for a surface.
    fn power(&self, scene: BoundingSphere) -> f32;

    /// Bounds of the light of power `power` (over π), for choosing among lights, and corners of the box around it.
    fn bounds(&self, power: f32, scene: BoundingSphere) -> (LightBounds, [Vec3; 2]);

    /// Samples a ray that leaves the light: origin, for an environment on a disk before the scene, and direction.
    fn emit(&self, u: &LightNumbers, scene: BoundingSphere) -> Option<(SurfacePoint, Vec3)>;

    /// The densities of [`LightSource::emit`] for the ray from `p` (not used for an environment) in `direction`, where the
    /// light is chosen with probability `choice`.
    fn emission_pdf(&self, p: Vec3, direction: Vec3, scene: BoundingSphere, choice: f32) -> EmissionPdf;

    /// True if it surrounds the scene, infinitely far away. A scene has at most one of these.
    #[inline]
    fn is_environment(&self) -> bool {
        false
    }

    /// True if its emission depends on the place or the direction.
    #[inline]
    fn varies(&self) -> bool {
        false
    }

    /// The factor on the light's spectrum for light from the point `p` of it (not used for an environment) that arrives along
    /// `wi`, where that [varies](LightSource::varies).
    #[inline]
    fn factor(&self, _p: Vec3, _wi: Vec3, _lambda: &SampledWavelengths) -> SampledSpectrum {
        SampledSpectrum::ONE
    }

    /// The factor for a ray of [`LightSource::emit`], from `p` in `direction`.
    #[inline]
    fn emitted(&self, p: Vec3, direction: Vec3, lambda: &SampledWavelengths) -> SampledSpectrum {
        self.factor(p, -direction, lambda)
    }

    /// Where it is, if it is a point.
    #[inline]
    fn position(&self) -> Option<Vec3> {
        None
    }

    /// True if each of its points emits in one direction only: neither next-event estimation nor a hit finds its light, but
    /// light subpaths do.
    fn is_beam(&self) -> bool {
        false
    }

    /// Share of its light that next-event estimation looks for, which the choice among lights goes by. The rest is found by
    /// scattering alone (an environment's), or from the light (a beam's). With 0, the light is never sampled.
    fn sought_share(&self) -> f32 {
        if self.is_beam() { 0.0 } else { 1.0 }
    }

    /// True if it emits nothing whatever its spectrum.
    fn is_black(&self) -> bool {
        false
    }
}
