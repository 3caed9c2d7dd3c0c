//! What a path of each method costs, in units of a vertex of a camera path: a ray to the next surface, a material, a way on.
//!
//! The constants are measured: microseconds per path of each method on the nine scenes of `scenes/`, one thread, against the
//! lengths that the survey finds. The ratio of light and bidirectional to path tracing that follows from them is
//! within a factor of 0.75 to 1.35 of the measured one on seven of the scenes, and of 0.6 to 1.9 on all. Only ratios matter.

use crate::scene::desc::IntegratorKind;

use super::survey::Survey;

/// Starting a walk: numbers, camera or light.
const START: f64 = 1.0;
/// A vertex of a camera path.
const VERTEX: f64 = 1.0;
/// A vertex that keeps its densities for the other end, or splats.
const VERTEX_OF_BOTH: f64 = 1.5;
/// A shadow ray, with what is evaluated at its ends.
const SHADOW: f64 = 1.0;
/// A connection of two vertices: another shadow ray.
const CONNECTION: f64 = 1.0;

/// Mean cost of one index.
pub(super) fn of(kind: IntegratorKind, survey: &Survey) -> f64 {
    let (camera, light) = (&survey.camera, &survey.light);
    match kind {
        IntegratorKind::Path | IntegratorKind::Auto => {
            START + VERTEX * camera.vertices + SHADOW * camera.open
        }
        IntegratorKind::Light => START + VERTEX_OF_BOTH * light.vertices + SHADOW * light.open,
        IntegratorKind::Bidirectional => {
            2.0 * START
                + VERTEX_OF_BOTH * (camera.vertices + light.vertices)
                + SHADOW * (camera.open + light.open)
                + CONNECTION * camera.open * light.open
        }
    }
}
