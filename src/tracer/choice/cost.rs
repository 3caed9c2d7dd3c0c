//! What a path of each method costs, in units of a camera vertex: a ray to the next surface, a material, a light sample.
//!
//! The constants are measured, not derived: see [`of`].

use crate::scene::desc::IntegratorKind;

use super::survey::Survey;

/// Starting a walk.
const START: f64 = 1.0;
/// A vertex: closest hit, material, next direction.
const VERTEX: f64 = 1.0;
/// A shadow ray with what is evaluated at its ends.
const SHADOW: f64 = 1.0;
/// What a walk that keeps its densities costs above one that does not, per vertex.
const DENSITIES: f64 = 0.5;
/// A connection of two vertices.
const CONNECTION: f64 = 1.0;

/// Mean cost of one index.
pub(super) fn of(kind: IntegratorKind, survey: &Survey) -> f64 {
    let (camera, light) = (&survey.camera, &survey.light);
    match kind {
        IntegratorKind::Path | IntegratorKind::Auto => {
            START + VERTEX * camera.vertices + SHADOW * camera.open
        }
        IntegratorKind::Light => START + VERTEX * light.vertices + SHADOW * light.open,
        IntegratorKind::Bidirectional => {
            2.0 * START
                + (VERTEX + DENSITIES) * (camera.vertices + light.vertices)
                + SHADOW * (camera.open + light.open)
                + CONNECTION * camera.open * light.open
        }
    }
}
