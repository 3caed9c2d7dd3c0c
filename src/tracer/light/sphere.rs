//! Spheres that emit: from outside sampled by the cone they subtend, from inside (inward normals) by all directions.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::{Sphere, SurfacePoint};

use super::bounds::LightBounds;
use super::emission::{EmissionPdf, surface_pdf};
use super::sample::{LightSample, LightSampleContext};
use super::source::LightSource;

/// A sphere that emits from its front.
#[derive(Clone, Debug)]
pub struct SphereLight {
    sphere: Sphere,
}

/// The cone under which a point outside sees the sphere.
struct SubtendedCone {
    to_center: Vec3,
    distance2: f32,
    /// 1 − cos of the half angle of the cone.
    one_minus_cos: f32,
}

impl SphereLight {
    /// The light on `sphere`.
    pub fn new(sphere: Sphere) -> Self {
        Self { sphere }
    }

    /// `None` from the inside. 1 − cos is taken as sin² / (1 + cos), and cos from (d − r)(d + r): neither a far
    /// sphere nor a touching one cancels.
    #[inline]
    fn cone(&self, p: Vec3) -> Option<SubtendedCone> {
        let to_center = self.sphere.center - p;
        let (distance2, r) = (to_center.length_squared(), self.sphere.radius);
        let d = distance2.sqrt();
        if d <= r {
            return None;
        }
        let cos = ((d - r) * (d + r)).sqrt() / d;
        let sin = r / d;
        Some(SubtendedCone { to_center, distance2, one_minus_cos: sin * sin / (1.0 + cos) })
    }

    /// The normal of the side that emits.
    #[inline]
    fn normal(&self, p: Vec3) -> Vec3 {
        let n = (p - self.sphere.center).normalize_or_zero();
        if self.sphere.inward { -n } else { n }
    }
}

impl LightSource for SphereLight {
    #[inline]
    fn sample(&self, at: LightSampleContext, u: [f32; 2]) -> Option<LightSample> {
        let Sphere { center, radius, inward } = self.sphere;
        let cone = self.cone(at.p);
        if cone.is_some() == inward {
            // From the dark side: an inward sphere from outside, or an outward one from within.
            return None;
        }
        let Some(SubtendedCone { to_center, distance2, one_minus_cos }) = cone else {
            let wi = warp::sphere(u);
            let b = wi.dot(center - at.p);
            let inside = radius * radius - (center - at.p).length_squared();
            let distance = b + (b * b + inside).max(0.0).sqrt();
            let target = at.p + wi * distance;
            let pdf = PdfW(0.25 * FRAC_1_PI);
            return Some(LightSample { wi, target: Some(target), scale: 1.0, pdf, delta: false });
        };
        let local = warp::cone(u, one_minus_cos);
        let d = distance2.sqrt();
        let wi = Frame::new(to_center * (1.0 / d)).to_world(local);
        // The near intersection, from the angle to the axis.
        let sin2 = local.x * local.x + local.y * local.y;
        let distance = d * local.z - (radius * radius - distance2 * sin2).max(0.0).sqrt();
        let pdf = PdfW(warp::cone_pdf(one_minus_cos));
        Some(LightSample { wi, target: Some(at.p + wi * distance), scale: 1.0, pdf, delta: false })
    }

    /// The density is the same for all directions that hit the sphere.
    #[inline]
    fn pdf(&self, at: LightSampleContext, _: Vec3, hit: Option<&SurfacePoint>) -> PdfW {
        match (hit, self.cone(at.p), self.sphere.inward) {
            (Some(_), Some(cone), false) => PdfW(warp::cone_pdf(cone.one_minus_cos)),
            (Some(_), None, true) => PdfW(0.25 * FRAC_1_PI),
            _ => PdfW::ZERO,
        }
    }

    fn power(&self, _: BoundingSphere) -> f32 {
        self.sphere.area()
    }

    fn bounds(&self, power: f32, _: BoundingSphere) -> (LightBounds, [Vec3; 2]) {
        let Sphere { center, radius, .. } = self.sphere;
        (LightBounds::round(center, radius.powi(2), power), self.sphere.bounds().into())
    }

    #[inline]
    fn emit(&self, u: &LightNumbers, _: BoundingSphere) -> Option<(SurfacePoint, Vec3)> {
        let from = self.sphere.point_towards(warp::sphere(u.place));
        Some((from, Frame::new(from.ng).to_world(warp::cosine_hemisphere(u.direction))))
    }

    #[inline]
    fn emission_pdf(&self, p: Vec3, direction: Vec3, _: BoundingSphere, choice: f32) -> EmissionPdf {
        surface_pdf(self.normal(p), direction, choice / self.sphere.area())
    }
}
