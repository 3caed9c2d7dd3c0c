//! Pictures embedded in a page: `data:` URIs (RFC 2397).

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::color::{Profile, srgb};
use crate::image::Grid;
use crate::image::png::{self, PngPicture, Transfer};

/// JPEG quality of 100: with chroma at full resolution, noise looks unchanged.
const QUALITY: u8 = 92;

/// The picture as PNG, without loss. `None` for a wrong number of pixels.
pub fn png(picture: PngPicture<'_>) -> Option<String> {
    let bytes = png::encode(picture, &[]).ok()?;
    Some(format!("data:image/png;base64,{}", STANDARD.encode(&bytes)))
}

/// A display-linear picture (sRGB primaries, values in [0, 1]) as JPEG, reduced by averaging squares of pixels so that its sides are at most
/// `side`. Channels that are not finite are black. `None` for a picture without pixels, or more than 65535 along a side.
pub fn displayed(linear: &Grid<[f32; 3]>, side: usize) -> Option<String> {
    let mean = |square: &[[f32; 3]]| {
        std::array::from_fn(|c| square.iter().map(|rgb| rgb[c]).sum::<f32>() / square.len() as f32)
    };
    let small = linear.reduced(side, mean);
    let rgb: Vec<[u8; 3]> = small
        .pixels()
        .iter()
        .map(|rgb| rgb.map(|c| if c.is_finite() { srgb::encode_8bit(c) } else { 0 }))
        .collect();
    jpeg(u32::try_from(small.width()).ok()?, u32::try_from(small.height()).ok()?, &rgb)
}

/// A map as PNG, with the `color` of each value in 8 bits of sRGB. `None` for a map without pixels.
pub fn false_colors(map: &Grid<f32>, color: impl Fn(f32) -> [u8; 3]) -> Option<String> {
    let rgb: Vec<[u8; 3]> = map.pixels().iter().map(|&value| color(value)).collect();
    let [width, height] = [u32::try_from(map.width()).ok()?, u32::try_from(map.height()).ok()?];
    let primaries = Profile::srgb().primaries;
    png(PngPicture { width, height, rgb: &rgb, transfer: Transfer::Srgb, primaries })
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
