//! The same radiance from everywhere.

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::SurfacePoint;

use super::lights::{UNIFORM_PDF, infinite_pdf, infinite_ray};
use super::selector::LightBounds;
use super::{BoundingSphere, EmissionPdf, LightSample, LightSampleContext, LightSource};

/// A constant environment. What matters about a direction is the cosine at the lit point, so that is what
/// directions are sampled by: only the hemisphere that is seen is sampled.
#[derive(Clone, Debug)]
pub struct ConstantLight;

impl LightSource for ConstantLight {
    #[inline]
    fn sample(&self, at: LightSampleContext, u: [f32; 2]) -> Option<LightSample> {
        let local = warp::cosine_hemisphere(u);
        let pdf = PdfW(warp::cosine_hemisphere_pdf(local.z));
        let wi = Frame::new(at.n).to_world(local);
        Some(LightSample { wi, target: None, scale: 1.0, pdf, delta: false })
    }

    #[inline]
    fn pdf(&self, at: LightSampleContext, wi: Vec3, hit: Option<&SurfacePoint>) -> PdfW {
        match hit {
            None => PdfW(warp::cosine_hemisphere_pdf(wi.dot(at.n))),
            Some(_) => PdfW::ZERO,
        }
    }

    fn power(&self, scene: BoundingSphere) -> f32 {
        scene.environment_power()
    }

    fn bounds(&self, power: f32, scene: BoundingSphere) -> (LightBounds, [Vec3; 2]) {
        LightBounds::infinite(power, scene)
    }

    fn is_environment(&self) -> bool {
        true
    }

    #[inline]
    fn emit(&self, u: &LightNumbers, scene: BoundingSphere) -> Option<(SurfacePoint, Vec3)> {
        Some(infinite_ray(warp::sphere(u.direction), u.place, scene))
    }

    #[inline]
    fn emission_pdf(&self, _: Vec3, _: Vec3, scene: BoundingSphere, choice: f32) -> EmissionPdf {
        infinite_pdf(choice * UNIFORM_PDF, scene)
    }
}
