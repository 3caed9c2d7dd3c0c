//! Points that project a picture.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::{DMat3, Mat3, Vec2, Vec3};

use crate::math::distribution_2d::Distribution2d;
use crate::math::pdf::PdfW;
use crate::scene::desc::emission_texture::EmissionTexture;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::SurfacePoint;

use super::bounds::LightBounds;
use super::emission::{EmissionOrigin, EmissionPdf};
use super::point::sample_point;
use super::sample::{LightSample, LightSampleContext};
use super::source::LightSource;
use super::textured::LuminancePyramid;

/// Cells along either side of the picture, at most.
const SIDE: usize = 1024;

/// A point that throws a picture onto the plane at distance 1, so that light of the picture's value times π arrives there (as
/// Mitsuba's `projector`): the intensity is π / cos³ times that.
#[derive(Clone, Debug)]
pub struct ProjectorLight {
    position: Vec3,
    /// World space to the projector's: it shines along +z, and the left edge of the picture lies at +x, the upper at +y.
    to_local: Mat3,
    /// Half of the picture's width and height at distance 1.
    half: Vec2,
    /// None where all is the same.
    texture: Option<Arc<EmissionTexture>>,
    /// Cells of the picture, `[rows][columns]`; `None` where all is black.
    cells: Option<Distribution2d>,
    size: [usize; 2],
    /// Mean luminance.
    mean: f32,
}

impl ProjectorLight {
    /// A projector at `position`, turned by `to_world`.
    pub(in crate::tracer) fn new(
        position: Vec3,
        to_world: DMat3,
        half: Vec2,
        luminances: Option<&LuminancePyramid>,
    ) -> Self {
        let texture = luminances.map(|pyramid| pyramid.texture().clone());
        let size = texture.as_ref().map_or([1; 2], |t| t.size().map(|n| (2 * n).min(SIDE)));
        let mut weights = Vec::with_capacity(size[0] * size[1]);
        for y in (0..size[1]).map(|y| y as f32) {
            for x in (0..size[0]).map(|x| x as f32) {
                let uv = |dx: f32, dy: f32| Vec2::new((x + dx) / size[0] as f32, (y + dy) / size[1] as f32);
                let square = |a: f32, b: f32| [uv(a, a), uv(b, a), uv(a, b), uv(b, b)];
                weights.push(luminances.map_or(1.0, |l| l.weight(square(0.0, 1.0), square(0.25, 0.75))));
            }
        }
        let mean = (weights.iter().map(|w| f64::from(*w)).sum::<f64>() / weights.len() as f64) as f32;
        let cells = Distribution2d::new(size[0], &weights);
        Self { position, to_local: to_world.transpose().as_mat3(), half, texture, cells, size, mean }
    }

    /// Where the unit direction `d` meets the picture, and its cosine.
    #[inline]
    fn place(&self, d: Vec3) -> Option<(Vec2, f32)> {
        let d = self.to_local * d;
        let uv = 0.5 - 0.5 * d.truncate() / (d.z * self.half);
        let inside = d.z > 0.0 && uv.min_element() >= 0.0 && uv.max_element() <= 1.0;
        inside.then_some((uv, d.z))
    }

    /// The density per steradian with which the unit direction `d` is chosen.
    #[inline]
    pub fn pdf_direction(&self, d: Vec3) -> PdfW {
        let (Some(cells), Some((uv, cos))) = (&self.cells, self.place(d)) else { return PdfW::ZERO };
        let [columns, rows] = self.size;
        let index = |v: f32, n: usize| ((v * n as f32) as usize).min(n - 1);
        let probability = cells.probability([index(uv.x, columns), index(uv.y, rows)]);
        let by_area = probability * (columns * rows) as f32 / (4.0 * self.half.x * self.half.y);
        PdfW(by_area / cos.powi(3))
    }

    /// Solid angle of the picture.
    fn solid_angle(&self) -> f32 {
        let [a, b] = self.half.as_dvec2().to_array();
        (4.0 * (a * b / ((1.0 + a * a) * (1.0 + b * b)).sqrt()).asin()) as f32
    }
}

