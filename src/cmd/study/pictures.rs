//! Pictures for the page of a study: displayed, and reduced in size.

use crate::client::{DisplayImage, Settings};
use crate::color::{Profile, palette, srgb};
use crate::image::compare::{PIXELS_PER_DEGREE, flip};
use crate::image::png::{PngPicture, Transfer};
use crate::image::{Grid, data_uri};

/// Longest side on the page, pixels.
const SIDE: usize = 320;

/// Display-linear sRGB of a displayed picture; empty if pixels are missing.
pub fn linear(shown: &DisplayImage, settings: &Settings) -> Grid<[f32; 3]> {
    let decode: Vec<f32> = (0..256).map(|i| (i as f32 / 255.0).powf(settings.gamma)).collect();
    let pixels = shown.rgb.iter().map(|rgb| rgb.map(|c| decode[usize::from(c)])).collect();
    Grid::from_rows(shown.width as usize, shown.height as usize, pixels).unwrap_or_default()
}

/// Data URI of a display-linear picture; `None` if it has no pixels.
pub fn uri(linear: &Grid<[f32; 3]>) -> Option<String> {
    let small = shrink(linear);
    let encode = |c: f32| if c.is_finite() { srgb::encode_8bit(c) } else { 0 };
    let rgb: Vec<[u8; 3]> = small.pixels().iter().map(|rgb| rgb.map(encode)).collect();
    let side = |n: usize| u32::try_from(n).ok();
    data_uri::jpeg(side(small.width())?, side(small.height())?, &rgb)
}

/// Mean FLIP between two display-linear pictures, and its map as data URI; an error of 1 for pictures of different sizes.
pub fn difference(picture: &Grid<[f32; 3]>, reference: &Grid<[f32; 3]>) -> (f64, Option<String>) {
    let Ok(seen) = flip(picture, reference, PIXELS_PER_DEGREE) else { return (1.0, None) };
    let spread: Vec<[f32; 3]> = seen.map.pixels().iter().map(|&e| [e; 3]).collect();
    let map = Grid::from_rows(seen.map.width(), seen.map.height(), spread).and_then(|map| {
        let small = shrink(&map);
        let rgb: Vec<[u8; 3]> = small.pixels().iter().map(|&[e, ..]| palette::color(e)).collect();
        let [width, height] = [u32::try_from(small.width()).ok()?, u32::try_from(small.height()).ok()?];
        let primaries = Profile::srgb().primaries;
        data_uri::png(PngPicture { width, height, rgb: &rgb, transfer: Transfer::Srgb, primaries })
    });
    (seen.mean, map)
}

/// Downsamples by averaging squares of pixels, so that the longest side fits.
fn shrink(picture: &Grid<[f32; 3]>) -> Grid<[f32; 3]> {
    let step = picture.width().max(picture.height()).div_ceil(SIDE).max(1);
    let (width, height) = (picture.width() / step, picture.height() / step);
    let mean = |i: usize| {
        let (x, y) = (i % width * step, i / width * step);
        let mut sum = [0.0; 3];
        for pixel in (0..step * step).map(|k| picture.at(x + k % step, y + k / step)) {
            for (sum, value) in sum.iter_mut().zip(pixel) {
                *sum += value / (step * step) as f32;
            }
        }
        sum
    };
    Grid::from_rows(width, height, (0..width * height).map(mean).collect()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_fit_the_page_and_keep_their_mean() {
        let wide =
            Grid::from_rows(1000, 3, (0..3000).map(|i| [(i % 2) as f32; 3]).collect()).expect("a grid");
        let small = shrink(&wide);
        assert_eq!((small.width(), small.height()), (250, 0));
        let wide = Grid::try_filled(1000, 40, [0.25; 3]).expect("a grid");
        let small = shrink(&wide);
        assert_eq!((small.width(), small.height(), small.at(7, 3)), (250, 10, [0.25; 3]));
        assert!(uri(&wide).is_some_and(|text| text.starts_with("data:image/jpeg;base64,/9j/")));
        let (error, map) = difference(&wide, &wide);
        assert!(error < 1e-6 && map.is_some());
        assert_eq!(difference(&wide, &small).0, 1.0);
    }
}
