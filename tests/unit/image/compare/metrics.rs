//! Tests of `image::compare::metrics`.

use pointillist::image::compare::*;
use pointillist::image::error::ImageError;
use pointillist::image::grid::Grid;

#[test]
fn the_map_adds_up_to_the_figure() {
    let grid = |pixels: Vec<[f32; 3]>| Grid::from_rows(2, 1, pixels).expect("2 pixels");
    let (a, b) = (grid(vec![[1.0, 2.0, 3.0], [0.1; 3]]), grid(vec![[1.0; 3], [0.0; 3]]));
    let map = rel_mse_map(&a, &b).expect("same size");
    // (0 + 1 + 4)/3 over 1.01, and 0.01 over 0.01.
    assert!((map.at(0, 0) - 5.0 / 3.03).abs() < 1e-6 && (map.at(1, 0) - 1.0).abs() < 1e-6, "{map:?}");
    let whole = rel_mse(&a, &b).expect("same size").whole;
    assert!((whole - 0.5 * (5.0 / 3.03 + 1.0)).abs() < 1e-6);
    for odd in [f32::NAN, f32::INFINITY] {
        assert_eq!(rel_mse_map(&grid(vec![[odd; 3]; 2]), &b).expect("same size").at(1, 0), f32::INFINITY);
    }
}

type Rgb = Grid<[f32; 3]>;

type Metric = fn(&Rgb, &Rgb) -> Result<MetricMap, ImageError>;

/// A metric of two pictures of one pixel.
fn of_pixels(metric: Metric, a: [f32; 3], b: [f32; 3]) -> f64 {
    let grid = |v| Grid::from_rows(1, 1, vec![v]).expect("one pixel");
    metric(&grid(a), &grid(b)).expect("same size").mean
}

#[test]
fn smape_is_its_formula() {
    let of = |a, b| of_pixels(smape, a, b);
    // Term by term: 1/(2 + 1 + 0.01), 0, 0.09/(0.1 + 0.01).
    let expected = (1.0 / 3.01 + 0.0 + 0.09 / 0.11) / 3.0;
    assert!((of([2.0, 5.0, 0.095], [1.0, 5.0, 0.005]) - expected).abs() < 1e-6);
    assert!((of([1.0, 5.0, 0.005], [2.0, 5.0, 0.095]) - expected).abs() < 1e-6);
    assert_eq!(of([0.0; 3], [0.0; 3]), 0.0);
    assert!((of([1e30; 3], [0.0; 3]) - 1.0).abs() < 1e-6);
    assert!((of([f32::MAX; 3], [-f32::MAX; 3]) - 1.0).abs() < 1e-6);
}

#[test]
fn smape_of_what_is_not_finite_is_1() {
    let of = |a, b| of_pixels(smape, a, b);
    for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!((of([0.0, odd, 0.0], [0.0; 3]), of([1.0; 3], [odd, 1.0, 1.0])), (1.0, 1.0));
    }
    let empty = Grid::from_rows(0, 0, vec![]).expect("none");
    assert_eq!(smape(&empty, &empty).expect("same size").mean, 0.0);
    let one = Grid::from_rows(1, 1, vec![[0.0; 3]]).expect("one");
    assert!(matches!(smape(&empty, &one), Err(ImageError::Size { .. })));
}

#[test]
fn known_colours_are_their_distance_apart() {
    let of = |a, b| of_pixels(delta_e, a, b);
    assert_eq!(of([0.2, 0.4, 0.6], [0.2, 0.4, 0.6]), 0.0);
    assert!((of([0.0; 3], [1.0; 3]) - 1.0).abs() < 1e-5);
    // The published L, a, b of red and green: (−.238, .459, −.054).
    let expected = (0.238_48f64.powi(2) + 0.458_75f64.powi(2) + 0.053_65f64.powi(2)).sqrt();
    assert!((of([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]) - expected).abs() < 1e-4);
    // Greys have L = ∛Y: 1/8 is ½.
    assert!((of([0.125; 3], [1.0; 3]) - 0.5).abs() < 1e-4);
}

#[test]
fn quantile_and_odd_pixels() {
    let grid = |pixels: Vec<[f32; 3]>| Grid::from_rows(pixels.len(), 1, pixels).expect("a row");
    let mut pixels = vec![[0.0; 3]; 100];
    pixels[..4].fill([f32::NAN; 3]);
    let few = delta_e(&grid(pixels.clone()), &grid(vec![[0.0; 3]; 100])).expect("same size");
    assert!((few.mean - 0.04).abs() < 1e-9 && few.quantile(0.95) == 0.0, "{few:?}");
    pixels[..6].fill([1.0; 3]);
    let more = delta_e(&grid(pixels), &grid(vec![[0.0; 3]; 100])).expect("same size");
    assert!((more.quantile(0.95) - 1.0).abs() < 1e-5, "{more:?}");
    assert!(matches!(delta_e(&grid(vec![]), &grid(vec![[0.0; 3]])), Err(ImageError::Size { .. })));
    assert_eq!(delta_e(&grid(vec![]), &grid(vec![])).expect("same size").quantile(0.95), 0.0);
}
