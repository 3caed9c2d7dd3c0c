//! OKLab: a colour space in which equal distances look about equally different.
//!
//! Björn Ottosson, *A perceptual color space for image processing* (2020), with the matrices for linear sRGB as he
//! revised them in January 2021.

use glam::{Mat3, Vec3};

/// Columns of linear sRGB to cone responses.
const LMS_FROM_RGB: Mat3 = Mat3::from_cols(
    Vec3::new(0.412_221_47, 0.211_903_5, 0.088_302_46),
    Vec3::new(0.536_332_54, 0.680_699_55, 0.281_718_84),
    Vec3::new(0.051_445_993, 0.107_396_96, 0.629_978_7),
);

/// Columns of cube roots of cone responses to L, a, b.
const LAB_FROM_ROOTS: Mat3 = Mat3::from_cols(
    Vec3::new(0.210_454_26, 1.977_998_5, 0.025_904_037),
    Vec3::new(0.793_617_8, -2.428_592_2, 0.782_771_77),
    Vec3::new(-0.004_072_047, 0.450_593_7, -0.808_675_77),
);

/// Lightness L and the opponents a (green to red) and b (blue to yellow) of linear sRGB.
///
/// White (1, 1, 1) is (1, 0, 0), black (0, 0, 0); the distance of the two, 1, is the largest in the gamut. Negative
/// channels are taken as they are, by the odd cube root.
pub fn from_linear_srgb(rgb: Vec3) -> Vec3 {
    let lms = LMS_FROM_RGB * rgb;
    LAB_FROM_ROOTS * Vec3::from(lms.to_array().map(f32::cbrt))
}

/// Linear sRGB of L, a, b, the inverse of [`from_linear_srgb`]; outside the gamut channels leave 0 … 1.
pub fn to_linear_srgb(lab: Vec3) -> Vec3 {
    let roots = LAB_FROM_ROOTS.inverse() * lab;
    LMS_FROM_RGB.inverse() * (roots * roots * roots)
}
