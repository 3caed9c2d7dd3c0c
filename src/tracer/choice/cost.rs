//! What a path of each method costs, in units of a vertex of a camera path: a ray to the next surface, a material, a way on.
//!
//! The constants are measured: microseconds per path of each method, one thread, against the lengths that the survey
//! finds. Only ratios matter.

use crate::scene::desc::IntegratorKind;
use crate::tracer::integrator::{CAMERA_SUBPATHS, LIGHT_SUBPATHS};

use super::survey::Survey;

/// Starting a walk: numbers, camera or light.
const START: f64 = 1.0;
/// A vertex of a camera path.
const VERTEX: f64 = 1.0;
/// A vertex that keeps its densities for the other end, or splats.
const VERTEX_OF_BOTH: f64 = 1.5;
/// A shadow ray, with what is evaluated at its ends.
const SHADOW: f64 = 1.0;
/// What a camera subpath spends on connections: about six shadow rays, and the look at all pairs.
const CONNECTIONS: f64 = 8.0;
/// What follows the split of a camera path: its branches, some of which roulette ends early.
const BRANCHES: f64 = 3.4;
/// A path that gathers photons, its share of light paths included, over a path.
const GATHERING: f64 = 2.0;

/// Mean cost of one path: of those from the camera, if there are any, with what belongs to each.
pub(super) fn of(kind: IntegratorKind, survey: &Survey) -> f64 {
    let (camera, light) = (&survey.camera, &survey.light);
    // The first surface, and all after it.
    let first = VERTEX * camera.vertices.min(1.0) + SHADOW * camera.open.min(1.0);
    let later = VERTEX * (camera.vertices - 1.0).max(0.0) + SHADOW * (camera.open - 1.0).max(0.0);
    let path = START + first + BRANCHES * later;
    let lit = START + VERTEX_OF_BOTH * light.vertices + SHADOW * light.open;
    match kind {
        IntegratorKind::Path | IntegratorKind::Auto => path,
        IntegratorKind::Light => lit,
        IntegratorKind::Bidirectional => {
            let share = LIGHT_SUBPATHS as f64 / CAMERA_SUBPATHS as f64;
            let both = camera.open.min(light.open).min(1.0);
            START + VERTEX_OF_BOTH * camera.vertices + SHADOW * camera.open + share * lit + CONNECTIONS * both
        }
        IntegratorKind::Photon => GATHERING * path,
    }
}
