//! Points that emit into a cone.

use glam::Vec3;

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::math::warp;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::SurfacePoint;

use super::point::sample_point;
use super::selector::LightBounds;
use super::{BoundingSphere, EmissionOrigin, EmissionPdf, LightSample, LightSampleContext, LightSource};

/// A point whose intensity is the same within a beam, and falls from there in proportion to the angle, to 0 at the cutoff (as
/// Mitsuba's `spot`).
#[derive(Clone, Debug)]
pub struct SpotLight {
    position: Vec3,
    /// Unit axis of the cone.
    axis: Vec3,
    /// Half angle of the beam, in radians.
    beam: f32,
    /// Half angle of the cone, in radians; not less.
    cutoff: f32,
    /// 1 − cos of the latter.
    cone: f32,
}

impl SpotLight {
    /// A light at `position` along the unit vector `axis`; the half angles `beam` ≤ `cutoff` ≤ π in radians.
    pub fn new(position: Vec3, axis: Vec3, beam: f32, cutoff: f32) -> Self {
        Self { position, axis, beam, cutoff, cone: 2.0 * (0.5 * cutoff).sin().powi(2) }
    }

    /// The share of the intensity on the axis that goes in the unit direction `d`.
    #[inline]
    fn falloff(&self, d: Vec3) -> f32 {
        // Accurate also where the cosine is nearly 1.
        let angle = self.axis.cross(d).length().atan2(self.axis.dot(d));
        if angle <= self.beam { 1.0 } else { ((self.cutoff - angle) / (self.cutoff - self.beam)).max(0.0) }
    }
}

impl LightSource for SpotLight {
    #[inline]
    fn sample(&self, at: LightSampleContext, _: [f32; 2]) -> Option<LightSample> {
        sample_point(self.position, at.p).filter(|sample| self.falloff(-sample.wi) > 0.0)
    }

    #[inline]
    fn pdf(&self, _: LightSampleContext, _: Vec3, _: Option<&SurfacePoint>) -> PdfW {
        PdfW::ZERO
    }

    fn power(&self, _: BoundingSphere) -> f32 {
        // Twice the integral of the falloff over cos θ, by parts.
        let (b, c) = (f64::from(self.beam), f64::from(self.cutoff));
        let edge = if c - b > 1e-6 { (c.sin() - b.sin()) / (c - b) } else { c.cos() };
        2.0 * (1.0 - edge) as f32
    }

    fn bounds(&self, power: f32, scene: BoundingSphere) -> (LightBounds, [Vec3; 2]) {
        // Back to the intensity on the axis; that of a point of this power, where the cone is so narrow that it vanishes.
        let intensity = power / self.power(scene).max(f32::MIN_POSITIVE);
        let bounds = match self.cone < 1.0 {
            true => LightBounds::flat([self.position; 2], self.axis, intensity),
            false => LightBounds::round(self.position, 0.0, 4.0 * intensity),
        };
        (bounds, [self.position; 2])
    }

    #[inline]
    fn emit(&self, u: &LightNumbers, _: BoundingSphere) -> Option<(SurfacePoint, Vec3)> {
        let d = Frame::new(self.axis).to_world(warp::cone(u.direction, self.cone));
        Some((SurfacePoint { p: self.position, error: Vec3::ZERO, ng: d }, d))
    }

    #[inline]
    fn emission_pdf(&self, _: Vec3, d: Vec3, _: BoundingSphere, choice: f32) -> EmissionPdf {
        let next = if self.falloff(d) > 0.0 { warp::cone_pdf(self.cone) } else { 0.0 };
        EmissionPdf { origin: EmissionOrigin::Point, vertex: choice, next, cos: 1.0 }
    }

    fn is_directional(&self) -> bool {
        true
    }

    #[inline]
    fn directional(&self, wi: Vec3, _: &SampledWavelengths) -> SampledSpectrum {
        SampledSpectrum::splat(self.falloff(-wi))
    }

    fn is_black(&self) -> bool {
        self.cone == 0.0
    }
}
