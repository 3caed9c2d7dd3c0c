//! Tests of `color::pq`.

use pointillist::color::pq::*;

#[test]
fn signals_are_the_published_ones() {
    // ITU-R BT.2408, table 1 and text: luminance in cd/m² and signal.
    for (luminance, signal) in
        [(0.0, 0.0), (1.0, 0.150), (100.0, 0.508), (203.0, 0.5807), (1000.0, 0.752), (10_000.0, 1.0)]
    {
        let got = encode(luminance / PQ_PEAK);
        assert!((got - signal).abs() < 6e-4, "{luminance} cd/m² became {got} instead of {signal}");
    }
}

#[test]
fn decoding_undoes_encoding() {
    for i in 0..=1000 {
        let signal = i as f32 / 1000.0;
        let back = encode(decode(signal));
        assert!((back - signal).abs() < 2e-5, "{signal} became {back}");
    }
    // Never out of range, whatever comes in.
    for bad in [f32::INFINITY, -1.0, 1e30, f32::MIN_POSITIVE / 8.0] {
        assert!((0.0..=1.0).contains(&encode(bad)), "{bad}");
    }
}