impl LightSource for ProjectorLight {
    fn position(&self) -> Option<Vec3> {
        Some(self.position)
    }

    #[inline(never)]
    fn sample(&self, at: LightSampleContext, _: [f32; 2]) -> Option<LightSample> {
        sample_point(self.position, at.p).filter(|sample| self.place(-sample.wi).is_some())
    }

    #[inline(never)]
    fn pdf(&self, _: LightSampleContext, _: Vec3, _: Option<&SurfacePoint>) -> PdfW {
        PdfW::ZERO
    }

    fn power(&self, _: BoundingSphere) -> f32 {
        self.mean * 4.0 * self.half.x * self.half.y
    }

    fn bounds(&self, power: f32, _: BoundingSphere) -> (LightBounds, [Vec3; 2]) {
        let intensity = power * PI / self.solid_angle().max(f32::MIN_POSITIVE);
        let axis = self.to_local.transpose() * Vec3::Z;
        let bounds = match self.half.max_element() < 1.0 {
            true => LightBounds::flat([self.position; 2], axis, intensity),
            false => LightBounds::round(self.position, 0.0, 4.0 * intensity),
        };
        (bounds, [self.position; 2])
    }

    #[inline(never)]
    fn emit(&self, u: &LightNumbers, _: BoundingSphere) -> Option<(SurfacePoint, Vec3)> {
        let choice = self.cells.as_ref()?.sample(u.direction);
        let share = |i: usize| (choice.cell[i] as f32 + choice.offset[i]) / self.size[i] as f32;
        let at = (1.0 - 2.0 * Vec2::new(share(0), share(1))) * self.half;
        let d = (self.to_local.transpose() * at.extend(1.0)).normalize();
        Some((SurfacePoint { p: self.position, error: Vec3::ZERO, ng: d }, d))
    }

    #[inline(never)]
    fn emission_pdf(&self, _: Vec3, d: Vec3, _: BoundingSphere, choice: f32) -> EmissionPdf {
        let next = self.pdf_direction(d).0;
        EmissionPdf { origin: EmissionOrigin::Point, vertex: choice, next, cos: 1.0 }
    }

    fn varies(&self) -> bool {
        true
    }

    #[inline(never)]
    fn factor(&self, _: Vec3, wi: Vec3, lambda: &SampledWavelengths) -> SampledSpectrum {
        let Some((uv, cos)) = self.place(-wi) else { return SampledSpectrum::ZERO };
        let value = self.texture.as_ref().map_or(SampledSpectrum::ONE, |t| t.sample(uv, lambda));
        value * (PI / cos.powi(3))
    }

    fn is_black(&self) -> bool {
        self.cells.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without a picture light is even over the plane at distance 1: the density of a direction is 1 / cos³ over the area there, and
    /// the light on the plane π.
    #[test]
    fn a_plain_projector_lights_its_plane_evenly() {
        let half = Vec2::new(0.3, 0.8);
        let light = ProjectorLight::new(Vec3::new(5.0, -2.0, 1.0), DMat3::IDENTITY, half, None);
        let lambda = SampledWavelengths::sample(0.4);
        for at in [Vec2::ZERO, Vec2::new(0.29, -0.7), Vec2::new(-0.1, 0.5)] {
            let d = at.extend(1.0).normalize();
            let expected = 1.0 / (4.0 * 0.3 * 0.8 * d.z.powi(3));
            assert!((light.pdf_direction(d).0 / expected - 1.0).abs() < 1e-5, "{at}");
            let factor = light.factor(Vec3::ZERO, -d, &lambda).0.x;
            assert!((factor * d.z.powi(3) / PI - 1.0).abs() < 1e-5, "{at}: {factor}");
        }
        assert_eq!(light.pdf_direction(Vec3::new(0.5, 0.0, 1.0).normalize()).0, 0.0);
    }
}
