//! Tests of `study::format`.

use pointillist::study::curve::Checkpoint;
use pointillist::study::error::ErrorEstimate;
use pointillist::study::format::*;
use pointillist::study::prediction::Prediction;
use pointillist::study::{ErrorQuantile, ErrorStatus, Interval};

#[test]
fn a_terminal_gets_sentences_with_ordinary_spaces() {
    assert_eq!([0.0098, 0.123, 1.5, 0.0004].map(percent), ["0.98 %", "12.3 %", "150 %", "0.040 %"]);
    assert_eq!([0.01, 0.005, 0.0001, 0.2].map(round_percent), ["1 %", "0.5 %", "0.01 %", "20 %"]);
    assert_eq!([2.04, 42.0, 600.0, 1e4, 1e6].map(duration), ["2.0 s", "42 s", "10 min", "2.8 h", "12 days"]);
    let mut status = ErrorStatus::default();
    assert_eq!(status.sentence(ErrorQuantile::P95), "error not known yet");
    status.checkpoints.push(Checkpoint { seconds: 10.0, samples: 1.0, error: 0.0231, deviation: 0.1 });
    status.estimate = ErrorEstimate { relative: [Interval::exact(0.0231); 3], ..ErrorEstimate::default() };
    assert_eq!(status.sentence(ErrorQuantile::P95), "error 2.31 %");
    for (high, interval) in [(65.0, "36–55 s"), (650.0, "36 s–11 min")] {
        let seconds = Interval { value: 52.0, low: 46.0, high };
        status.prediction = Some(Prediction { at: 10.0, error: 0.0231, target: 0.01, seconds });
        let expected = format!("error 2.31 %, 1 % in about 42 s (90 %: {interval})");
        assert_eq!(status.sentence(ErrorQuantile::P95), expected);
    }
}

fn i(value: f64, low: f64, high: f64) -> Interval {
    Interval { value, low, high }
}

fn plainly(number: &FormattedInterval) -> String {
    with_plain_spaces(&number.to_string())
}

#[test]
fn numbers_have_the_digits_that_their_intervals_support() {
    assert_eq!(plainly(&seconds(&i(42.3, 36.1, 55.2))), "42 s (36–55)");
    assert_eq!(plainly(&seconds(&i(0.0421, 0.0412, 0.0431))), "42.1 ms (41.2–43.1)");
    assert_eq!(plainly(&seconds(&i(754.0, 600.0, 900.0))), "13 min (10–15)");
    assert_eq!(plainly(&factor(&i(1.0021, 0.9971, 1.0081))), "× 1.002 (0.997–1.008)");
    assert_eq!(plainly(&percent_interval(&i(0.0123, 0.0123, 0.0123))), "1.23 %");
    assert_eq!(plainly(&with_unit(&i(1.21e-5, 1.0e-5, 1.5e-5), 1.0, "")), "1.2·10⁻⁵ ((1.0–1.5)·10⁻⁵)");
    assert_eq!(plainly(&with_unit(&i(-0.5, -0.52, -0.48), 1.0, "")), "−0.500 (−0.520 to −0.480)");
    assert_eq!(plainly(&increase(&i(1.23, 1.21, 1.25))), "+23 % (+21 to +25)");
    assert_eq!(plainly(&increase(&i(1.001, 0.997, 1.005))), "+0.1 % (−0.3 to +0.5)");
}

#[test]
fn missing_numbers_are_dashes() {
    for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert_eq!(seconds(&Interval::exact(x)), FormattedInterval::none());
        assert_eq!(increase(&Interval::exact(x)), FormattedInterval::none());
        assert_eq!(percent_of(x), "—");
    }
    assert_eq!(plainly(&seconds(&i(2.0, 1.0, f64::INFINITY))), "2.0 s (1.0–∞)");
    assert_eq!(seconds(&Interval::exact(0.0)).main.replace(THIN, " "), "0 s");
    for x in [1e300, -1e300, 1e-300, -1e-300, 5e-324, 9.999_999, 999_999.5] {
        assert!(!with_unit(&i(x, x / 2.0, x * 2.0), 1.0, "").main.is_empty() && !count(x).is_empty());
    }
    assert_eq!(count(12345.0).replace(THIN, " "), "12 345");
    assert_eq!(count(1_234_567.0).replace(THIN, " "), "1.2 M");
}
