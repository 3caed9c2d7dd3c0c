//! Surfaces whose emission varies from place to place, or leaves along the normal only.
//!
//! Points are chosen by *cells* of the coordinates of the surface ([`EmittingSurface`]): a cell in proportion to about its luminance
//! times its area, never with probability 0 where it shines, and in it a point evenly. So a screen of two triangles with one
//! bright spot is sampled at the spot. What next-event estimation, light subpaths and the densities of hits ask for is one function
//! of the place, [`TexturedLight::density`].

mod pyramid;
mod surface;

use glam::Vec3;
use std::sync::Arc;

use crate::math::distribution_2d::Distribution2d;
use crate::math::frame::Frame;
use crate::math::pdf::{PdfA, PdfW};
use crate::math::warp;
use crate::scene::desc::emission_texture::EmissionTexture;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::sampler::LightNumbers;
use crate::tracer::shape::SurfacePoint;

use super::bounds::LightBounds;
use super::emission::{EmissionOrigin, EmissionPdf, surface_pdf};
use super::sample::{LightSample, LightSampleContext};
use super::source::LightSource;

pub(in crate::tracer) use pyramid::LuminancePyramid;
pub use surface::{EmittingSurface, FlatPatch};

/// Cells along either axis, at least, and at most for one surface.
const SIDE: [f32; 2] = [8.0, 1024.0];

/// Cells for each texel, along either axis.
const CELLS_PER_TEXEL: f32 = 2.0;

/// A surface that emits from its front, by a texture or along its normal.
#[derive(Clone, Debug)]
pub struct TexturedLight {
    surface: EmittingSurface,
    /// None where the emission is the same everywhere.
    texture: Option<Arc<EmissionTexture>>,
    /// Cells of the unit square, `[rows][columns]`; `None` where all is black.
    cells: Option<Distribution2d>,
    columns: usize,
    rows: usize,
    /// Luminance integrated over the area.
    flux: f32,
    along_normal: bool,
}

impl TexturedLight {
    /// The light on `surface` that shines by the texture of `luminances`, with at most `most` cells.
    pub(in crate::tracer) fn new(
        surface: EmittingSurface,
        luminances: Option<&LuminancePyramid>,
        along_normal: bool,
        most: usize,
    ) -> Self {
        let texture = luminances.map(|pyramid| pyramid.texture().clone());
        let side = |texels: f32| (texels * CELLS_PER_TEXEL).ceil().clamp(SIDE[0], SIDE[1]);
        let [width, height] = match &texture {
            Some(texture) => texture.extent(surface.uv_extent()).map(side),
            None => [1.0; 2],
        };
        let shrink = (most as f32 / (width * height)).min(1.0).sqrt();
        let [columns, rows] = [width, height].map(|n| ((n * shrink) as usize).max(1));
        let at = |x: f32, y: f32| [x / columns as f32, y / rows as f32];
        // Relative to this stretch, so that the brightest texel of a large surface stays in range.
        let typical = surface.stretch([0.5; 2]);
        let mut weights = Vec::with_capacity(columns * rows);
        for y in (0..rows).map(|y| y as f32) {
            for x in (0..columns).map(|x| x as f32) {
                let uv = |dx: f32, dy: f32| surface.uv(at(x + dx, y + dy));
                let square = |a: f32, b: f32| [uv(a, a), uv(b, a), uv(a, b), uv(b, b)];
                let shines = luminances.map_or(1.0, |l| l.weight(square(0.0, 1.0), square(0.25, 0.75)));
                weights.push(shines * (surface.stretch(at(x + 0.5, y + 0.5)) / typical));
            }
        }
        let sum: f64 = weights.iter().map(|weight| f64::from(*weight)).sum();
        let flux = (sum / (columns * rows) as f64 * f64::from(typical)).min(f64::from(f32::MAX)) as f32;
        let cells = Distribution2d::new(columns, &weights);
        Self { surface, texture, cells, columns, rows, flux, along_normal }
    }

    /// The surface.
    pub(in crate::tracer) fn surface(&self) -> &EmittingSurface {
        &self.surface
    }

    /// The density by area with which a point at (s, t) is chosen.
    fn density(&self, st: [f32; 2]) -> PdfA {
        let Some(cells) = &self.cells else { return PdfA(0.0) };
        let index = |v: f32, n: usize| ((v * n as f32) as usize).min(n - 1);
        let probability = cells.probability([index(st[0], self.columns), index(st[1], self.rows)]);
        PdfA(probability * (self.columns * self.rows) as f32 / self.surface.stretch(st))
    }

