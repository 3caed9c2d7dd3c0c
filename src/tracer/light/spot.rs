//! Points that emit into a cone.

use glam::{DMat3, Mat3, Vec2, Vec3};

use crate::math::frame::Frame;
use crate::math::pdf::PdfW;
use crate::math::trigonometry;
use crate::math::warp;
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::SurfacePoint;

use super::bounds::LightBounds;
use super::emission::{EmissionOrigin, EmissionPdf};
use super::point::sample_point;
use super::sample::{LightSample, LightSampleContext};
use super::source::LightSource;

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
    texture: Option<SpotTexture>,
    /// Power over π.
    power: f32,
}

/// The texture that a spot projects onto the plane perpendicular to its axis, as wide as the cutoff.
#[derive(Clone, Debug)]
pub struct SpotTexture {
    texture: SpectrumTexture,
    /// World space to the spot's, which shines along +z.
    to_local: Mat3,
    /// Tangent of the cutoff.
    tan: f32,
}

/// Points along either side of the grid by which the mean of a texture is found.
const GRID: u16 = 128;

impl SpotTexture {
    /// The texture coordinates of the unit direction `d`.
    #[inline]
    fn uv(&self, d: Vec3) -> Vec2 {
        let d = self.to_local * d;
        0.5 + 0.5 * d.truncate() / (d.z * self.tan)
    }

    fn luminance(&self, d: Vec3) -> f32 {
        let uniform = || self.texture.mean().luminance();
        self.texture.luminance_at(&self.uv(d).into()).unwrap_or_else(uniform)
    }
}

impl SpotLight {
    /// A light at `position` along the unit vector `axis`; the half angles `beam` ≤ `cutoff` ≤ π in radians.
    pub fn new(position: Vec3, axis: Vec3, beam: f32, cutoff: f32) -> Self {
        // Twice the integral of the falloff over cos θ, by parts.
        let (b, c) = (f64::from(beam), f64::from(cutoff));
        let edge = if c - b > 1e-6 { (c.sin() - b.sin()) / (c - b) } else { c.cos() };
        let (cone, power) = (2.0 * (0.5 * cutoff).sin().powi(2), 2.0 * (1.0 - edge) as f32);
        Self { position, axis, beam, cutoff, cone, texture: None, power }
    }

    /// The same with its intensity times a texture, in the space of `to_world`, whose z axis is that of the spot.
    pub fn with_texture(self, texture: SpectrumTexture, to_world: DMat3) -> Self {
        let (to_local, tan) = (to_world.inverse().as_mat3(), self.cutoff.tan());
        let texture = SpotTexture { texture, to_local, tan };
        let step = |i: u16| (f32::from(i) + 0.5) / f32::from(GRID);
        let frame = Frame::new(self.axis);
        let value = |i: u16| {
            let d = frame.to_world(warp::cone([step(i % GRID), step(i / GRID)], self.cone));
            f64::from(self.falloff(d) * texture.luminance(d))
        };
        let mean = (0..GRID * GRID).map(value).sum::<f64>() / f64::from(GRID * GRID);
        // Details that the grid misses must keep a positive density.
        let least = if texture.texture.is_black() { 0.0 } else { 1e-4 * self.power };
        let power = (2.0 * self.cone * mean as f32).max(least);
        Self { texture: Some(texture), power, ..self }
    }

    /// The share of the intensity on the axis that goes in the unit direction `d`.
    #[inline]
    fn falloff(&self, d: Vec3) -> f32 {
        // Accurate also where the cosine is nearly 1.
        let angle = trigonometry::atan2(self.axis.cross(d).length(), self.axis.dot(d));
        if angle <= self.beam { 1.0 } else { ((self.cutoff - angle) / (self.cutoff - self.beam)).max(0.0) }
    }
}

impl LightSource for SpotLight {
    fn position(&self) -> Option<Vec3> {
        Some(self.position)
    }

    #[inline]
    fn sample(&self, at: LightSampleContext, _: [f32; 2]) -> Option<LightSample> {
        sample_point(self.position, at.p).filter(|sample| self.falloff(-sample.wi) > 0.0)
    }

    #[inline]
    fn pdf(&self, _: LightSampleContext, _: Vec3, _: Option<&SurfacePoint>) -> PdfW {
        PdfW::ZERO
    }

    fn power(&self, _: BoundingSphere) -> f32 {
        self.power
    }

    fn bounds(&self, power: f32, scene: BoundingSphere) -> (LightBounds, [Vec3; 2]) {
        // BackSurface to the intensity on the axis; that of a point of this power, where the cone is so narrow that it vanishes.
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

    fn varies(&self) -> bool {
        true
    }

    #[inline]
    fn factor(&self, _: Vec3, wi: Vec3, lambda: &SampledWavelengths) -> SampledSpectrum {
        let falloff = SampledSpectrum::splat(self.falloff(-wi));
        match &self.texture {
            Some(texture) => falloff * texture.texture.sample(&texture.uv(-wi).into(), lambda),
            None => falloff,
        }
    }

    fn is_black(&self) -> bool {
        self.cone == 0.0 || self.texture.is_some() && self.power == 0.0
    }
}
