//! Materials: every model over roughness, index and incidence, and the formulas that they share.

mod cases;
mod facets;
mod interfaces;
mod lobes;
mod matrix;
mod quadrature;
mod textbook;

use glam::Vec3;

pub use quadrature::lattice;

/// Angles of incidence in degrees.
const INCIDENCES: [f64; 7] = [0.0, 30.0, 60.0, 80.0, 89.0, 89.9, 89.9999];

/// A direction at this angle to the normal, away from both tangents, so that all coordinates are rounded.
pub fn direction(degrees: f64) -> Vec3 {
    let (sin, cos) = degrees.to_radians().sin_cos();
    Vec3::new((sin * 0.7f64.cos()) as f32, (sin * 0.7f64.sin()) as f32, cos as f32)
}
