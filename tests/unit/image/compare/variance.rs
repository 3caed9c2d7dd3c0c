//! Tests of `image::compare::variance`.

use pointillist::image::compare::*;

fn row(mean: &[f64], variance: &[f64]) -> Measured {
    Measured { width: mean.len(), height: 1, mean: mean.to_vec(), variance: variance.to_vec() }
}

#[test]
fn the_relative_standard_error_is_its_formula() {
    // 100 pixels of mean 2, the i-th with a standard error of i %.
    let picture = Measured {
        width: 10,
        height: 10,
        mean: vec![2.0; 100],
        variance: (1..=100).map(|i| (0.02 * f64::from(i)).powi(2)).collect(),
    };
    let error = relative_standard_error(&picture).expect("100 pixels");
    for (got, percent) in [(error.median, 50.0), (error.p95, 95.0), (error.p99, 99.0)] {
        assert!((got - 0.01 * percent / 1.01).abs() < 1e-6, "{percent}: {got}");
    }
    assert_eq!(error.skipped, 0);
}

#[test]
fn odd_pixels_have_a_defined_relative_standard_error() {
    let odd = row(&[1.0, f64::NAN, 1.0, 1.0, -1.0], &[f64::INFINITY, 1.0, 0.0, -1.0, 1.0]);
    let error = relative_standard_error(&odd).expect("5 pixels");
    assert_eq!((error.skipped, error.median), (2, 0.0));
    assert!(error.map.at(0, 0).is_nan() && error.map.at(1, 0).is_nan());
    assert!((error.p99 - 1.0 / 1.01).abs() < 1e-6);
    // Black without and with noise.
    let black = relative_standard_error(&row(&[0.0, 0.0], &[0.0, 1.0])).expect("2 pixels");
    assert_eq!(black.map.pixels(), [0.0, f32::INFINITY]);
    assert_eq!(relative_standard_error(&row(&[], &[])).expect("none").p99, 0.0);
    assert!(relative_standard_error(&row(&[1.0, 2.0], &[1.0])).is_err());
}

#[test]
fn the_map_of_z_has_signs_and_odd_pixels() {
    let a = row(&[1.0, 4.0, 1.0, f64::NAN, 1.0], &[9.0, 0.0, 0.0, 1.0, f64::INFINITY]);
    let b = row(&[11.0, 4.0, 2.0, 1.0, 1.0], &[16.0, 0.0, 0.0, 1.0, 1.0]);
    let map = z_map(&a, &b).expect("same size");
    assert_eq!(map.pixels()[..4], [-2.0, 0.0, f32::NEG_INFINITY, f32::INFINITY]);
    assert!(map.at(4, 0).is_nan());
    let empty = row(&[], &[]);
    assert!(z_map(&empty, &empty).expect("same size").pixels().is_empty());
    assert!(z_map(&a, &empty).is_err());
    assert!(z_map(&Measured { mean: vec![], ..a.clone() }, &b).is_err());
}
