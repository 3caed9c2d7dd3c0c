//! Spheres that emit: from outside sampled by the cone they subtend, from inside (inward normals) by all directions.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::{Sphere, SurfacePoint};

use super::lights::surface_pdf;
use super::selector::LightBounds;
use super::{BoundingSphere, EmissionPdf, LightSample, LightSampleContext, LightSource};

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

#[cfg(test)]
mod tests {
    use super::*;

    /// Irradiance of a point that faces the centre of a unit-radiance sphere is π (r/d)², and from
    /// within, straight "up" into the sphere, π; the cone computed by the textbook 1 − √(1 − sin²) fails.
    #[test]
    fn irradiance_of_small_far_near_and_surrounding_spheres() {
        let naive = |ratio: f32| 1.0 - (1.0 - ratio * ratio).sqrt();
        assert_eq!(naive(1e-5), 0.0, "the case is too easy");
        for ratio in [1e-8f32, 1e-6, 1e-4, 1e-2, 0.1, 0.5, 0.9, 0.99, 0.999] {
            let sphere = Sphere { center: Vec3::new(0.0, 0.0, 1.0), radius: ratio, inward: false };
            let e = irradiance(sphere);
            let exact = std::f64::consts::PI * f64::from(ratio).powi(2);
            assert!((e / exact - 1.0).abs() < 1e-4, "r/d = {ratio}: {e} instead of {exact}");
        }
        let e = irradiance(Sphere { center: Vec3::new(0.3, 0.2, -0.1), radius: 1.0, inward: true });
        assert!((e / std::f64::consts::PI - 1.0).abs() < 1e-4, "inside: {e}");
        let dark = Sphere { center: Vec3::ZERO, radius: 1.0, inward: false };
        assert_eq!(irradiance(dark), 0.0);
    }

    fn irradiance(sphere: Sphere) -> f64 {
        let (light, at) = (
            SphereLight::new(sphere),
            LightSampleContext { p: Vec3::ZERO, n: Vec3::Z, through: false, glossy: false },
        );
        let n = 512;
        let mut sum = 0.0;
        for i in 0..n * n {
            let u = [((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32];
            if let Some(s) = light.sample(at, u) {
                let hit = SurfacePoint { p: s.target.expect("a point"), error: Vec3::ZERO, ng: -s.wi };
                assert_eq!(s.pdf, light.pdf(at, s.wi, Some(&hit)));
                assert!((s.wi.length() - 1.0).abs() < 1e-5);
                sum += f64::from(s.wi.z.max(0.0)) / f64::from(s.pdf.0);
            }
        }
        sum / (n * n) as f64
    }
}
