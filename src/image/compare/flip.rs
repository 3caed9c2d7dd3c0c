//! FLIP: visibility of the difference of two pictures that alternate in the same place.

use super::{MetricMap, Rgb, is_finite, map, same_size};
use crate::color::srgb;
use crate::image::error::ImageError;
use crate::image::grid::Grid;

/// Pixels per degree of the eye in front of a display 0.7 m wide with 3840 pixels, 0.7 m away: the paper's.
pub const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// Range of pixels per degree that the filters are designed for; 500 is a microscope's.
const SENSIBLE: (f32, f32) = (1.0, 500.0);

/// Most pixels, since the library counts bytes in 32 bits.
const MOST_PIXELS: usize = 1 << 28;

/// LDR-FLIP of two displayed pictures, linear sRGB in [0, 1], as their 8-bit sRGB encodings: 0 (equal) to 1 in every pixel.
/// The mean over the pixels is the authors' choice where one number must do.
///
/// A pixel that is not finite is black to its neighbours and has itself the error 1. `pixels_per_degree` is usually
/// [`PIXELS_PER_DEGREE`]; what is not finite means that, and what is outside 1 to 500 is clamped.
///
/// More than 2^28 pixels are refused by [`ImageError::TooLarge`].
///
/// # Source
/// Andersson et al., *FLIP: A Difference Evaluator for Alternating Images* (2020), by the authors' code (`nv-flip`).
pub fn flip(picture: &Rgb, reference: &Rgb, pixels_per_degree: f32) -> Result<MetricMap, ImageError> {
    let size = (picture.width(), picture.height());
    same_size(size, (reference.width(), reference.height()))?;
    if picture.pixels().is_empty() {
        return map(picture, reference, |_, _| 0.0).map(MetricMap::new);
    }
    let too_large = || ImageError::TooLarge { size, most: MOST_PIXELS };
    let (Ok(width), Ok(height), ..=MOST_PIXELS) =
        (u32::try_from(size.0), u32::try_from(size.1), picture.pixels().len())
    else {
        return Err(too_large());
    };
    let encoded = |picture: &Rgb| {
        let encode = |&rgb: &[f32; 3]| if is_finite(rgb) { rgb.map(srgb::encode_8bit) } else { [0; 3] };
        let bytes: Vec<[u8; 3]> = picture.pixels().iter().map(encode).collect();
        nv_flip::FlipImageRgb8::with_data(width, height, bytes.as_flattened())
    };
    let ppd = if pixels_per_degree.is_finite() { pixels_per_degree } else { PIXELS_PER_DEGREE };
    let seen = nv_flip::flip(encoded(reference), encoded(picture), ppd.clamp(SENSIBLE.0, SENSIBLE.1));
    let seen = Grid::from_rows(size.0, size.1, seen.to_vec()).ok_or_else(too_large)?;
    let odd = map(picture, reference, |x, r| if is_finite(x) && is_finite(r) { 0.0 } else { 1.0 })?;
    map(&seen, &odd, f32::max).map(MetricMap::new)
}
