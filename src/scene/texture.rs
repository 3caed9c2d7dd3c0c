//! Textures: reflectances and factors that vary over a surface.
//!
//! A texture is asked at the texture coordinates (u, v) of a point, as Mitsuba defines them for each shape. Its colours become
//! spectra by the same upsampling as `<rgb>`, through a table ([`Spectrum::textured_rgb`]).

use std::sync::Arc;

use glam::{Affine2, Vec2};

use crate::image::bitmap::Bitmap;
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};

/// A reflectance or a factor on light, the same all over a surface or not.
#[derive(Clone, Debug)]
pub enum SpectrumTexture {
    /// The same everywhere.
    Uniform(Spectrum),
    /// A picture.
    Bitmap(BitmapTexture),
    /// Squares of two colours.
    Checkerboard(Arc<Checkerboard>),
}

/// Mitsuba's `bitmap`. Cheap to clone.
#[derive(Clone, Debug)]
pub struct BitmapTexture {
    /// The texels; v = 0 is the upper edge.
    pub bitmap: Arc<Bitmap>,
    /// From the texture coordinates of the surface to those of the picture.
    pub to_uv: Affine2,
    /// What lies beyond the picture.
    pub wrap: WrapMode,
    /// The texel around a point counts alone; otherwise the four nearest are interpolated.
    pub nearest: bool,
    /// Mean of the texels, linear Rec.709.
    pub mean: [f32; 3],
    /// The texels have no colour.
    pub grey: bool,
}

/// What a texture has beyond [0, 1]².
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrapMode {
    /// The same again.
    Repeat,
    /// Mirror images.
    Mirror,
    /// The colour of the edge.
    Clamp,
}

/// Mitsuba's `checkerboard`: four squares to a unit of the texture coordinates.
#[derive(Clone, Debug)]
pub struct Checkerboard {
    /// The squares at the corners of the unit square.
    pub color0: SpectrumTexture,
    /// The others.
    pub color1: SpectrumTexture,
    /// From the texture coordinates of the surface to those of the board.
    pub to_uv: Affine2,
}

impl From<Spectrum> for SpectrumTexture {
    fn from(spectrum: Spectrum) -> Self {
        Self::Uniform(spectrum)
    }
}

impl PartialEq<Spectrum> for SpectrumTexture {
    fn eq(&self, spectrum: &Spectrum) -> bool {
        self.uniform() == Some(spectrum)
    }
}

impl SpectrumTexture {
    /// The values at texture coordinates `uv` and the wavelengths of a path.
    #[inline]
    pub fn sample(&self, uv: Vec2, lambda: &SampledWavelengths) -> SampledSpectrum {
        match self {
            Self::Uniform(spectrum) => spectrum.sample(lambda),
            _ => self.varying(uv, lambda),
        }
    }

    #[inline(never)]
    fn varying(&self, uv: Vec2, lambda: &SampledWavelengths) -> SampledSpectrum {
        match self {
            Self::Uniform(spectrum) => spectrum.sample(lambda),
            Self::Bitmap(texture) => Spectrum::textured_rgb(texture.rgb(uv), lambda),
            Self::Checkerboard(board) => board.color(uv).sample(uv, lambda),
        }
    }

    /// The luminance under D65 at texture coordinates `uv`, if it depends on the place.
    pub fn luminance_at(&self, uv: Vec2) -> Option<f32> {
        match self {
            Self::Uniform(_) => None,
            Self::Bitmap(texture) => Some(luminance(texture.rgb(uv))),
            Self::Checkerboard(board) => {
                let color = board.color(uv);
                color.luminance_at(uv).or_else(|| Some(luminance(color.uniform()?.reflected_rgb())))
            }
        }
    }

    /// The spectrum, if it is the same everywhere.
    pub fn uniform(&self) -> Option<&Spectrum> {
        match self {
            Self::Uniform(spectrum) => Some(spectrum),
            _ => None,
        }
    }

    /// True when the value depends on the place.
    pub fn varies(&self) -> bool {
        self.uniform().is_none()
    }

    /// True when the value does not depend on the wavelength, anywhere.
    pub fn is_grey(&self) -> bool {
        match self {
            Self::Uniform(spectrum) => spectrum.is_constant(),
            Self::Bitmap(texture) => texture.grey,
            Self::Checkerboard(board) => board.color0.is_grey() && board.color1.is_grey(),
        }
    }

    /// True when it is known to be zero everywhere.
    pub fn is_black(&self) -> bool {
        match self {
            Self::Uniform(spectrum) => spectrum.is_black(),
            Self::Bitmap(texture) => texture.mean == [0.0; 3],
            Self::Checkerboard(board) => board.color0.is_black() && board.color1.is_black(),
        }
    }

