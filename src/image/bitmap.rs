//! Image files for textures and environments, kept at the precision of the file or converted to linear light.

use std::fmt;
use std::io::Cursor;
use std::path::Path;

use glam::Vec3A;
use half::f16;
use image::{
    ColorType, DynamicImage, ImageBuffer, ImageDecoder, ImageFormat, ImageReader, Limits, RgbaImage,
};

use crate::color::srgb;
use crate::image::error::ImageError;
use crate::image::exr::{self, check_inflation, check_pixels};
use crate::image::grid::Grid;
use crate::image::ktx2::{self, Ktx2Picture, Ktx2Texels};
use crate::image::{colors, layer, pfm, radiance};
use crate::memory::collect_in_huge_pages;

/// Signature of PNG files.
const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// RGB texels, row-major from the top.
pub struct Bitmap {
    width: usize,
    height: usize,
    texels: Texels,
    /// Whether integers are linear rather than sRGB-encoded.
    raw: bool,
    /// Decoding table of 8-bit components.
    curve: [f32; 256],
    remarks: Vec<String>,
}

/// Texels at the file's precision; floats are linear. Allocated in huge pages, because paths access them at random.
enum Texels {
    Eight(Vec<[u8; 3]>),
    Sixteen(Vec<[u16; 3]>),
    Half(Vec<[f16; 3]>),
    Float(Vec<[f32; 3]>),
}

impl Bitmap {
    /// Reads a file as [`decode`](Self::decode) does its bytes.
    ///
    /// # Errors
    ///
    /// [`ImageError::Read`], and those of [`decode`](Self::decode).
    pub fn read(path: &Path, raw: bool, most: usize) -> Result<Self, ImageError> {
        let bytes = std::fs::read(path).map_err(ImageError::read(path))?;
        Self::decode(path, &bytes, raw, most)
    }

    /// Reads OpenEXR (the main layer, see [`layer::main`]), Radiance RGBE, PFM, PNG, JPEG, WebP, BMP, TGA and KTX2 (the largest level);
    /// grey pictures become RGB, and alpha is ignored. The first bytes tell the format, for TGA the ending of `path`, which otherwise
    /// names the file in errors. Integers are decoded by the curve of sRGB (IEC 61966-2-1) unless they are `raw`, or of a KTX2 file
    /// whose data format descriptor says that they are linear. Colours of an EXR file of other chromaticities are
    /// converted to Rec.709 unless they are `raw`; [`remarks`](Self::remarks) are what else a file says of its colours.
    ///
    /// # Errors
    ///
    /// [`ImageError::Decode`] for other formats, damaged files, more than `most` pixels and files made to fill the memory; [`ImageError::Channel`] for an EXR file
    /// without a main layer.
    pub fn decode(path: &Path, bytes: &[u8], raw: bool, most: usize) -> Result<Self, ImageError> {
        let refuse = ImageError::decode(path);
        let (mut remarks, mut views) = (Vec::new(), None);
        let float = |(width, height, pixels)| (width, height, Texels::of_floats(pixels));
        let mut linear = raw;
        let (width, height, texels) = match bytes {
            [0x76, 0x2f, 0x31, 0x01, ..] => {
                let promised = exr::check_size(bytes, most).map_err(refuse)?;
                check_inflation(promised, bytes.len()).map_err(refuse)?;
                let layers = exr::decode_layers(path, Cursor::new(bytes))?;
                if let [default, others @ ..] = &layers.views[..]
                    && !others.is_empty()
                {
                    views = Some(format!("its views other than {default}: {}", others.join(", ")));
                }
                let main = layer::main(&layers).ok_or_else(|| exr::no_channel(path, &layers, "R"))?;
                let mut pixels = main.pixels();
                if let Some(chromaticities) = &layers.chromaticities
                    && !raw
                    && !main.is_grey()
                {
                    colors::to_rec709(chromaticities, &mut pixels).map_err(refuse)?;
                }
                float((layers.width, layers.height, pixels))
            }
            [b'#', b'?', ..] => {
                let picture = radiance::decode(bytes, most).map_err(refuse)?;
                remarks = picture.remarks;
                float((picture.width, picture.height, picture.pixels))
            }
            [b'P', b'F' | b'f', b'\n' | b'\r' | b' ', ..] => {
                pfm::decode(bytes, most).map(float).map_err(refuse)?
            }
            bytes if ktx2::is_ktx2(bytes) => {
                let picture = ktx2::decode(bytes, most).map_err(refuse)?;
                linear |= !picture.is_srgb;
                remarks = picture.remarks;
                (picture.width, picture.height, Texels::of_ktx2(picture.texels))
            }
            _ => {
                let (picture, profile) = read_integers(path, bytes, most).map_err(refuse)?;
                remarks.extend(profile.as_deref().and_then(colors::remark_of_profile));
                if bytes.starts_with(PNG_SIGNATURE) {
                    remarks.extend(colors::remarks_of_png(bytes));
                }
                integers(picture)
            }
        };
        if raw {
            remarks.clear();
        }
        remarks.extend(views);
        Ok(Self { remarks, ..Self::new(width, height, texels, linear) })
    }