    /// The density by area with which `p` is chosen.
    pub fn density_at(&self, p: Vec3) -> PdfA {
        self.density(self.surface.coordinates(p))
    }

    /// A point of the surface.
    pub fn choose(&self, u: [f32; 2]) -> Option<SurfacePoint> {
        let choice = self.cells.as_ref()?.sample(u);
        let [x, y] = [0, 1].map(|i| choice.cell[i] as f32 + choice.offset[i]);
        Some(self.surface.point([x / self.columns as f32, y / self.rows as f32]))
    }

    fn emission(&self, p: Vec3, lambda: &SampledWavelengths) -> SampledSpectrum {
        let Some(texture) = &self.texture else { return SampledSpectrum::ONE };
        texture.sample(self.surface.uv(self.surface.coordinates(p)), lambda)
    }
}

impl LightSource for TexturedLight {
    #[inline(never)]
    fn sample(&self, at: LightSampleContext, u: [f32; 2]) -> Option<LightSample> {
        if self.along_normal {
            return None;
        }
        let SurfacePoint { p: target, ng, .. } = self.choose(u)?;
        let to = target - at.p;
        let distance2 = to.length_squared();
        let wi = to * (1.0 / distance2.sqrt());
        let cos = -wi.dot(ng);
        // Asked of the point and not of the choice: rounding may have taken it over the edge of the cell.
        let pdf = self.density_at(target).to_solid_angle(distance2, cos);
        // Refuses NaN, too: the light may pass through the lit point.
        let seen = cos > 0.0 && pdf.0 > 0.0 && !self.surface.hides(at.p, target);
        seen.then_some(LightSample { wi, target: Some(target), scale: 1.0, pdf, delta: false })
    }

    #[inline(never)]
    fn pdf(&self, at: LightSampleContext, _: Vec3, hit: Option<&SurfacePoint>) -> PdfW {
        let Some(hit) = hit.filter(|_| !self.along_normal) else { return PdfW::ZERO };
        let to = hit.p - at.p;
        let distance2 = to.length_squared();
        let cos = -to.dot(hit.ng) * (1.0 / distance2.sqrt());
        if cos > 0.0 { self.density_at(hit.p).to_solid_angle(distance2, cos) } else { PdfW::ZERO }
    }

    fn power(&self, _: BoundingSphere) -> f32 {
        // Along the normal the spectrum is the exitance.
        if self.along_normal { self.flux * std::f32::consts::FRAC_1_PI } else { self.flux }
    }

    fn bounds(&self, power: f32, _: BoundingSphere) -> (LightBounds, [Vec3; 2]) {
        self.surface.bounds(power)
    }

    #[inline(never)]
    fn emit(&self, u: &LightNumbers, _: BoundingSphere) -> Option<(SurfacePoint, Vec3)> {
        let from = self.choose(u.place)?;
        let direction = match self.along_normal {
            true => from.ng,
            false => Frame::new(from.ng).to_world(warp::cosine_hemisphere(u.direction)),
        };
        Some((from, direction))
    }

    #[inline(never)]
    fn emission_pdf(&self, p: Vec3, direction: Vec3, _: BoundingSphere, choice: f32) -> EmissionPdf {
        let vertex = choice * self.density_at(p).0;
        match self.along_normal {
            true => EmissionPdf { origin: EmissionOrigin::Beam, vertex, next: 1.0, cos: 1.0 },
            false => surface_pdf(self.surface.normal(p), direction, vertex),
        }
    }

    fn varies(&self) -> bool {
        true
    }

    #[inline(never)]
    fn factor(&self, p: Vec3, _: Vec3, lambda: &SampledWavelengths) -> SampledSpectrum {
        // No path arrives along the normal by chance.
        if self.along_normal { SampledSpectrum::ZERO } else { self.emission(p, lambda) }
    }

    fn emitted(&self, p: Vec3, _: Vec3, lambda: &SampledWavelengths) -> SampledSpectrum {
        self.emission(p, lambda)
    }

    fn is_beam(&self) -> bool {
        self.along_normal
    }

    fn is_black(&self) -> bool {
        self.cells.is_none()
    }
}
