//! A few thousand paths of one method: the variance of its samples, and what a path costs.

use crate::scene::desc::IntegratorKind;
use crate::stream::UvWindow;
use crate::tracer::integrator::{
    BidirectionalTracer, CAMERA_SUBPATHS, Integrator, LIGHT_SUBPATHS, ParticleTracer, PathTracer,
    PhotonTracer, RenderContext,
};

use super::grid::{CELLS, MomentGrid};
use super::survey::Survey;

/// The seed of trials: not that of any picture, and always the same.
pub(super) const SEED: u32 = 0x6175_746f;

/// Work of one trial, in the units of [`cost_of`].
const WORK: f64 = 200_000.0;

/// Mean number of camera paths from one place.
const FROM_ONE_PLACE: u64 = 4;

/// Bounds of the number of paths of one trial.
const PATHS: [f64; 2] = [(FROM_ONE_PLACE * CELLS as u64) as f64, 16_384.0];

// The cost of a path of each method, in units of a vertex of a camera path: a ray to the next surface, a material, a
// direction to go on. The constants are measured: microseconds per path of each method, one thread, against the lengths that
// the survey finds. Only ratios matter.

/// Cost of starting a walk: numbers, camera or light.
const START: f64 = 1.0;
/// Cost of a vertex of a camera path.
const VERTEX: f64 = 1.0;
/// Cost of a vertex that keeps its densities for MIS, or is connected to the camera.
const VERTEX_OF_BOTH: f64 = 1.5;
/// Cost of a shadow ray, with the scattering at its ends.
const SHADOW: f64 = 1.0;
/// Cost of the connections of a camera subpath: about six shadow rays, and the importance of all pairs.
const CONNECTIONS: f64 = 8.0;
/// Factor on the cost of what follows the split of a camera path: its branches, some of which roulette ends early.
const BRANCHES: f64 = 3.4;
/// Cost of a path that gathers photons, with its share of light paths, over that of a path.
const GATHERING: f64 = 2.0;

/// The outcome of one method.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The method.
    pub kind: IntegratorKind,
    /// Paths that were traced: from the camera, or from lights if those are all.
    pub paths: u64,
    /// Cost of one path, in units of a camera vertex.
    pub cost: f64,
    pub(super) grid: MomentGrid,
}

impl Trial {
    /// Traces paths of `kind`, as many as its share of the work allows.
    pub fn of(context: &RenderContext, survey: &Survey, kind: IntegratorKind) -> Self {
        let cost = cost_of(kind, survey);
        let paths = (WORK / cost).clamp(PATHS[0], PATHS[1]) as u64;
        // Lights that are seen directly have no noise in any method, but would be most of what few places see.
        let (seed, window) = (SEED, UvWindow::PICTURE);
        let places = 1 << ((paths / FROM_ONE_PLACE).max(1).ilog2() / 2);
        let context =
            RenderContext { seed, window, hide_emitters: true, places: Some(places), ..context.clone() };
        let grid = match kind {
            IntegratorKind::Path | IntegratorKind::Auto => run(&PathTracer { context }, paths),
            IntegratorKind::Light => run(&ParticleTracer { context }, paths),
            IntegratorKind::Bidirectional => run(&BidirectionalTracer { context }, paths),
            IntegratorKind::Photon => run(&PhotonTracer::new(context, true), paths),
        };
        Self { kind, paths, cost, grid }
    }
}

fn run<I: Integrator>(integrator: &I, paths: u64) -> MomentGrid {
    let counts = integrator.paths_per_index();
    let mut grid = MomentGrid::new();
    let mut scratch = I::Scratch::default();
    let indices = paths.div_ceil(counts.camera.max(counts.light));
    for index in 0..indices {
        integrator.trace(index, &mut scratch, &mut grid);
    }
    grid.finish(indices, counts);
    grid
}

/// Mean cost of one path: of those from the camera, if there are any, with its share of light paths.
fn cost_of(kind: IntegratorKind, survey: &Survey) -> f64 {
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
