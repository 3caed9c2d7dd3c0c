//! Emission that varies over a surface, or over the picture of a projector.
//!
//! Values are unbounded. Colours become spectra as those of `<rgb>` in a light and of an `envmap` do: a smooth spectrum times D65
//! ([`EmissionMap`]). (Mitsuba's spectral mode cuts such pictures to [0, 1] and leaves out D65; its RGB mode does neither.)

use std::ops::RangeInclusive;
use std::sync::Arc;

use glam::{Affine2, Vec2};

use super::wrap::{WrapMode, cell};
use crate::spectrum::{EmissionMap, SampledSpectrum, SampledWavelengths, Spectrum};

/// A picture or checkerboard of emission, and its mapping to a surface.
#[derive(Clone, Debug)]
pub struct EmissionTexture {
    /// Its texels.
    pub texels: EmissionTexels,
    /// Maps texture coordinates of the surface to those of the picture.
    pub to_uv: Affine2,
    /// How the picture continues outside the unit square.
    pub wrap: WrapMode,
    /// Nearest-neighbour lookup; otherwise bilinear interpolation.
    pub nearest: bool,
}

/// The texels of an [`EmissionTexture`].
#[derive(Clone, Debug)]
pub enum EmissionTexels {
    /// A picture, shared by all textures of it.
    Picture(Arc<EmissionMap>),
    /// Mitsuba's `checkerboard`: two by two texels of two spectra, with their luminances.
    Squares([Spectrum; 2], [f32; 2]),
}

impl EmissionTexture {
    /// A checkerboard of two spectra.
    pub fn checkerboard(colors: [Spectrum; 2], to_uv: Affine2) -> Self {
        let luminances = [colors[0].luminance(), colors[1].luminance()];
        let texels = EmissionTexels::Squares(colors, luminances);
        Self { texels, to_uv, wrap: WrapMode::Repeat, nearest: true }
    }

    /// Columns and rows of texels.
    pub fn size(&self) -> [usize; 2] {
        match &self.texels {
            EmissionTexels::Picture(map) => [map.width(), map.rows()],
            EmissionTexels::Squares(..) => [2; 2],
        }
    }

    /// Luminance Y of the texel in this column and row, which must exist.
    #[inline]
    pub fn luminance(&self, [x, y]: [usize; 2]) -> f32 {
        match &self.texels {
            EmissionTexels::Picture(map) => map.luminance(x, y),
            EmissionTexels::Squares(_, luminances) => luminances[(x + y) % 2],
        }
    }

    /// The emission at texture coordinates `uv` and the wavelengths of a path.
    pub fn sample(&self, uv: Vec2, lambda: &SampledWavelengths) -> SampledSpectrum {
        let texels = self.around(uv);
        match &self.texels {
            EmissionTexels::Squares(colors, _) => {
                colors[(texels[0].0[0] + texels[0].0[1]) % 2].sample(lambda)
            }
            EmissionTexels::Picture(map) if self.nearest => map.blend([texels[0]], lambda),
            EmissionTexels::Picture(map) => map.blend(texels, lambda),
        }
    }

    /// Its luminance Y.
    pub fn luminance_at(&self, uv: Vec2) -> f32 {
        self.around(uv).into_iter().map(|(texel, weight)| self.luminance(texel) * weight).sum()
    }

    /// The texels that are interpolated at `uv`, with their weights.
    #[inline]
    fn around(&self, uv: Vec2) -> [([usize; 2], f32); 4] {
        let [width, height] = self.size();
        let (cell, offset) = cell(&self.to_uv, [width, height], self.nearest, uv);
        let offset = if self.nearest { Vec2::ZERO } else { offset };
        let [left, right] = [0, 1].map(|i| self.wrap.index(cell[0].saturating_add(i), width));
        let [upper, lower] = [0, 1].map(|i| self.wrap.index(cell[1].saturating_add(i), height));
        let [(s, t), (s0, t0)] = [offset, 1.0 - offset].map(|v| (v.x, v.y));
        [([left, upper], s0 * t0), ([right, upper], s * t0), ([left, lower], s0 * t), ([right, lower], s * t)]
    }

    /// The columns and rows of all texels with a weight anywhere within `corners`, the texture coordinates of the corners of a convex patch
    /// of the surface: up to two ranges of each.
    pub fn covered(&self, corners: [Vec2; 4]) -> [[Option<RangeInclusive<usize>>; 2]; 2] {
        let size = self.size();
        let cells = corners.map(|uv| cell(&self.to_uv, size, self.nearest, uv).0);
        let beyond = if self.nearest { 0 } else { 1 };
        [0, 1].map(|axis| {
            let ends = cells.map(|cell| cell[axis]);
            let [first, last] =
                [ends.into_iter().min(), ends.into_iter().max()].map(Option::unwrap_or_default);
            // A corner may be rounded to the neighbour of its cell.
            self.wrap.ranges(first.saturating_sub(1), last.saturating_add(beyond + 1), size[axis])
        })
    }

    /// Upper bound of the extent in texels of each of these edges, which are in texture coordinates.
    pub fn extent(&self, edges: [Vec2; 2]) -> [f32; 2] {
        let size = self.size().map(|n| n as f32);
        edges.map(|edge| {
            let edge = self.to_uv.transform_vector2(edge).abs() * Vec2::from_array(size);
            edge.max_element()
        })
    }

    /// True when it is zero everywhere.
    pub fn is_black(&self) -> bool {
        match &self.texels {
            EmissionTexels::Picture(map) => map.is_black(),
            EmissionTexels::Squares(colors, _) => colors.iter().all(Spectrum::is_black),
        }
    }

    /// True when every texel is a multiple of D65.
    pub fn is_grey(&self) -> bool {
        match &self.texels {
            EmissionTexels::Picture(map) => map.is_grey(),
            EmissionTexels::Squares(colors, _) => {
                colors.iter().all(|color| matches!(color, Spectrum::D65(_)) || color.is_black())
            }
        }
    }

    /// The texture with each texel replaced by D65 of the same luminance.
    pub fn grey(&self) -> Self {
        let texels = match &self.texels {
            EmissionTexels::Picture(map) => EmissionTexels::Picture(Arc::new(map.grey())),
            EmissionTexels::Squares(_, luminances) => {
                EmissionTexels::Squares(luminances.map(Spectrum::d65), *luminances)
            }
        };
        Self { texels, ..*self }
    }
}

/// How the emission of a shape varies over its surface and with direction; uniform and diffuse by default.
#[derive(Clone, Debug, Default)]
pub struct EmissionProfile {
    /// Texture of the emission; the spectrum of the light is a factor on it.
    pub texture: Option<Arc<EmissionTexture>>,
    /// Light leaves along the normal only (Mitsuba's `directionalarea`); the spectrum is the radiant exitance.
    pub along_normal: bool,
}

impl EmissionProfile {
    /// True when it is zero everywhere, whatever the factor.
    pub fn is_black(&self) -> bool {
        self.texture.as_ref().is_some_and(|texture| texture.is_black())
    }
}

impl PartialEq for EmissionProfile {
    /// Textures are compared by identity.
    fn eq(&self, other: &Self) -> bool {
        let same = match (&self.texture, &other.texture) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            (a, b) => a.is_none() && b.is_none(),
        };
        same && self.along_normal == other.along_normal
    }
}
