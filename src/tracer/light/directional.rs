//! Light from one direction, infinitely far away.

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::SurfacePoint;

use super::bounds::LightBounds;
use super::emission::{EmissionOrigin, EmissionPdf, infinite_pdf, infinite_ray};
use super::sample::{LightSample, LightSampleContext};
use super::source::LightSource;

/// Parallel light. Its spectrum is the irradiance of a surface that faces it.
#[derive(Clone, Debug)]
pub struct DirectionalLight {
    /// Unit direction in which the light goes, world space.
    pub direction: Vec3,
}

impl LightSource for DirectionalLight {
    #[inline]
    fn sample(&self, _: LightSampleContext, _: [f32; 2]) -> Option<LightSample> {
        Some(LightSample { wi: -self.direction, target: None, scale: 1.0, pdf: PdfW(1.0), delta: true })
    }

    #[inline]
    fn pdf(&self, _: LightSampleContext, _: Vec3, _: Option<&SurfacePoint>) -> PdfW {
        PdfW::ZERO
    }

    fn power(&self, scene: BoundingSphere) -> f32 {
        // Power through a disk as large as the scene.
        scene.radius * scene.radius
    }

    fn bounds(&self, power: f32, scene: BoundingSphere) -> (LightBounds, [Vec3; 2]) {
        LightBounds::parallel(self.direction, power, scene)
    }

    #[inline]
    fn emit(&self, u: &LightNumbers, scene: BoundingSphere) -> Option<(SurfacePoint, Vec3)> {
        Some(infinite_ray(self.direction, u.place, scene))
    }

    #[inline]
    fn emission_pdf(&self, _: Vec3, _: Vec3, scene: BoundingSphere, choice: f32) -> EmissionPdf {
        EmissionPdf { origin: EmissionOrigin::Parallel, ..infinite_pdf(choice, scene) }
    }
}
