//! Pictures for textures, kept in the depth of their files.

use std::fmt;
use std::io::Cursor;
use std::path::Path;

use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};

use crate::color::srgb;
use crate::image::error::ImageError;
use crate::image::linear;

/// A picture of RGB texels in rows from the top.
pub struct Bitmap {
    width: usize,
    height: usize,
    texels: Texels,
    /// Values of 8-bit components after decoding.
    curve: [f32; 256],
}

/// The texels as the file holds them: encoded as sRGB where they are integers and not `raw`, linear where they are floats.
enum Texels {
    Eight(Vec<[u8; 3]>),
    Sixteen { texels: Vec<[u16; 3]>, raw: bool },
    Float(Vec<[f32; 3]>),
}

impl Bitmap {
    /// Reads OpenEXR, PNG, JPEG, BMP, TGA and Radiance files; grey pictures become RGB, and alpha is ignored. `path` names the file in
    /// errors, and its ending tells TGA files, which have no signature. Integers are decoded by the curve of sRGB unless they are
    /// `raw`.
    ///
    /// # Errors
    ///
    /// [`ImageError::Decode`] for other formats, damaged files, and more than `most` pixels.
    pub fn decode(path: &Path, bytes: &[u8], raw: bool, most: usize) -> Result<Self, ImageError> {
        if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
            let picture = linear::decode(path, bytes, most)?;
            let (width, height) = (picture.width(), picture.height());
            return Ok(Self::new(width, height, Texels::Float(picture.pixels().to_vec()), raw));
        }
        let refuse = |reason: String| ImageError::decode(path)(reason);
        let mut reader =
            ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|e| refuse(e.to_string()))?;
        if reader.format().is_none() && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tga")) {
            reader.set_format(ImageFormat::Tga);
        }
        let mut limits = Limits::default();
        limits.max_alloc = Some(most as u64 * 16);
        reader.limits(limits);
        let decoder = reader.into_decoder().map_err(|e| refuse(e.to_string()))?;
        let (width, height) = decoder.dimensions();
        let (width, height) = (width as usize, height as usize);
        if width == 0 || height == 0 || width.saturating_mul(height) > most {
            return Err(refuse(format!("it has {width}×{height} pixels, and 1 to {most} are read")));
        }
        let wide = !matches!(
            decoder.color_type(),
            ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8
        );
        let picture = DynamicImage::from_decoder(decoder).map_err(|e| refuse(e.to_string()))?;
        let texels = match picture {
            DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
                Texels::Float(picture.into_rgb32f().pixels().map(|p| p.0).collect())
            }
            _ if wide => {
                Texels::Sixteen { texels: picture.into_rgb16().pixels().map(|p| p.0).collect(), raw }
            }
            _ => Texels::Eight(picture.into_rgb8().pixels().map(|p| p.0).collect()),
        };
        Ok(Self::new(width, height, texels, raw))
    }

    /// A picture of linear texels.
    ///
    /// # Panics
    ///
    /// If there is no texel, or not full rows of them.
    pub fn from_linear(width: usize, texels: Vec<[f32; 3]>) -> Self {
        assert!(
            width > 0 && !texels.is_empty() && texels.len().is_multiple_of(width),
            "rows of {width} texels"
        );
        Self::new(width, texels.len() / width, Texels::Float(texels), true)
    }

    fn new(width: usize, height: usize, texels: Texels, raw: bool) -> Self {
        let decode = |v: f32| if raw { v } else { srgb::decode(v) };
        Self { width, height, texels, curve: std::array::from_fn(|v| decode(v as f32 / 255.0)) }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The linear Rec.709 value of the texel in column `x` of row `y`, which must exist.
    #[inline]
    pub fn texel(&self, x: usize, y: usize) -> [f32; 3] {
        let i = y * self.width + x;
        match &self.texels {
            Texels::Eight(texels) => texels[i].map(|v| self.curve[usize::from(v)]),
            Texels::Sixteen { texels, raw } => texels[i].map(|v| {
                let v = f32::from(v) / 65_535.0;
                if *raw { v } else { srgb::decode(v) }
            }),
            Texels::Float(texels) => texels[i],
        }
    }
}

impl fmt::Debug for Bitmap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Bitmap({} × {})", self.width, self.height)
    }
}
