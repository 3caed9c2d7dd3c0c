//! Points that emit the same in all directions.

use glam::Vec3;

use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::SurfacePoint;

use super::bounds::LightBounds;
use super::emission::{EmissionOrigin, EmissionPdf, UNIFORM_PDF};
use super::sample::{LightSample, LightSampleContext};
use super::source::LightSource;

/// A point.
#[derive(Clone, Debug)]
pub struct PointLight {
    /// World space.
    pub position: Vec3,
}

/// The only sample of a light at `position`, seen from `at`.
#[inline]
pub(super) fn sample_point(position: Vec3, at: Vec3) -> Option<LightSample> {
    let to = position - at;
    let distance2 = to.length_squared();
    let scale = 1.0 / distance2;
    // A light at the very point it lights has no direction.
    scale.is_finite().then(|| LightSample {
        wi: to * (1.0 / distance2.sqrt()),
        target: Some(position),
        scale,
        pdf: PdfW(1.0),
        delta: true,
    })
}

impl LightSource for PointLight {
    fn position(&self) -> Option<Vec3> {
        Some(self.position)
    }

    #[inline]
    fn sample(&self, at: LightSampleContext, _: [f32; 2]) -> Option<LightSample> {
        sample_point(self.position, at.p)
    }

    #[inline]
    fn pdf(&self, _: LightSampleContext, _: Vec3, _: Option<&SurfacePoint>) -> PdfW {
        PdfW::ZERO
    }

    fn power(&self, _: BoundingSphere) -> f32 {
        4.0
    }

    fn bounds(&self, power: f32, _: BoundingSphere) -> (LightBounds, [Vec3; 2]) {
        (LightBounds::round(self.position, 0.0, power), [self.position; 2])
    }

    #[inline]
    fn emit(&self, u: &LightNumbers, _: BoundingSphere) -> Option<(SurfacePoint, Vec3)> {
        let d = warp::sphere(u.direction);
        Some((SurfacePoint { p: self.position, error: Vec3::ZERO, ng: d }, d))
    }

    #[inline]
    fn emission_pdf(&self, _: Vec3, _: Vec3, _: BoundingSphere, choice: f32) -> EmissionPdf {
        EmissionPdf { origin: EmissionOrigin::Point, vertex: choice, next: UNIFORM_PDF, cos: 1.0 }
    }
}
