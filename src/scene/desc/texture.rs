//! Textures: reflectances and factors that vary over a surface.
//!
//! A texture is evaluated at a [`TexturePoint`]: the texture coordinates (u, v) of a point, as Mitsuba defines them for each shape, the
//! attributes of its mesh, and where it lies. Its colours become spectra by the same upsampling as `<rgb>`, through a table
//! ([`Spectrum::textured_rgb`]); where a number is wanted, it is the luminance ([`SpectrumTexture::scalar`]).

use std::sync::Arc;

use glam::{Affine2, Vec2, Vec3, Vec3A};

use super::volume::VolumeTexture;
use super::wrap::cell;
use crate::image::bitmap::Bitmap;
use crate::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum};

pub use super::wrap::WrapMode;

/// Most mesh attribute values that the material of one shape can use; a colour has three.
pub const ATTRIBUTE_NUMBERS: usize = 4;

/// A point of a surface as textures see it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TexturePoint {
    /// Texture coordinates (u, v).
    pub uv: Vec2,
    /// Values of the mesh attributes that the material uses, each from [`AttributeLayout::first`] on.
    pub attributes: [f32; ATTRIBUTE_NUMBERS],
    /// Position in rendering space; 0 if no texture of the surface depends on it.
    pub p: Vec3,
}

impl From<Vec2> for TexturePoint {
    fn from(uv: Vec2) -> Self {
        Self { uv, attributes: [0.0; ATTRIBUTE_NUMBERS], p: Vec3::ZERO }
    }
}

/// A reflectance, a factor on light or a number, constant or varying over a surface.
#[derive(Clone, Debug)]
pub enum SpectrumTexture {
    /// Constant.
    Uniform(Spectrum),
    /// A picture.
    Bitmap(BitmapTexture),
    /// A checkerboard of two textures.
    Checkerboard(Arc<Checkerboard>),
    /// Values stored at the vertices or on the faces of the mesh.
    Attribute(AttributeTexture),
    /// The product of two textures.
    Product(Arc<[SpectrumTexture; 2]>),
    /// Values on a grid in space.
    Volume(Arc<VolumeTexture>),
}

/// Mitsuba's `bitmap`. Cheap to clone.
#[derive(Clone, Debug)]
pub struct BitmapTexture {
    /// The texels; v = 0 is the upper edge.
    pub bitmap: Arc<Bitmap>,
    /// Maps texture coordinates of the surface to those of the picture.
    pub to_uv: Affine2,
    /// How the picture continues outside the unit square.
    pub wrap: WrapMode,
    /// Nearest-neighbour lookup; otherwise bilinear interpolation.
    pub nearest: bool,
    /// Mean of the texels, linear Rec.709.
    pub mean: [f32; 3],
    /// All texels are grey.
    pub grey: bool,
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

/// Mitsuba's `mesh_attribute`: values at the vertices or on the faces of a mesh.
#[derive(Clone, Debug)]
pub struct AttributeTexture {
    /// Name of the attribute, which begins with `vertex_` or `face_`.
    pub name: Arc<str>,
    /// Factor on the values.
    pub scale: f32,
    /// Where the values of a point are stored.
    pub layout: AttributeLayout,
    /// Colours are replaced by their luminance.
    pub grey: bool,
}

/// Where the values of an attribute are in [`TexturePoint::attributes`]; the same in all materials of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttributeLayout {
    /// Index of the first.
    pub first: usize,
    /// It has three values, a colour in linear Rec.709; otherwise one.
    pub colored: bool,
    /// Mean of the values.
    pub mean: [f32; 3],
}

