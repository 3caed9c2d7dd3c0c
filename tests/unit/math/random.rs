//! Tests of `math::random`.

use pointillist::math::random::Random;

/// Means of uniform numbers are within five standard deviations of the middle, and no number is outside.
#[test]
fn numbers_fill_their_ranges() {
    const N: usize = 20_000;
    let mut random = Random(3);
    let mut sums = [0f64; 6];
    for _ in 0..N {
        let (within, below, point, direction) =
            (random.within(-3.0, 5.0), random.below(9), random.point(), random.direction());
        assert!((-3.0..5.0).contains(&within) && below < 9);
        assert!(point.min_element() >= 0.0 && point.max_element() < 1.0);
        assert!((direction.length() - 1.0).abs() < 1e-12);
        // Each brought to mean 0 and variance 1/12, directions by their variance of 1/3.
        let unit = [
            (f64::from(within) - 1.0) / 8.0,
            (below as f64 - 4.0) / 8.0,
            f64::from(point.y) - 0.5,
            0.5 * direction.x,
            0.5 * direction.z,
            random.f64() - 0.5,
        ];
        sums.iter_mut().zip(unit).for_each(|(sum, v)| *sum += v);
    }
    let most = 5.0 * (N as f64 / 12.0).sqrt();
    assert!(sums.iter().all(|sum| sum.abs() < most * 1.3), "{sums:?}, at most {most}");
    assert_eq!(random.below(0), 0);
}
