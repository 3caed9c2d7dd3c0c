//! Tests of `color::cie`.

use glam::{DVec3, Vec4};
use pointillist::color::cie::*;

#[test]
fn curves_are_those_of_the_cie() {
    // CIE 15: ȳ(555) = 1.0000, x̄(600) = 1.0622, z̄(450) = 1.77211; D65(560)/D65(500) = 100/109.354.
    // ∫ȳ dλ in nm.
    let y = 106.856_426;
    assert!((Rows::get().at(555.0).y * y - 1.0).abs() < 1e-6);
    assert!((Rows::get().at(600.0).x * y - 1.0622).abs() < 1e-6);
    assert!((Rows::get().at(450.0).z * y - 1.77211).abs() < 1e-6);
    let ratio = Rows::get().at(560.0).w / Rows::get().at(500.0).w;
    assert!((ratio - 100.0 / 109.354).abs() < 1e-6);
}

#[test]
fn equal_energy_and_d65_have_their_whites() {
    let e = integrate(|_, _| 1.0);
    assert!((e.y - 1.0).abs() < 1e-6 && (e - DVec3::ONE).abs().max_element() < 2e-4, "{e}");
    let w = d65_white();
    assert!((w.y - 1.0).abs() < 1e-6);
    // CIE 15: x = 0.31272, y = 0.32903.
    assert!((w.x / w.element_sum() - 0.31272).abs() < 5e-5, "{w}");
    assert!((w.y / w.element_sum() - 0.32903).abs() < 5e-5, "{w}");
}

#[test]
fn nothing_is_seen_outside_the_tables() {
    for lambda in [f32::NEG_INFINITY, -1.0, 0.0, 360.0, 379.4, 780.6, 830.0, 1e9, f32::INFINITY, f32::NAN] {
        assert_eq!(Rows::get().at(lambda), Vec4::ZERO, "{lambda}");
    }
    assert_ne!(Rows::get().at(379.6).x, 0.0);
    assert_ne!(Rows::get().at(780.4).x, 0.0);
}