impl AttributeLayout {
    /// Placeholder until the meshes with the attribute are read.
    pub const UNKNOWN: Self = Self { first: 0, colored: false, mean: [1.0; 3] };
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
    /// The values at a point and the wavelengths of a path.
    #[inline]
    pub fn sample(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> SampledSpectrum {
        match self {
            Self::Uniform(spectrum) => spectrum.sample(lambda),
            _ => self.varying(at, lambda),
        }
    }

    #[inline(never)]
    fn varying(&self, at: &TexturePoint, lambda: &SampledWavelengths) -> SampledSpectrum {
        match self {
            Self::Uniform(spectrum) => spectrum.sample(lambda),
            Self::Bitmap(texture) => Spectrum::textured_rgb(texture.value(at.uv, clean_texel), lambda),
            Self::Checkerboard(board) => board.color(at.uv).sample(at, lambda),
            Self::Attribute(texture) => Spectrum::textured_rgb(texture.values(at).map(clean).into(), lambda),
            Self::Product(_) | Self::Volume(_) => Spectrum::textured_rgb(self.rgb(at), lambda),
        }
    }

    /// The colour at a point, linear Rec.709 from 0 to 1. Not inlined, because few scenes have products or volumes.
    #[inline(never)]
    fn rgb(&self, at: &TexturePoint) -> Vec3A {
        match self {
            Self::Uniform(spectrum) => spectrum.reflected_rgb().map(clean).into(),
            Self::Bitmap(texture) => texture.value(at.uv, clean_texel),
            Self::Checkerboard(board) => board.color(at.uv).rgb(at),
            Self::Attribute(texture) => texture.values(at).map(clean).into(),
            Self::Product(factors) => factors[0].rgb(at) * factors[1].rgb(at),
            Self::Volume(texture) => texture.value(at.p, clean_texel),
        }
    }

    /// The scalar value of a product; not inlined, as [`rgb`](Self::rgb).
    #[inline(never)]
    fn product_of_scalars(factors: &[Self; 2], at: &TexturePoint) -> f32 {
        factors[0].scalar(at) * factors[1].scalar(at)
    }

    /// The scalar value at a point, at least 0; of a colour its luminance under D65. Mitsuba's `eval_1`.
    #[inline]
    pub fn scalar(&self, at: &TexturePoint) -> f32 {
        match self {
            Self::Uniform(Spectrum::Constant(v)) => *v,
            _ => self.varying_scalar(at),
        }
    }

    #[inline(never)]
    fn varying_scalar(&self, at: &TexturePoint) -> f32 {
        match self {
            Self::Uniform(spectrum) => luminance(spectrum.reflected_rgb()),
            Self::Bitmap(texture) => luminance(texture.value(at.uv, texel_not_negative).to_array()),
            Self::Checkerboard(board) => board.number(at.uv).scalar(at),
            Self::Attribute(texture) => luminance(texture.values(at).map(not_negative)),
            Self::Product(factors) => Self::product_of_scalars(factors, at),
            Self::Volume(texture) => Self::number_of_volume(texture, at),
        }
    }

    /// The scalar value of a volume; not inlined, as [`rgb`](Self::rgb).
    #[inline(never)]
    fn number_of_volume(texture: &VolumeTexture, at: &TexturePoint) -> f32 {
        luminance(texture.number(at.p))
    }

    /// The luminance under D65 at a point, if it varies.
    pub fn luminance_at(&self, at: &TexturePoint) -> Option<f32> {
        self.varies().then(|| self.scalar(at).min(1.0))
    }

    /// The mean of [`SpectrumTexture::scalar`] over the unit square, or over a mesh.
    pub fn mean_scalar(&self) -> f32 {
        match self {
            Self::Uniform(spectrum) => luminance(spectrum.reflected_rgb()),
            Self::Bitmap(texture) => luminance(texture.mean),
            Self::Checkerboard(board) => 0.5 * (board.color0.mean_scalar() + board.color1.mean_scalar()),
            Self::Attribute(texture) => luminance(texture.mean()),
            Self::Product(factors) => factors[0].mean_scalar() * factors[1].mean_scalar(),
            Self::Volume(texture) => luminance(texture.mean()),
        }
    }

    /// The texture as one of scalars: its uniform parts become constants.
    #[must_use]
    pub fn into_scalar(self) -> Self {
        match self {
            Self::Uniform(_) | Self::Checkerboard(_) => self.grey(),
            Self::Product(factors) => {
                Self::Product(Arc::new(factors.as_ref().clone().map(Self::into_scalar)))
            }
            _ => self,
        }
    }

    /// The mesh attributes that it uses.
    pub fn attributes(&self) -> Vec<&AttributeTexture> {
        match self {
            Self::Uniform(_) | Self::Bitmap(_) | Self::Volume(_) => Vec::new(),
            Self::Checkerboard(board) => {
                [&board.color0, &board.color1].into_iter().flat_map(Self::attributes).collect()
            }
            Self::Attribute(texture) => vec![texture],
            Self::Product(factors) => factors.iter().flat_map(Self::attributes).collect(),
        }
    }

    /// The mesh attributes that it uses, mutably.
    pub fn attributes_mut(&mut self) -> Vec<&mut AttributeTexture> {
        match self {
            Self::Uniform(_) | Self::Bitmap(_) | Self::Volume(_) => Vec::new(),
            Self::Checkerboard(board)
                if board.color0.attributes().len() + board.color1.attributes().len() == 0 =>
            {
                Vec::new()
            }
            Self::Checkerboard(board) => {
                let Checkerboard { color0, color1, .. } = Arc::make_mut(board);
                [color0, color1].into_iter().flat_map(Self::attributes_mut).collect()
            }
            Self::Attribute(texture) => vec![texture],
            Self::Product(factors) if factors.iter().all(|factor| factor.attributes().is_empty()) => {
                Vec::new()
            }
            Self::Product(factors) => {
                Arc::make_mut(factors).iter_mut().flat_map(Self::attributes_mut).collect()
            }
        }
    }

    /// True when the value depends on the position in space.
    pub fn asks_place(&self) -> bool {
        match self {
            Self::Uniform(_) | Self::Bitmap(_) | Self::Attribute(_) => false,
            Self::Checkerboard(board) => board.color0.asks_place() || board.color1.asks_place(),
            Self::Product(factors) => factors.iter().any(Self::asks_place),
            Self::Volume(_) => true,
        }
    }

    /// The volumes in it, mutably.
    pub(super) fn volumes_mut(&mut self) -> Vec<&mut Arc<VolumeTexture>> {
        if !self.asks_place() {
            return Vec::new();
        }
        match self {
            Self::Uniform(_) | Self::Bitmap(_) | Self::Attribute(_) => Vec::new(),
            Self::Checkerboard(board) => {
                let Checkerboard { color0, color1, .. } = Arc::make_mut(board);
                [color0, color1].into_iter().flat_map(Self::volumes_mut).collect()
            }
            Self::Product(factors) => Arc::make_mut(factors).iter_mut().flat_map(Self::volumes_mut).collect(),
            Self::Volume(texture) => vec![texture],
        }
    }

    /// The spectrum, if it is constant.
    pub fn uniform(&self) -> Option<&Spectrum> {
        match self {
            Self::Uniform(spectrum) => Some(spectrum),
            _ => None,
        }
    }

    /// The scalar value, if it is constant.
    pub(crate) fn constant_scalar(&self) -> Option<f32> {
        (!self.varies()).then(|| self.scalar(&TexturePoint::default()))
    }

    /// True unless it is constant.
    pub fn varies(&self) -> bool {
        self.uniform().is_none()
    }

    /// True when the value does not depend on the wavelength, anywhere.
    pub fn is_grey(&self) -> bool {
        match self {
            Self::Uniform(spectrum) => spectrum.is_constant(),
            Self::Bitmap(texture) => texture.grey,
            Self::Checkerboard(board) => board.color0.is_grey() && board.color1.is_grey(),
            Self::Attribute(texture) => texture.grey || !texture.layout.colored,
            Self::Product(factors) => factors.iter().all(Self::is_grey),
            Self::Volume(texture) => texture.is_grey(),
        }
    }

    /// True when it is known to be zero everywhere.
    pub fn is_black(&self) -> bool {
        match self {
            Self::Uniform(spectrum) => spectrum.is_black(),
            Self::Bitmap(texture) => texture.mean == [0.0; 3],
            Self::Checkerboard(board) => board.color0.is_black() && board.color1.is_black(),
            Self::Attribute(texture) => texture.mean() == [0.0; 3],
            Self::Product(factors) => factors.iter().any(Self::is_black),
            Self::Volume(texture) => texture.mean() == [0.0; 3],
        }
    }

    /// The mean over the unit square; of a product, the product of the means.
    pub fn mean(&self) -> Spectrum {
        let rgb = |texture: &Self| match texture {
            Self::Bitmap(bitmap) => bitmap.mean,
            Self::Attribute(attribute) => attribute.mean().map(clean),
            Self::Volume(volume) => volume.mean().map(clean),
            other => other.mean().reflected_rgb().map(|v| v.clamp(0.0, 1.0)),
        };
        match self {
            Self::Uniform(spectrum) => spectrum.clone(),
            Self::Bitmap(_) | Self::Attribute(_) | Self::Volume(_) => Spectrum::reflectance_rgb(rgb(self)),
            Self::Checkerboard(board) => {
                let (a, b) = (rgb(&board.color0), rgb(&board.color1));
                Spectrum::reflectance_rgb(std::array::from_fn(|i| 0.5 * (a[i] + b[i])))
            }
            Self::Product(factors) => {
                let (a, b) = (rgb(&factors[0]), rgb(&factors[1]));
                Spectrum::reflectance_rgb(std::array::from_fn(|i| a[i] * b[i]))
            }
        }
    }

    /// The texture with each colour replaced by the grey of the same luminance under D65.
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
            Self::Attribute(texture) => Self::Attribute(AttributeTexture { grey: true, ..texture.clone() }),
            Self::Product(factors) => Self::Product(Arc::new(factors.as_ref().clone().map(|t| t.grey()))),
            Self::Volume(texture) => Self::Volume(Arc::new(texture.grey())),
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

    /// The colour that [`SpectrumTexture::scalar`] reads: that of the other squares, because Mitsuba 3.9.1 swaps them there.
    fn number(&self, uv: Vec2) -> &SpectrumTexture {
        if std::ptr::eq(self.color(uv), &self.color0) { &self.color1 } else { &self.color0 }
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

    /// A picture, repeated and interpolated.
    pub fn repeated(bitmap: Bitmap) -> Self {
        Self::new(Arc::new(bitmap), Affine2::IDENTITY, WrapMode::Repeat, false)
    }

    /// A repeated picture of 8-bit texels in rows of `width`, encoded as sRGB unless they are `raw`.
    ///
    /// # Panics
    ///
    /// If there is no texel, or not full rows of them.
    pub fn of_eight_bits(width: usize, texels: Vec<[u8; 3]>, raw: bool) -> Self {
        Self::repeated(Bitmap::of_eight_bits(width, texels, raw))
    }

    /// The texels as vectors at texture coordinates `uv`, not clamped to the range of colours.
    pub fn vector(&self, uv: Vec2) -> Vec3 {
        self.value(uv, |v| v).into()
    }

    /// The derivatives of the luminance by u and v at texture coordinates `uv`: those of the bilinear interpolation, none between
    /// texels that are not interpolated.
    pub fn gradient(&self, uv: Vec2) -> Vec2 {
        if self.nearest {
            return Vec2::ZERO;
        }
        let ([a, b, c, d], at) = self.texels(uv, |v| v);
        let [a, b, c, d] = [a, b, c, d].map(|texel| texel.dot(Vec3A::new(0.2126, 0.7152, 0.0722)));
        let by_texel =
            Vec2::new((b - a) * (1.0 - at.y) + (d - c) * at.y, (c - a) * (1.0 - at.x) + (d - b) * at.x);
        let size = Vec2::new(self.bitmap.width() as f32, self.bitmap.height() as f32);
        self.to_uv.matrix2.transpose() * (by_texel * size)
    }

    /// The texture at texture coordinates `uv`, with each texel made usable.
    #[inline(always)]
    fn value(&self, uv: Vec2, usable: impl Fn(Vec3A) -> Vec3A) -> Vec3A {
        let ([a, b, c, d], Vec2 { x: s, y: t }) = self.texels(uv, usable);
        if self.nearest {
            return a;
        }
        (a * (1.0 - s) + b * s) * (1.0 - t) + (c * (1.0 - s) + d * s) * t
    }

    /// The four texels around texture coordinates `uv`, row by row, and the interpolation weights; for nearest-neighbour lookup
    /// the first counts.
    #[inline(always)]
    fn texels(&self, uv: Vec2, usable: impl Fn(Vec3A) -> Vec3A) -> ([Vec3A; 4], Vec2) {
        let size = [self.bitmap.width(), self.bitmap.height()];
        let (at, offset) = cell(&self.to_uv, size, self.nearest, uv);
        let pair = |i: usize| [at[i], at[i].saturating_add(1)].map(|at| self.wrap.index(at, size[i]));
        let ([left, right], [above, below]) = (pair(0), pair(1));
        let texels = self.bitmap.texels([[left, above], [right, above], [left, below], [right, below]]);
        (texels.map(usable), offset)
    }
}

impl AttributeTexture {
    /// The values at a point; three equal ones for a scalar attribute.
    fn values(&self, at: &TexturePoint) -> [f32; 3] {
        let AttributeLayout { first, colored, .. } = self.layout;
        let value =
            |i: usize| at.attributes.get(first + i * usize::from(colored)).map_or(0.0, |v| v * self.scale);
        self.shown([value(0), value(1), value(2)])
    }

    /// Mean of the values.
    fn mean(&self) -> [f32; 3] {
        self.shown(self.layout.mean.map(|v| v * self.scale))
    }

    fn shown(&self, rgb: [f32; 3]) -> [f32; 3] {
        if self.grey { [luminance(rgb); 3] } else { rgb }
    }
}

/// Luminance of a linear Rec.709 colour.
fn luminance([r, g, b]: [f32; 3]) -> f32 {
    if r == g && g == b { r.max(0.0) } else { (0.2126 * r + 0.7152 * g + 0.0722 * b).max(0.0) }
}

/// `v` clamped to [0, 1e30]; NaN becomes 0.
fn not_negative(v: f32) -> f32 {
    if v > 0.0 { v.min(1e30) } else { 0.0 }
}

/// [`not_negative`] of each component.
fn texel_not_negative(texel: Vec3A) -> Vec3A {
    texel.to_array().map(not_negative).into()
}

/// [`clean`] of each component.
#[inline(always)]
fn clean_texel(texel: Vec3A) -> Vec3A {
    Vec3A::select(texel.cmpgt(Vec3A::ZERO), texel.min(Vec3A::ONE), Vec3A::ZERO)
}

/// `v` clamped to [0, 1]; NaN becomes 0.
fn clean(v: f32) -> f32 {
    if v > 0.0 { v.min(1.0) } else { 0.0 }
}
