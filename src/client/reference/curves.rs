//! Tone curves in linear Rec.709 RGB: the reference of `glsl/include/curves.glsl`.

use glam::{Mat3, Vec3};

/// Largest luminance that a curve is given: all are flat long before.
pub const MAX_TONE_INPUT: f32 = 1e6;

/// Khronos PBR Neutral (specification 2024) with its ceiling of 1 moved to `ceiling`.
///
/// A toe takes off the 4 % that every surface reflects, compression starts at 0.76 of the ceiling, and colours move to white
/// by 0.15 per unit lost. `c` must not be negative.
pub fn pbr_neutral(c: Vec3, ceiling: f32) -> Vec3 {
    let least = c.min_element();
    let c = c - if least < 0.08 { least * (1.0 - 6.25 * least) } else { 0.04 };
    let (peak, start) = (c.max_element(), 0.76 * ceiling);
    if peak <= start {
        return c;
    }
    let room = ceiling - start;
    let top = ceiling - room * room / (peak + room - start);
    let keep = 1.0 / (0.15 * (peak - top) + 1.0);
    Vec3::splat(top) + (c * (top / peak) - top) * keep
}

/// Columns of AgX's inset: primaries drawn towards grey. This and the next two: Wrensch, "Minimal AgX Implementation" (2023).
const AGX_INSET: Mat3 = Mat3::from_cols_array(&[
    0.842_479_05,
    0.042_328_224,
    0.042_375_654,
    0.078_433_6,
    0.878_468_64,
    0.078_433_6,
    0.079_223_745,
    0.079_166_13,
    0.879_142_97,
]);

/// Its inverse.
const AGX_OUTSET: Mat3 = Mat3::from_cols_array(&[
    1.196_879,
    -0.052_896_85,
    -0.052_971_635,
    -0.098_020_88,
    1.151_903_1,
    -0.098_043_45,
    -0.099_029_74,
    -0.098_961_18,
    1.151_073_7,
]);

/// The sigmoid as a polynomial of the encoded value, from the sixth power down.
const AGX_SIGMOID: [f32; 7] = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232];

/// Logarithms to base 2 of the least and the greatest value that AgX tells apart.
const AGX_RANGE: [f32; 2] = [-12.47393, 4.026069];

/// AgX (Sobotka 2022): inset, log2 encoding, a sigmoid, outset, display gamma 2.2 undone. `c` must not be negative; the result is
/// display-linear in 0 … 1.
pub fn agx(c: Vec3) -> Vec3 {
    let [low, high] = AGX_RANGE;
    let inset = (AGX_INSET * c).max(Vec3::splat(1e-10));
    let s = inset.to_array().map(|v| {
        let x = ((v.log2() - low) / (high - low)).clamp(0.0, 1.0);
        AGX_SIGMOID.into_iter().fold(0.0, |sum, factor| sum * x + factor)
    });
    (AGX_OUTSET * Vec3::from(s)).clamp(Vec3::ZERO, Vec3::ONE).powf(2.2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neutral_is_as_specified() {
        // Below the compression a grey loses 4 %, in the toe it is 6.25 x².
        assert!((pbr_neutral(Vec3::splat(0.5), 1.0) - 0.46).abs().max_element() < 1e-6);
        assert!((pbr_neutral(Vec3::splat(0.04), 1.0) - 0.01).abs().max_element() < 1e-6);
        // The curve is smooth where compression starts, never reaches 1 and never decreases.
        let mut last = 0.0;
        for i in 0..400 {
            let v = pbr_neutral(Vec3::splat(1e-3 * 1.05f32.powi(i)), 1.0).x;
            assert!(v >= last && v <= 1.0, "{v} after {last}");
            last = v;
        }
        // A base colour below the threshold keeps its differences exactly: the curve's purpose.
        let c = pbr_neutral(Vec3::new(0.6, 0.3, 0.1), 1.0);
        assert!((c - Vec3::new(0.56, 0.26, 0.06)).abs().max_element() < 1e-6, "{c}");
        // Very bright red turns white.
        assert!(pbr_neutral(Vec3::new(1e4, 0.0, 0.0), 1.0).min_element() > 0.95);
    }

    #[test]
    fn agx_maps_grey_to_grey() {
        // The sigmoid's pivot: middle grey becomes the signal 0.5; greys stay grey within the figures' precision.
        let grey = agx(Vec3::splat(0.18));
        assert!((grey.y.powf(1.0 / 2.2) - 0.5).abs() < 0.01, "{grey}");
        assert!((grey.max_element() - grey.min_element()) < 1e-3, "{grey}");
        let mut last = 0.0;
        for i in 0..400 {
            let v = agx(Vec3::splat(1e-5 * 1.04f32.powi(i))).y;
            assert!(v >= last - 1e-5 && v <= 1.0, "{v} after {last}");
            last = v;
        }
        assert!(last > 0.98);
    }

    #[test]
    fn matrices_undo_each_other() {
        assert!((AGX_INSET * AGX_OUTSET).abs_diff_eq(Mat3::IDENTITY, 1e-5));
    }
}
