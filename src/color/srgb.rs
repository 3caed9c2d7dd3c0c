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
