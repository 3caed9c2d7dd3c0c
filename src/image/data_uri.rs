//! Pictures embedded in a page: `data:` URIs (RFC 2397).

use std::collections::BTreeSet;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use crate::color::{Profile, srgb};
use crate::image::Grid;
use crate::image::png::{self, PngPicture, Transfer};

/// JPEG quality of 100 at which noise looks unchanged, with chroma at full resolution.
pub const QUALITY: u8 = 92;

/// Most colours of a PNG with a palette.
const COLORS: usize = 256;

/// The picture as PNG, without loss. `None` for a wrong number of pixels.
pub fn png(picture: PngPicture<'_>) -> Option<String> {
    png::encode(picture, &[]).ok().map(|bytes| png_uri(&bytes))
}

fn png_uri(bytes: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(bytes))
}

/// The number of each pixel's colour, and the colours in order; `None` for more than 256 of them.
fn with_palette(rgb: &[[u8; 3]]) -> Option<(Vec<u8>, Vec<[u8; 3]>)> {
    let colors: BTreeSet<[u8; 3]> = rgb.iter().copied().collect();
    if colors.len() > COLORS {
        return None;
    }
    let palette: Vec<[u8; 3]> = colors.into_iter().collect();
    let index = |color| palette.binary_search(color).ok().and_then(|index| u8::try_from(index).ok());
    Some((rgb.iter().map(index).collect::<Option<_>>()?, palette))
}

/// A display-linear picture (sRGB primaries, values in [0, 1]) as JPEG of this quality from 1 to 100, reduced by averaging squares of pixels so that its sides are at most
/// `side`. Channels that are not finite are black. `None` for a picture without pixels, or more than 65535 along a side.
pub fn displayed(linear: &Grid<[f32; 3]>, side: usize, quality: u8) -> Option<String> {
    let mean = |square: &[[f32; 3]]| {
        std::array::from_fn(|c| square.iter().map(|rgb| rgb[c]).sum::<f32>() / square.len() as f32)
    };
    let small = linear.reduced(side, mean);
    let rgb: Vec<[u8; 3]> = small
        .pixels()
        .iter()
        .map(|rgb| rgb.map(|c| if c.is_finite() { srgb::encode_8bit(c) } else { 0 }))
        .collect();
    jpeg_of_quality(u32::try_from(small.width()).ok()?, u32::try_from(small.height()).ok()?, &rgb, quality)
}

/// A map as PNG, with the `color` of each value in 8 bits of sRGB. Up to 256 colours are stored as a palette, which takes about half the room.
/// `None` for a map without pixels.
pub fn false_colors(map: &Grid<f32>, color: impl Fn(f32) -> [u8; 3]) -> Option<String> {
    let rgb: Vec<[u8; 3]> = map.pixels().iter().map(|&value| color(value)).collect();
    let [width, height] = [u32::try_from(map.width()).ok()?, u32::try_from(map.height()).ok()?];
    if let Some((indices, palette)) = with_palette(&rgb) {
        return png::encode_indexed([width, height], &indices, &palette).ok().map(|bytes| png_uri(&bytes));
    }
    let primaries = Profile::srgb().primaries;
    png(PngPicture { width, height, rgb: &rgb, transfer: Transfer::Srgb, primaries })
}

/// The picture as JPEG, a third of the size of a noisy PNG; values are taken as sRGB. `None` for a wrong number of pixels
/// or more than 65535 along a side.
pub fn jpeg(width: u32, height: u32, rgb: &[[u8; 3]]) -> Option<String> {
    jpeg_of_quality(width, height, rgb, QUALITY)
}

fn jpeg_of_quality(width: u32, height: u32, rgb: &[[u8; 3]], quality: u8) -> Option<String> {
    let [w, h] = [width, height].map(|side| u16::try_from(side).ok());
    let (w, h) = w.zip(h).filter(|(w, h)| rgb.len() == usize::from(*w) * usize::from(*h))?;
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, quality);
    encoder.set_sampling_factor(jpeg_encoder::SamplingFactor::F_1_1);
    encoder.encode(rgb.as_flattened(), w, h, jpeg_encoder::ColorType::Rgb).ok()?;
    Some(format!("data:image/jpeg;base64,{}", STANDARD.encode(&bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a browser makes of a `data:` URI of a PNG.
    fn decoded(uri: &str) -> image::RgbImage {
        let data = uri.strip_prefix("data:image/png;base64,").expect("a PNG");
        image::load_from_memory(&STANDARD.decode(data).expect("base64")).expect("a picture").to_rgb8()
    }

    #[test]
    fn maps_have_their_colors_with_a_palette_and_without() {
        let map = |side: usize| {
            Grid::from_rows(side, side, (0..side * side).map(|i| i as f32).collect()).expect("a grid")
        };
        let color = |value: f32| [(value % 256.0) as u8, (value / 256.0) as u8, 7];
        // Of 256 and of 1024 colours.
        for side in [16, 32] {
            let map = map(side);
            let seen = decoded(&false_colors(&map, color).expect("a PNG"));
            let wanted: Vec<[u8; 3]> = map.pixels().iter().map(|&value| color(value)).collect();
            assert_eq!(seen.pixels().map(|pixel| pixel.0).collect::<Vec<_>>(), wanted, "{side}");
        }
        let few = |value: f32| [(value % 25.0) as u8; 3];
        let seen = decoded(&false_colors(&map(32), few).expect("a PNG"));
        assert!(seen.pixels().zip(map(32).pixels()).all(|(pixel, &value)| pixel.0 == few(value)));
        assert_eq!(false_colors(&Grid::default(), few), None);
    }
}
