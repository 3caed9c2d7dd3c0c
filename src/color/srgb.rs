//! The transfer of sRGB (IEC 61966-2-1).

/// The signal of a linear value, both in [0, 1].
pub fn encode(v: f32) -> f32 {
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}

/// The linear value of a signal, both in [0, 1].
pub fn decode(v: f32) -> f32 {
    if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

/// The signal in 8 bits of any linear value: what is outside [0, 1] is clamped, NaN is 0.
pub fn encode_8bit(v: f32) -> u8 {
    // The cast takes NaN to 0.
    (encode(v.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_signal_comes_back() {
        for i in 0..=255u8 {
            assert_eq!(encode_8bit(decode(f32::from(i) / 255.0)), i);
        }
        // Middle grey of 18 %.
        assert_eq!(encode_8bit(0.18), 118);
        assert_eq!(
            [f32::NAN, f32::NEG_INFINITY, -1.0, 2.0, f32::INFINITY].map(encode_8bit),
            [0, 0, 0, 255, 255]
        );
    }
}
