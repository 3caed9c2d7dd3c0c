//! Comparison of pictures: the test of equality accepts equal expectations and rejects small differences.

use pointillist::image::compare::{Measured, critical_value, rel_mse, z_test};
use pointillist::image::{Grid, ImageError};
use pointillist::math::random::Random;

/// Standard normal numbers (Box and Muller 1958).
struct Normal(Random);

impl Normal {
    fn next(&mut self) -> f64 {
        // 1 − u is never 0.
        let (u, v) = (1.0 - self.0.f64(), self.0.f64());
        (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    }
}

fn measured(seed: u64, bias: f64) -> Measured {
    let mut normal = Normal(Random(seed));
    let sigma = |i: usize| 0.01 * (1 + i % 7) as f64;
    Measured {
        width: 100,
        height: 100,
        mean: (0..10_000).map(|i| 1.0 + bias * sigma(i) + sigma(i) * normal.next()).collect(),
        variance: (0..10_000).map(|i| sigma(i).powi(2)).collect(),
    }
}

#[test]
fn critical_values_are_those_of_the_tables() {
    for (p, z) in
        [(0.05, 1.959_963_984_5), (0.01, 2.575_829_303_5), (1e-6, 4.891_638_475_7), (1e-12, 7.130_506_8)]
    {
        assert!((critical_value(p) - z).abs() < 1e-6, "{p}: {}", critical_value(p));
    }
}

#[test]
fn equal_expectations_are_accepted() {
    let result = z_test(&measured(1, 0.0), &measured(2, 0.0), 0.01).expect("same size");
    assert_eq!((result.pixels, result.skipped), (10_000, 0));
    assert_eq!(result.accepted, 1.0);
    // Mean of z² over n pixels has a standard deviation of √(2/n) = 0.014.
    assert!((result.mean_z2 - 1.0).abs() < 0.06, "{result:?}");
    assert!((result.mean_ratio - 1.0).abs() < 4.0 * result.mean_ratio_error, "{result:?}");
    assert!(result.mean_ratio_error < 1e-3);
}

#[test]
fn differences_are_found() {
    // Half a σ everywhere: no single pixel stands out, the means do.
    let small = z_test(&measured(1, 0.5), &measured(2, 0.0), 0.01).expect("same size");
    assert!(small.mean_z2 > 1.06 && (small.mean_ratio - 1.0) > 10.0 * small.mean_ratio_error, "{small:?}");
    // 1 % of the pixels far off: the share tells.
    let mut off = measured(1, 0.0);
    off.mean.iter_mut().step_by(100).for_each(|m| *m *= 2.0);
    let some = z_test(&off, &measured(2, 0.0), 0.01).expect("same size");
    assert!((some.accepted - 0.99).abs() < 1e-3, "{some:?}");
}

#[test]
fn odd_pixels_have_a_defined_result() {
    let picture = |mean: [f64; 4], variance: [f64; 4]| Measured {
        width: 4,
        height: 1,
        mean: mean.to_vec(),
        variance: variance.to_vec(),
    };
    let a = picture([1.0, 2.0, f64::NAN, 5.0], [0.0, 0.0, 1.0, f64::INFINITY]);
    let b = picture([1.0, 2.1, 1.0, 5.0], [0.0; 4]);
    let result = z_test(&a, &b, 0.01).expect("same size");
    assert_eq!((result.pixels, result.skipped), (3, 1));
    assert!((result.accepted - 1.0 / 3.0).abs() < 1e-12, "{result:?}");
    let empty = Measured { width: 0, height: 0, mean: vec![], variance: vec![] };
    assert_eq!(z_test(&empty, &empty, 0.01).expect("same size").accepted, 0.0);
    assert!(matches!(z_test(&a, &empty, 0.01), Err(ImageError::Size { .. })));
}

#[test]
fn rel_mse_is_its_formula() {
    let grid = |v: f32| Grid::from_rows(50, 40, vec![[v; 3]; 2000]).expect("2000 pixels");
    let error = rel_mse(&grid(1.1), &grid(1.0)).expect("same size");
    assert!((error.whole - 0.01 / 1.01).abs() < 1e-6 && (error.trimmed - error.whole).abs() < 1e-6);
    // One firefly in 2000 pixels is what trimming takes away.
    let mut firefly = grid(1.1);
    firefly.pixels_mut()[77] = [1e4; 3];
    let error = rel_mse(&firefly, &grid(1.0)).expect("same size");
    assert!(error.whole > 1e4 && (error.trimmed - 0.01 / 1.01).abs() < 1e-6, "{error:?}");
    firefly.pixels_mut()[77] = [f32::NAN; 3];
    assert_eq!(rel_mse(&firefly, &grid(1.0)).expect("same size").whole, f64::INFINITY);
    assert!(rel_mse(&grid(1.0), &Grid::from_rows(1, 1, vec![[0.0; 3]]).expect("one")).is_err());
}
