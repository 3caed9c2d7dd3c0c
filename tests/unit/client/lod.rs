//! Tests of `client::lod`.

use pointillist::client::lod::*;

#[test]
fn lod_counts_samples() {
    assert_eq!(StreamLod::new(1024, 0, 6), None);
    let one = StreamLod::new(1024, 1, 6).expect("has a sample");
    assert_eq!((one.raw, one.base, one.variance), (5.0, 5.0, 5.0));
    let many = StreamLod::new(1024, u64::MAX, 6).expect("has samples");
    assert_eq!((many.base, many.variance), (-1.0, 0.0));
    assert!(many.raw < -26.0 && many.raw.is_finite());
    assert_eq!(StreamLod::new(1, 1, 1).expect("has a sample").base, 0.0);
}

#[test]
fn masking_is_gated() {
    let lod = StreamLod::new(1024, 1024, 6).expect("has samples");
    assert_eq!(lod.masked(TARGET_RELATIVE_VARIANCE, 1.0), 0.0);
    assert!((lod.masked(TARGET_RELATIVE_VARIANCE * 16.0, 0.5) - 1.0).abs() < 1e-6);
    assert_eq!(lod.masked(f32::INFINITY, 1.0), lod.masked(1.0, 1.0));
    assert_eq!(lod.masked(f32::INFINITY, 2.0), 5.0);
    assert_eq!(lod.masked(f32::NAN, 1.0), 0.0);
    assert_eq!(lod.masked(f32::INFINITY, 0.0), 0.0);
    assert_eq!(lod.masked(0.0, 1.0), 0.0);
}

#[test]
fn one_sample_is_not_clean() {
    // The naive V/(n−1) is 0/0 here; the paper's V alone says "perfectly clean".
    let lod = StreamLod::new(1024, 1024, 6).expect("has samples");
    let one = LocalStatistics { luminance: 1.0, weight: 1.0, variance: 0.0, summed: false };
    let r = lod.relative_variance(&one, 1.0, 1.0);
    assert!(r > 50.0 * TARGET_RELATIVE_VARIANCE, "{r}");
    assert_eq!(lod.relative_variance(&LocalStatistics { luminance: 0.0, weight: 0.0, ..one }, 1.0, 1.0), 1.0);
    // Equal samples of known mean: a mean of many is exact, a sum of N of them is off by 1/√N.
    let many = LocalStatistics { luminance: 1e4, weight: 1e4, variance: 0.0, summed: false };
    assert!(lod.relative_variance(&many, 1.0, 1.0) < 1e-7);
    let r = lod.relative_variance(&LocalStatistics { summed: true, ..many }, 1.0, 1.0);
    assert!((r / 1e-4 - 1.0).abs() < 1e-3, "{r}");
}

#[test]
fn scale_is_the_power_below() {
    assert_eq!(power_of_two_below(1.0), 1.0);
    assert_eq!(power_of_two_below(0.75), 0.5);
    assert_eq!(power_of_two_below(7.9), 4.0);
    assert_eq!(power_of_two_below(1e-300), f32::MIN_POSITIVE);
    assert_eq!(power_of_two_below(f64::NAN), 1.0);
    assert_eq!(power_of_two_below(0.0), 1.0);
}
