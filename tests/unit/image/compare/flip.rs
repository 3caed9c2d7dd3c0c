//! Tests of `image::compare::flip`.

use pointillist::color::srgb;
use pointillist::image::compare::*;
use pointillist::image::error::ImageError;
use pointillist::image::grid::Grid;

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
