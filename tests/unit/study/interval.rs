//! Tests of `study::interval`.

use pointillist::study::interval::*;

#[test]
fn quantiles_are_those_of_the_tables() {
    for (n, t) in
        [(1.0, 6.314), (2.0, 2.920), (3.0, 2.353), (5.0, 2.015), (10.0, 1.812), (30.0, 1.697), (1e6, 1.645)]
    {
        assert!((student_95(n) / t - 1.0).abs() < 0.01, "{n}: {}", student_95(n));
    }
}

#[test]
fn medians_do_not_care_for_one_wild_figure() {
    let figures: Vec<f64> = (0..16).map(|i| if i == 3 { 1e9 } else { f64::from(i) }).collect();
    let median = Interval::of_median(&figures).unwrap_or_default();
    assert!((7.0..=9.0).contains(&median.value) && median.low >= 4.0 && median.high <= 13.0, "{median:?}");
    assert_eq!(Interval::of_median(&[]), None);
    assert_eq!(Interval::of_median(&[2.0, 1.0]), Some(Interval { value: 2.0, low: 1.0, high: 2.0 }));
}

#[test]
fn means_and_maps() {
    assert_eq!(Interval::of_mean(&[]), None);
    assert_eq!(Interval::of_mean(&[3.0]), Some(Interval::exact(3.0)));
    let mean = Interval::of_mean(&[1.0, 2.0, 3.0]).unwrap_or_default();
    assert!((mean.high - (2.0 + 2.92 / 3f64.sqrt())).abs() < 1e-3 && mean.value == 2.0);
    let inverse = Interval { value: 2.0, low: 1.0, high: 4.0 }.map(|x| 1.0 / x);
    assert_eq!(inverse, Interval { value: 0.5, low: 0.25, high: 1.0 });
    assert!(inverse.holds(0.25) && !inverse.holds(1.1));
}

#[test]
fn quantiles_of_student_are_those_of_the_tables() {
    for (tail, n, value) in [
        (0.05, 1.0, 6.3138),
        (0.05, 4.0, 2.1318),
        (0.001, 5.0, 5.8934),
        (0.0005, 10.0, 4.5869),
        (0.05, 1e9, 1.6487),
    ] {
        let found = student(tail, n);
        assert!((found / value - 1.0).abs() < 1e-3, "{tail} {n}: {found}");
    }
    for n in [3.0, 7.0, 20.0] {
        assert!((student(0.05, n) / student_95(n) - 1.0).abs() < 0.01);
    }
}
