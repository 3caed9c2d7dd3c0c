//! FLIP: what a person sees when two pictures alternate in the same place.

use super::{MetricMap, Rgb, is_finite, map, same_size};
use crate::color::srgb;
use crate::image::error::ImageError;
use crate::image::grid::Grid;

/// Pixels per degree of the eye in front of a display 0.7 m wide with 3840 pixels, 0.7 m away: the paper's.
pub const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// Pixels per degree that the filters are made for; 500 is a microscope's.
const SENSIBLE: (f32, f32) = (1.0, 500.0);

/// Most pixels: the library counts bytes in 32 bits.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn even(width: usize, height: usize, rgb: [f32; 3]) -> Grid<[f32; 3]> {
        Grid::from_rows(width, height, vec![rgb; width * height]).expect("as many")
    }

    fn of(a: &Grid<[f32; 3]>, b: &Grid<[f32; 3]>) -> MetricMap {
        flip(a, b, PIXELS_PER_DEGREE).expect("same size")
    }

    #[test]
    fn equal_pictures_have_none() {
        let noise = (0..600).map(|i| [0.1, 0.5, 0.9].map(|k| (i as f32 * 12.9898 * (1.0 + k)).sin().abs()));
        let noise = Grid::from_rows(30, 20, noise.collect()).expect("600 pixels");
        assert_eq!((of(&noise, &noise).mean, of(&noise, &noise).map.at(7, 3)), (0.0, 0.0));
    }

    /// Even pictures have no edges, and their filtered colours are their own, so that the paper's equations can be
    /// followed by hand. HyAB of white and black is 100; of Hunt-adjusted green and blue, the largest, 203.2.
    /// To the power 0.7 these are 25.1 and 41.2; the knee is at 0.4 · 41.2 = 16.5 and 0.95, so that the error is
    /// 0.95 + 0.05 (25.1 − 16.5)/(41.2 − 16.5).
    #[test]
    fn black_against_white_is_the_papers() {
        let error = of(&even(40, 30, [0.0; 3]), &even(40, 30, [1.0; 3]));
        assert!((error.mean - 0.9674).abs() < 5e-4, "{}", error.mean);
        assert!((f64::from(error.map.at(20, 15)) - error.mean).abs() < 1e-4);
    }

    /// Reference figures: a direct evaluation of the paper's two-dimensional filters in double precision (numpy), written
    /// apart from the authors' code.
    #[test]
    fn edges_and_points_are_the_papers() {
        let of_bytes = |rgb: [u8; 3]| rgb.map(|c| srgb::decode(f32::from(c) / 255.0));
        let picture = |at: &dyn Fn(usize, usize) -> [u8; 3]| {
            let pixels = (0..20 * 24).map(|i| of_bytes(at(i % 24, i / 24))).collect();
            Grid::from_rows(24, 20, pixels).expect("480 pixels")
        };
        let (dark, light, red) = ([60; 3], [200, 180, 90], [220, 40, 40]);
        let reference = picture(&|x, _| if x < 12 { dark } else { light });
        let moved = picture(&|x, y| match (x, y) {
            (3..5, 5..9) => red,
            (0..14, _) => dark,
            _ => light,
        });
        let error = of(&moved, &reference);
        for (got, expected) in [
            (error.mean, 0.276_127),
            (f64::from(error.map.at(3, 6)), 0.742_808),
            (f64::from(error.map.at(12, 10)), 0.800_199),
            (f64::from(error.map.at(20, 15)), 0.066_061),
        ] {
            assert!((got - expected).abs() < 1e-3, "{got}, expected {expected}");
        }
    }

    /// A lone pixel is seen more than its share of a blur would tell, and less from afar.
    #[test]
    fn distance_hides_points() {
        let mut point = even(41, 41, [0.2; 3]);
        point.pixels_mut()[20 * 41 + 20] = [1.0; 3];
        let grey = even(41, 41, [0.2; 3]);
        let at = |ppd| flip(&point, &grey, ppd).expect("same size");
        let (near, far) = (at(30.0), at(120.0));
        assert!(near.map.at(20, 20) > far.map.at(20, 20), "{} {}", near.map.at(20, 20), far.map.at(20, 20));
        assert!(near.map.at(0, 0) < 1e-4);
    }

    #[test]
    fn odd_pictures_have_a_defined_result() {
        let mut odd = even(8, 8, [0.5; 3]);
        odd.pixels_mut()[9] = [0.5, f32::NAN, 0.5];
        let error = of(&odd, &even(8, 8, [0.5; 3]));
        assert_eq!(error.map.at(1, 1), 1.0);
        assert!(error.map.pixels().iter().all(|e| (0.0..=1.0).contains(e)));
        assert_eq!(of(&odd, &odd).map.at(1, 1), 1.0);
        assert_eq!(of(&even(0, 0, [0.0; 3]), &even(0, 0, [0.0; 3])).mean, 0.0);
        assert_eq!(of(&even(1, 1, [0.3; 3]), &even(1, 1, [0.3; 3])).mean, 0.0);
        let other = even(4, 8, [0.5; 3]);
        assert!(matches!(flip(&odd, &other, 67.0), Err(ImageError::Size { .. })));
        for ppd in [f32::NAN, 0.0, -3.0, f32::INFINITY] {
            assert!(flip(&other, &other, ppd).expect("same size").mean == 0.0, "{ppd}");
        }
    }
}
