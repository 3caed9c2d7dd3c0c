//! Tests of `math::pdf`.

use pointillist::math::pdf::*;

#[test]
fn area_and_solid_angle_agree_on_a_small_patch() {
    // A patch of area 1e-6 at distance 2, inclined by 60°, covers 1e-6 · 0.5 / 4 sr.
    let w = PdfA(1e6).to_solid_angle(4.0, -0.5);
    assert!((w.0 * 1e-6 * 0.5 / 4.0 - 1.0).abs() < 1e-6);
    assert_eq!(PdfA(1.0).to_solid_angle(1.0, 0.0), PdfW::ZERO);
}
