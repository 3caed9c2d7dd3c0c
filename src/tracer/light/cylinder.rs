//! Cylinders that emit: sampled uniformly by angle and height, which is by area where they are round.
//!
//! A light never shadows itself in the scene. One that emits inwards is open at its ends and does: that is tested here.

use std::f32::consts::TAU;

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::pdf::{PdfA, PdfW};
use crate::math::trigonometry;
use crate::math::warp;
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::{Cylinder, SurfacePoint};

use super::bounds::LightBounds;
use super::emission::{EmissionPdf, surface_pdf};
use super::sample::{LightSample, LightSampleContext};
use super::source::LightSource;

/// A cylinder that emits from its front.
#[derive(Clone, Debug)]
pub struct CylinderLight {
    cylinder: Cylinder,
}

impl CylinderLight {
    /// The light on `cylinder`.
    pub fn new(cylinder: Cylinder) -> Self {
        Self { cylinder }
    }

    #[inline]
    fn place(&self, u: [f32; 2]) -> (SurfacePoint, PdfA) {
        let (y, x) = trigonometry::sin_cos(TAU * u[0]);
        (self.cylinder.point_at([x, y], u[1]), self.density([x, y]))
    }

    /// The density of points by area.
    #[inline]
    fn density(&self, around: [f32; 2]) -> PdfA {
        PdfA(1.0 / (TAU * self.cylinder.stretch(around)))
    }
}

impl LightSource for CylinderLight {
    #[inline]
    fn sample(&self, at: LightSampleContext, u: [f32; 2]) -> Option<LightSample> {
        let (target, density) = self.place(u);
        let to = target.p - at.p;
        let distance2 = to.length_squared();
        let wi = to * (1.0 / distance2.sqrt());
        let cos = -wi.dot(target.ng);
        let pdf = density.to_solid_angle(distance2, cos);
        // Refuses NaN, too: the light may pass through the lit point.
        let seen = cos > 0.0 && !(self.cylinder.inward && self.cylinder.hides_inside(at.p, target.p));
        seen.then_some(LightSample { wi, target: Some(target.p), scale: 1.0, pdf, delta: false })
    }

    #[inline]
    fn pdf(&self, at: LightSampleContext, _: Vec3, hit: Option<&SurfacePoint>) -> PdfW {
        let Some(hit) = hit else { return PdfW::ZERO };
        let to = hit.p - at.p;
        let distance2 = to.length_squared();
        let cos = -to.dot(hit.ng) * (1.0 / distance2.sqrt());
        let density = self.density(self.cylinder.around(hit.p));
        if cos > 0.0 { density.to_solid_angle(distance2, cos) } else { PdfW::ZERO }
    }

    fn power(&self, _: BoundingSphere) -> f32 {
        self.cylinder.area()
    }

    fn bounds(&self, power: f32, _: BoundingSphere) -> (LightBounds, [Vec3; 2]) {
        let (lo, hi) = self.cylinder.bounds();
        let radius2 = 0.25 * (hi - lo).length_squared();
        (LightBounds::round(0.5 * (lo + hi), radius2, power), [lo, hi])
    }

    #[inline]
    fn emit(&self, u: &LightNumbers, _: BoundingSphere) -> Option<(SurfacePoint, Vec3)> {
        let (from, _) = self.place(u.place);
        Some((from, Frame::new(from.ng).to_world(warp::cosine_hemisphere(u.direction))))
    }

    #[inline]
    fn emission_pdf(&self, p: Vec3, direction: Vec3, _: BoundingSphere, choice: f32) -> EmissionPdf {
        let around = self.cylinder.around(p);
        let n = self.cylinder.point_at(around, 0.0).ng;
        surface_pdf(n, direction, choice * self.density(around).0)
    }
}
