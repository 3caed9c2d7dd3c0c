//! Pictures embedded in a page: `data:` URIs (RFC 2397).

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::image::png::{self, PngPicture};

/// JPEG quality of 100: with chroma at full resolution, noise looks unchanged.
const QUALITY: u8 = 92;

/// The picture as PNG, without loss. `None` for a wrong number of pixels.
pub fn png(picture: PngPicture<'_>) -> Option<String> {
    let bytes = png::encode(picture, &[]).ok()?;
    Some(format!("data:image/png;base64,{}", STANDARD.encode(&bytes)))
}

/// The picture as JPEG, a third of the size of a noisy PNG; values are taken as sRGB. `None` for a wrong number of pixels
/// or more than 65535 along a side.
pub fn jpeg(width: u32, height: u32, rgb: &[[u8; 3]]) -> Option<String> {
    let [w, h] = [width, height].map(|side| u16::try_from(side).ok());
    let (w, h) = w.zip(h).filter(|(w, h)| rgb.len() == usize::from(*w) * usize::from(*h))?;
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, QUALITY);
    encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::F_1_1);
    encoder.encode(rgb.as_flattened(), w, h, jpeg_encoder::ColorType::Rgb).ok()?;
    Some(format!("data:image/jpeg;base64,{}", STANDARD.encode(&bytes)))
}
