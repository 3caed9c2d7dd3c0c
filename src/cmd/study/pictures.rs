//! Pictures for the page of a study: displayed, and reduced in size.

use crate::client::{DisplayImage, Settings};
use crate::color::palette;
use crate::image::compare::{PIXELS_PER_DEGREE, flip};
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
    data_uri::displayed(linear, SIDE, data_uri::QUALITY)
}

/// Mean FLIP between two display-linear pictures, and its map as data URI; an error of 1 for pictures of different sizes.
pub fn difference(picture: &Grid<[f32; 3]>, reference: &Grid<[f32; 3]>) -> (f64, Option<String>) {
    let Ok(seen) = flip(picture, reference, PIXELS_PER_DEGREE) else { return (1.0, None) };
    let mean = |square: &[f32]| square.iter().sum::<f32>() / square.len() as f32;
    (seen.mean, data_uri::false_colors(&seen.map.reduced(SIDE, mean), palette::color))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_fit_the_page_and_compare() {
        let wide = Grid::try_filled(1000, 40, [0.25; 3]).expect("a grid");
        assert!(uri(&wide).is_some_and(|text| text.starts_with("data:image/jpeg;base64,/9j/")));
        let (error, map) = difference(&wide, &wide);
        assert!(error < 1e-6 && map.is_some());
        let small = Grid::try_filled(250, 10, [0.25; 3]).expect("a grid");
        assert_eq!(difference(&wide, &small).0, 1.0);
    }
}
