//! Tests of `color::srgb`.

use pointillist::color::srgb::*;

#[test]
fn every_signal_comes_back() {
    for i in 0..=255u8 {
        assert_eq!(encode_8bit(decode(f32::from(i) / 255.0)), i);
    }
    // Middle grey of 18 %.
    assert_eq!(encode_8bit(0.18), 118);
    assert_eq!([f32::NAN, f32::NEG_INFINITY, -1.0, 2.0, f32::INFINITY].map(encode_8bit), [0, 0, 0, 255, 255]);
}
