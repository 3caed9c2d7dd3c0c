//! Tests of `spectrum::table`.

use pointillist::spectrum::*;

/// The definition, by search through all pieces.
fn naive(points: &[(f32, f32)], lambda: f32) -> f32 {
    points
        .windows(2)
        .find(|w| lambda >= w[0].0 && lambda <= w[1].0)
        .map_or(0.0, |w| w[0].1 + (lambda - w[0].0) / (w[1].0 - w[0].0) * (w[1].1 - w[0].1))
}

#[test]
fn interpolates_like_the_definition() {
    let regular: Vec<_> = (0..95).map(|i| (360.0 + 5.0 * i as f32, (i % 7) as f32)).collect();
    let spike = vec![(500.0, 0.0), (500.01, 100.0), (500.02, 0.0), (500.5, 1.0), (700.25, 2.0)];
    let wide = vec![(1.0, 3.0), (5000.0, 4.0)];
    let outside = vec![(100.0, 1.0), (200.0, 2.0)];
    for points in [regular, spike, wide, outside] {
        let table = Table::new(&points).expect("valid points");
        for i in 0..60_000 {
            let lambda = 350.0 + i as f32 * 0.0083;
            let (got, exact) = (table.at(lambda), naive(&points, lambda));
            // Steep pieces magnify the rounding of the wavelength itself.
            assert!((got - exact).abs() < 1e-4 * (1.0 + table.max()), "{lambda}: {got} {exact}");
        }
        assert_eq!(table.at(points[0].0), points[0].1);
        assert_eq!(table.at(f32::NAN), 0.0);
    }
}

#[test]
fn refuses_what_is_no_spectrum() {
    let bad: [&[(f32, f32)]; 7] = [
        &[],
        &[(500.0, 1.0)],
        &[(500.0, 1.0), (500.0, 2.0)],
        &[(500.0, 1.0), (400.0, 2.0)],
        &[(400.0, f32::NAN), (500.0, 1.0)],
        &[(400.0, 1.0), (f32::INFINITY, 1.0)],
        &[(400.0, -0.1), (500.0, 1.0)],
    ];
    for points in bad {
        assert_eq!(Table::new(points), None, "{points:?}");
    }
}
