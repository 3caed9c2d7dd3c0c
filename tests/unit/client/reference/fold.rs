//! Tests of `client::reference::fold`.

use pointillist::client::reference::fold::*;

/// 10^8 equal additions as batches, and one by one where a plain f32 stands still.
#[test]
fn sums_stay_exact_where_f32_stands_still() {
    let mut pair = (16_777_216.0f32, 0.0f32);
    let mut naive = 16_777_216.0f32;
    for _ in 0..1_000_001 {
        pair = two_float_add(pair.0, pair.1, 1.0);
        naive += 1.0;
    }
    assert_eq!(naive, 16_777_216.0);
    assert_eq!(f64::from(pair.0) + f64::from(pair.1), 17_777_217.0);

    // 10^8 adds of 0.1 in batches of 65,536, each batch summed as blending sums it.
    let batch = (0..65_536).fold(0.0f32, |sum, _| sum + 0.1);
    let (mut pair, mut naive, mut exact) = ((0.0f32, 0.0f32), 0.0f32, 0.0f64);
    for _ in 0..1_526 {
        pair = two_float_add(pair.0, pair.1, batch);
        naive += batch;
        exact += f64::from(batch);
    }
    let error = |x: f64| (x / exact - 1.0).abs();
    assert!(error(f64::from(pair.0) + f64::from(pair.1)) < 1e-12);
    assert!(error(f64::from(naive)) > 1e-6, "{}", error(f64::from(naive)));
}

/// Small parts survive beside a sum 10^7 times as large.
#[test]
fn mixture_of_sizes() {
    let (mut pair, mut naive) = ((1e7f32, 0.0f32), 1e7f32);
    for _ in 0..10_000 {
        pair = two_float_add(pair.0, pair.1, 0.4);
        naive += 0.4;
    }
    let exact = 1e7 + 10_000.0 * f64::from(0.4f32);
    assert!((f64::from(pair.0) + f64::from(pair.1) - exact).abs() < 1e-3);
    assert!((f64::from(naive) - exact).abs() > 1_000.0);
}
