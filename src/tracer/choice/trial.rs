//! A few thousand paths of one method, to see how its samples scatter.

use crate::scene::desc::IntegratorKind;
use crate::stream::UvWindow;
use crate::tracer::integrator::{
    BidirectionalTracer, Integrator, ParticleTracer, PathTracer, PhotonTracer, RenderContext,
};

use super::cost;
use super::grid::{CELLS, Grid};
use super::survey::Survey;

/// The numbers of trials: not those of any picture, and always the same.
pub(super) const SEED: u32 = 0x6175_746f;

/// Work of one trial, in the units of [`cost::of`].
const WORK: f64 = 200_000.0;

/// Camera paths from one place, about.
const FROM_ONE_PLACE: u64 = 4;

/// Bounds of the number of paths of one trial.
const PATHS: [f64; 2] = [(FROM_ONE_PLACE * CELLS as u64) as f64, 16_384.0];

/// What one method did.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The method.
    pub kind: IntegratorKind,
    /// Paths that were traced: from the camera, or from lights if those are all.
    pub paths: u64,
    /// Cost of one path, in units of a camera vertex.
    pub cost: f64,
    pub(super) grid: Grid,
}

impl Trial {
    /// Traces paths of `kind`, as many as its share of the work allows.
    pub fn of(context: &RenderContext, survey: &Survey, kind: IntegratorKind) -> Self {
        let cost = cost::of(kind, survey);
        let paths = (WORK / cost).clamp(PATHS[0], PATHS[1]) as u64;
        // Lights that are seen straight on are not noise, whatever the method, but would be most of what few places see.
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

fn run<I: Integrator>(integrator: &I, paths: u64) -> Grid {
    let counts = integrator.paths_per_index();
    let mut grid = Grid::new();
    let mut scratch = I::Scratch::default();
    let indices = paths.div_ceil(counts.camera.max(counts.light));
    for index in 0..indices {
        integrator.trace(index, &mut scratch, &mut grid);
    }
    grid.finish(indices, counts);
    grid
}
