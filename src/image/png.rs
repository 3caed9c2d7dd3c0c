//! PNG files: the displayed picture with 8 bits per channel, and its metadata as text.

use std::path::Path;

use glam::DVec2;

use crate::color::Profile;
use crate::image::error::ImageError;
use crate::image::{Attribute, write};

/// Encoding of the 8-bit values, stored so that viewers display them correctly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transfer<'a> {
    /// As sRGB (chunks sRGB and gAMA).
    Srgb,
    /// A plain power with this display gamma (chunks gAMA and cHRM).
    Gamma(f32),
    /// By the tone curves of the ICC profile of these bytes, which is embedded (chunk iCCP). It overrides gAMA and cHRM where a reader knows
    /// it (PNG specification, third edition, 11.3.2), and a single power would contradict its curves: neither is written.
    Icc(&'a [u8]),
}

impl<'a> Transfer<'a> {
    /// The encoding of values for the display of this profile: by its own ICC profile or, where it has none, by a power.
    pub fn of(profile: &'a Profile, gamma: f32) -> Self {
        profile.icc.as_deref().map_or(Self::Gamma(gamma), Self::Icc)
    }
}

/// CIE xy of D65, as the standards round it.
const D65: DVec2 = DVec2::new(0.312_7, 0.329_0);

/// A picture to be encoded.
#[derive(Clone, Copy, Debug)]
pub struct PngPicture<'a> {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Encoded R, G, B in rows from the top.
    pub rgb: &'a [[u8; 3]],
    /// Encoding of the values.
    pub transfer: Transfer<'a>,
    /// CIE xy chromaticities of red, green and blue (chunk cHRM; sRGB and an ICC profile imply their own); the white is D65.
    pub primaries: [DVec2; 3],
}

/// Writes a picture with its attributes as text; the name holds the old file or the whole new one. Refused by
/// [`ImageError::Encode`] are a wrong number of pixels, and an attribute name that PNG does not take (1 to 79 Latin letters).
pub fn write(
    path: &Path,
    picture: PngPicture<'_>,
    attributes: &[(String, Attribute)],
) -> Result<(), ImageError> {
    let bytes = encode(picture, attributes)
        .map_err(|e| ImageError::Encode { path: path.to_path_buf(), reason: e.to_string() })?;
    write::atomically(path, &bytes)
}

/// Size and metadata of a PNG file.
#[derive(Clone, Debug)]
pub struct PngDescription {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Text chunks.
    pub attributes: Vec<(String, Attribute)>,
}

/// Reads size and metadata of a PNG file.
///
/// # Errors
///
/// [`ImageError::Read`] and similar errors for a file that is not a PNG.
pub fn describe(path: &Path) -> Result<PngDescription, ImageError> {
    let file = std::fs::File::open(path).map_err(ImageError::read(path))?;
    let broken =
        |e: png::DecodingError| ImageError::Decode { path: path.to_path_buf(), reason: e.to_string() };
    let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().map_err(broken)?;
    let info = reader.info();
    let plain =
        info.uncompressed_latin1_text.iter().map(|text| (text.keyword.clone(), Ok(text.text.clone())));
    let utf8 = info.utf8_text.iter().map(|text| (text.keyword.clone(), text.get_text()));
    let texts = plain.chain(utf8).map(|(name, text)| Ok((name, Attribute::Text(text.map_err(broken)?))));
    let attributes = texts.collect::<Result<_, ImageError>>()?;
    Ok(PngDescription { size: [info.width, info.height], attributes })
}

/// The bytes of a file whose pixels, in rows from the top, are numbers of colours in 8 bits of sRGB.
///
/// # Errors
///
/// For a size without pixels, another number of pixels, and more than 256 colours.
pub fn encode_indexed(
    [width, height]: [u32; 2],
    indices: &[u8],
    palette: &[[u8; 3]],
) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Indexed);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_palette(palette.as_flattened());
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_compression(png::Compression::Balanced);
    // Differences of colour numbers mean nothing (PNG specification 12.7.4).
    encoder.set_filter(png::Filter::NoFilter);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(indices)?;
    writer.finish()?;
    Ok(bytes)
}

/// The bytes of the file.
///
/// # Errors
///
/// As for [`write`](write()).
pub fn encode(
    picture: PngPicture<'_>,
    attributes: &[(String, Attribute)],
) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut info = png::Info::with_size(picture.width, picture.height);
    if let Transfer::Icc(profile) = picture.transfer {
        info.icc_profile = Some(profile.into());
    }
    let mut encoder = png::Encoder::with_info(&mut bytes, info)?;
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::Fast);
    match picture.transfer {
        Transfer::Srgb => {
            // gAMA in addition to sRGB, for programs that do not support the latter (PNG specification 11.3.2.5).
            encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
            encoder.set_source_gamma(png::ScaledFloat::from_scaled(45_455));
        }
        Transfer::Gamma(gamma) => {
            encoder.set_source_gamma(png::ScaledFloat::new(1.0 / gamma));
            let xy = |p: DVec2| (png::ScaledFloat::new(p.x as f32), png::ScaledFloat::new(p.y as f32));
            let [red, green, blue] = picture.primaries.map(xy);
            encoder.set_source_chromaticities(png::SourceChromaticities { white: xy(D65), red, green, blue });
        }
        Transfer::Icc(_) => {}
    }
    for (name, value) in attributes {
        encoder.add_itxt_chunk(name.clone(), value.to_string())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(picture.rgb.as_flattened())?;
    writer.finish()?;
    Ok(bytes)
}
