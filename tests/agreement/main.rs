//! All rendering methods agree with each other, and with closed forms in white furnaces.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/mod.rs"]
mod support;

mod cameras;
mod furnace;
mod lights;
mod materials;
mod media;
mod meshes;
mod opacity;
mod pairs;
mod regions;
mod scenes;
mod specular;
mod stereo;

use support::welch;

/// The quantiles that every comparison of means rests on.
#[test]
fn known_quantiles_of_t() {
    // Tables of Student's distribution: two-sided 5 %, 1 % and 0.1 %.
    for (t, freedom, p) in
        [(2.228, 10.0, 0.05), (2.845, 20.0, 0.01), (3.646, 30.0, 0.001), (12.706, 1.0, 0.05)]
    {
        assert!(
            (welch::p_value(t, freedom) / p - 1.0).abs() < 2e-3,
            "{t} {freedom}: {}",
            welch::p_value(t, freedom)
        );
    }
    assert!((welch::p_value(0.0, 5.0) - 1.0).abs() < 1e-9);
}