    /// What of the file is not used, as words that follow “is not used:”: colour metadata, unless the texels are raw, and further views.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }

    /// A picture of 8-bit texels, encoded as sRGB unless they are `raw`.
    ///
    /// # Panics
    ///
    /// If there is no texel, or not full rows of them.
    pub fn of_eight_bits(width: usize, texels: Vec<[u8; 3]>, raw: bool) -> Self {
        let texels = collect_in_huge_pages(texels.into_iter());
        Self::in_rows(width, texels.len(), Texels::Eight(texels), raw)
    }

    /// A picture of linear texels.
    ///
    /// # Panics
    ///
    /// If there is no texel, or not full rows of them.
    pub fn from_linear(width: usize, texels: Vec<[f32; 3]>) -> Self {
        Self::in_rows(width, texels.len(), Texels::Float(texels), true)
    }

    fn in_rows(width: usize, count: usize, texels: Texels, raw: bool) -> Self {
        assert!(width > 0 && count > 0 && count.is_multiple_of(width), "rows of {width} texels");
        Self::new(width, count / width, texels, raw)
    }

    fn new(width: usize, height: usize, texels: Texels, raw: bool) -> Self {
        let decode = |v: f32| if raw { v } else { srgb::decode(v) };
        let curve = std::array::from_fn(|v| decode(v as f32 / 255.0));
        Self { width, height, texels, raw, curve, remarks: Vec::new() }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Whether integers are decoded by the sRGB curve.
    pub fn is_decoded(&self) -> bool {
        !self.raw && matches!(self.texels, Texels::Eight(_) | Texels::Sixteen(_))
    }

    /// The linear Rec.709 value of the texel in column `x` of row `y`, which must exist.
    pub fn texel(&self, x: usize, y: usize) -> [f32; 3] {
        self.value(y * self.width + x)
    }

    /// As [`texel`](Self::texel), for four columns and rows at once.
    #[inline(always)]
    pub fn texels(&self, at: [[usize; 2]; 4]) -> [Vec3A; 4] {
        let at = at.map(|[x, y]| y * self.width + x);
        match &self.texels {
            Texels::Eight(texels) => at.map(|i| self.of_eight(texels[i]).into()),
            Texels::Float(texels) => at.map(|i| texels[i].into()),
            Texels::Half(texels) => at.map(|i| texels[i].map(f16::to_f32).into()),
            Texels::Sixteen(_) => at.map(|i| self.value(i).into()),
        }
    }

    fn value(&self, i: usize) -> [f32; 3] {
        match &self.texels {
            Texels::Eight(texels) => self.of_eight(texels[i]),
            Texels::Sixteen(texels) => texels[i].map(|v| {
                let v = f32::from(v) / 65_535.0;
                if self.raw { v } else { srgb::decode(v) }
            }),
            Texels::Half(texels) => texels[i].map(f16::to_f32),
            Texels::Float(texels) => texels[i],
        }
    }

    #[inline(always)]
    fn of_eight(&self, texel: [u8; 3]) -> [f32; 3] {
        texel.map(|v| self.curve[usize::from(v)])
    }

    /// All texels as linear Rec.709.
    pub fn into_linear(self) -> Grid<[f32; 3]> {
        let pixels = match self.texels {
            Texels::Float(texels) => texels,
            _ => (0..self.width * self.height).map(|i| self.value(i)).collect(),
        };
        Grid::from_rows(self.width, self.height, pixels).expect("a bitmap has full rows")
    }
}

impl Texels {
    /// Converts to half floats if that is exact for all `pixels`, as for most EXR files.
    fn of_floats(pixels: Vec<[f32; 3]>) -> Self {
        let is_half = |v: &f32| f16::from_f32(*v).to_f32().to_bits() == v.to_bits();
        match pixels.as_flattened().iter().all(is_half) {
            true => Self::Half(collect_in_huge_pages(pixels.iter().map(|texel| texel.map(f16::from_f32)))),
            false => Self::Float(pixels),
        }
    }