    /// The mean over the unit square.
    pub fn mean(&self) -> Spectrum {
        let rgb = |texture: &Self| match texture {
            Self::Bitmap(bitmap) => bitmap.mean,
            other => other.mean().reflected_rgb().map(|v| v.clamp(0.0, 1.0)),
        };
        match self {
            Self::Uniform(spectrum) => spectrum.clone(),
            Self::Bitmap(texture) => Spectrum::reflectance_rgb(texture.mean),
            Self::Checkerboard(board) => {
                let (a, b) = (rgb(&board.color0), rgb(&board.color1));
                Spectrum::reflectance_rgb(std::array::from_fn(|i| 0.5 * (a[i] + b[i])))
            }
        }
    }

    /// The texture whose colours are the greys that are as light under D65.
    pub fn grey(&self) -> Self {
        match self {
            _ if self.is_grey() => self.clone(),
            Self::Uniform(spectrum) => Spectrum::Constant(luminance(spectrum.reflected_rgb())).into(),
            Self::Bitmap(texture) => {
                let bitmap = &texture.bitmap;
                let texels = (0..bitmap.width() * bitmap.height())
                    .map(|i| [luminance(bitmap.texel(i % bitmap.width(), i / bitmap.width())); 3]);
                let bitmap = Bitmap::from_linear(bitmap.width(), texels.collect());
                Self::Bitmap(BitmapTexture {
                    mean: [luminance(texture.mean); 3],
                    bitmap: Arc::new(bitmap),
                    grey: true,
                    ..*texture
                })
            }
            Self::Checkerboard(board) => Self::Checkerboard(Arc::new(Checkerboard {
                color0: board.color0.grey(),
                color1: board.color1.grey(),
                to_uv: board.to_uv,
            })),
        }
    }
}

impl Checkerboard {
    /// The colour of the square at texture coordinates `uv`.
    fn color(&self, uv: Vec2) -> &SpectrumTexture {
        let at = self.to_uv.transform_point2(uv);
        let upper = |v: f32| v - v.floor() > 0.5;
        if upper(at.x) == upper(at.y) { &self.color0 } else { &self.color1 }
    }
}

impl BitmapTexture {
    /// A texture of this picture. Colours are cut to [0, 1], as reflectances are.
    pub fn new(bitmap: Arc<Bitmap>, to_uv: Affine2, wrap: WrapMode, nearest: bool) -> Self {
        let (mut sum, mut grey) = ([0.0f64; 3], true);
        for y in 0..bitmap.height() {
            for x in 0..bitmap.width() {
                let texel = bitmap.texel(x, y).map(clean);
                grey &= texel[0] == texel[1] && texel[1] == texel[2];
                (0..3).for_each(|i| sum[i] += f64::from(texel[i]));
            }
        }
        let count = (bitmap.width() * bitmap.height()) as f64;
        Self { mean: sum.map(|v| (v / count) as f32), bitmap, to_uv, wrap, nearest, grey }
    }

    /// The colour at texture coordinates `uv`, linear Rec.709 in [0, 1].
    #[inline]
    fn rgb(&self, uv: Vec2) -> [f32; 3] {
        let size = [self.bitmap.width(), self.bitmap.height()];
        let at = self.to_uv.transform_point2(uv) * Vec2::new(size[0] as f32, size[1] as f32);
        let texel = |x: i64, y: i64| {
            self.bitmap.texel(self.wrap.index(x, size[0]), self.wrap.index(y, size[1])).map(clean)
        };
        // Coordinates that are no numbers mean nothing.
        let at = if at.is_finite() { at } else { Vec2::ZERO };
        if self.nearest {
            return texel(at.x.floor() as i64, at.y.floor() as i64);
        }
        let at = at - 0.5;
        let cell = at.floor();
        let (s, t) = (at.x - cell.x, at.y - cell.y);
        let (x, y) = (cell.x as i64, cell.y as i64);
        let (right, below) = (x.saturating_add(1), y.saturating_add(1));
        let [a, b, c, d] = [texel(x, y), texel(right, y), texel(x, below), texel(right, below)];
        std::array::from_fn(|i| (a[i] * (1.0 - s) + b[i] * s) * (1.0 - t) + (c[i] * (1.0 - s) + d[i] * s) * t)
    }
}

impl WrapMode {
    /// The column or row of `size` that stands at place `i`, which saturates where coordinates are beyond all sense.
    #[inline]
    fn index(self, i: i64, size: usize) -> usize {
        let size = size as i64;
        let inside = match self {
            Self::Repeat => i.rem_euclid(size),
            Self::Mirror => {
                let i = i.rem_euclid(2 * size);
                i.min(2 * size - 1 - i)
            }
            Self::Clamp => i.clamp(0, size - 1),
        };
        inside as usize
    }
}

/// Luminance of a linear Rec.709 colour.
fn luminance([r, g, b]: [f32; 3]) -> f32 {
    (0.2126 * r + 0.7152 * g + 0.0722 * b).max(0.0)
}

/// `v` cut to [0, 1]; NaN is 0.
fn clean(v: f32) -> f32 {
    if v > 0.0 { v.min(1.0) } else { 0.0 }
}
