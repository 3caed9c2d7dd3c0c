//! The PQ transfer of HDR displays (SMPTE ST 2084, ITU-R BT.2100), and the luminances that pictures are put at.

/// Luminance of diffuse white, cd/m² (ITU-R BT.2408).
pub const DIFFUSE_WHITE: f32 = 203.0;

/// The usual peak that highlights roll off to on an HDR display, cd/m²: what HDR10 is most often mastered for.
pub const PEAK: u32 = 1000;

/// Luminance that 1.0 stands for in scRGB, cd/m².
pub const SCRGB_WHITE: f32 = 80.0;

/// Luminance that PQ 1.0 stands for, cd/m².
pub const PQ_PEAK: f32 = 10_000.0;

const M1: f32 = 2610.0 / 16384.0;
const M2: f32 = 2523.0 / 32.0;
const C1: f32 = 3424.0 / 4096.0;
const C2: f32 = 2413.0 / 128.0;
const C3: f32 = 2392.0 / 128.0;

/// PQ signal in 0 … 1 of a luminance as a part of [`PQ_PEAK`], clamped to 0 … 1.
#[inline]
pub fn encode(luminance: f32) -> f32 {
    let p = luminance.clamp(0.0, 1.0).powf(M1);
    ((C1 + C2 * p) / (1.0 + C3 * p)).powf(M2)
}

/// Luminance as a part of [`PQ_PEAK`] of a PQ signal, clamped to 0 … 1.
#[inline]
pub fn decode(signal: f32) -> f32 {
    let p = signal.clamp(0.0, 1.0).powf(1.0 / M2);
    ((p - C1).max(0.0) / (C2 - C3 * p)).powf(1.0 / M1)
}