    /// Drops the alpha channel.
    fn of_ktx2(texels: Ktx2Texels) -> Self {
        match texels {
            Ktx2Texels::Eight(t) => {
                Self::Eight(collect_in_huge_pages(t.iter().map(|[r, g, b, _]| [*r, *g, *b])))
            }
            Ktx2Texels::Sixteen(t) => {
                Self::Sixteen(collect_in_huge_pages(t.iter().map(|[r, g, b, _]| [*r, *g, *b])))
            }
            Ktx2Texels::Float(t) => Self::of_floats(t.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect()),
        }
    }
}

/// Width, height and texels of a picture.
fn integers(picture: DynamicImage) -> (usize, usize, Texels) {
    let (width, height) = (picture.width() as usize, picture.height() as usize);
    let narrow =
        matches!(picture.color(), ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8);
    let texels = match narrow {
        true => Texels::Eight(collect_in_huge_pages(picture.into_rgb8().pixels().map(|p| p.0))),
        false => Texels::Sixteen(collect_in_huge_pages(picture.into_rgb16().pixels().map(|p| p.0))),
    };
    (width, height, texels)
}

/// Decodes a PNG, JPEG, WebP, BMP, TGA or KTX2 file of at most `most` pixels, with alpha if present.
pub(crate) fn picture(path: &Path, bytes: &[u8], most: usize) -> Result<DynamicImage, String> {
    if ktx2::is_ktx2(bytes) {
        return dynamic(ktx2::decode(bytes, most)?).ok_or_else(|| "its sides are too long".to_owned());
    }
    read_integers(path, bytes, most).map(|(picture, _)| picture)
}

/// A KTX2 picture with its alpha.
fn dynamic(picture: Ktx2Picture) -> Option<DynamicImage> {
    let (width, height) = (u32::try_from(picture.width).ok()?, u32::try_from(picture.height).ok()?);
    Some(match picture.texels {
        Ktx2Texels::Eight(t) => RgbaImage::from_raw(width, height, t.into_flattened())?.into(),
        Ktx2Texels::Sixteen(t) => {
            DynamicImage::ImageRgba16(ImageBuffer::from_raw(width, height, t.into_flattened())?)
        }
        Ktx2Texels::Float(t) => {
            DynamicImage::ImageRgba32F(ImageBuffer::from_raw(width, height, t.into_flattened())?)
        }
    })
}

/// As [`picture`], with the ICC profile.
fn read_integers(path: &Path, bytes: &[u8], most: usize) -> Result<(DynamicImage, Option<Vec<u8>>), String> {
    let mut reader = ImageReader::new(Cursor::new(bytes));
    match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::Bmp | ImageFormat::WebP)) => {
            reader.set_format(format);
        }
        Err(_) if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tga")) => {
            reader.set_format(ImageFormat::Tga);
        }
        _ => {
            return Err("it is neither OpenEXR, Radiance, PFM, PNG, JPEG, WebP, BMP, TGA nor KTX2".to_owned());
        }
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(most as u64 * 16);
    reader.limits(limits);
    let format = reader.format();
    let mut decoder = reader.into_decoder().map_err(|e| e.to_string())?;
    let (width, height) = decoder.dimensions();
    let (width, height) = (width as usize, height as usize);
    check_pixels(width, height, most)?;
    check_inflation(decoder.total_bytes(), bytes.len())?;
    if format == Some(ImageFormat::Jpeg) {
        check_jpeg(bytes, width, height)?;
    }
    // An unreadable profile is ignored.
    let profile = decoder.icc_profile().unwrap_or_default();
    DynamicImage::from_decoder(decoder).map(|picture| (picture, profile)).map_err(|e| e.to_string())
}

/// Rejects a JPEG file that is truncated or too short for its pixels: the decoder would fill in missing ones.
fn check_jpeg(bytes: &[u8], width: usize, height: usize) -> Result<(), String> {
    // Each block of 8 × 8 pixels, or of 16 × 16 with halved colours, takes at least three bits.
    if width * height / 1024 > bytes.len() {
        let promised = format!("its header promises {width}×{height} pixels");
        return Err(format!("{promised}, which {} bytes cannot hold", bytes.len()));
    }
    // Neither marker can occur within pixel data, and a thumbnail ends before it.
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    if last([0xff, 0xd9]) < last([0xff, 0xda]) { Err("it is cut short".to_owned()) } else { Ok(()) }
}

impl fmt::Debug for Bitmap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Bitmap({} × {})", self.width, self.height)
    }
}
