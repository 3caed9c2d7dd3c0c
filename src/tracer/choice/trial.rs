//! A few thousand paths of one method: the variance of its samples, and what a path costs.

use crate::color::Xyz;
use crate::scene::desc::IntegratorKind;
use crate::stream::{PathCounts, SampleSink, UvWindow};
use crate::tracer::integrator::{Integrator, IntegratorVisitor, RenderContext, visit};

use super::cost::{Costs, MERGING};
use super::survey::SEED;

/// Work of one trial, in the units of [`Costs`].
const WORK: f64 = 250_000.0;

/// Factor on the paths of a second trial.
const LONGER: u64 = 4;

/// Mean number of camera paths from one place.
const FROM_ONE_PLACE: u64 = 4;

/// Binary logarithm of the most places along a side. A cheap method must not start from more places than the others: where a lamp is seen
/// in a mirror, their pictures have different means, as if one had missed light.
const PLACE_BITS: u32 = 5;

/// Bounds of the number of paths of one trial.
const PATHS: [f64; 2] = [(FROM_ONE_PLACE * CELLS as u64) as f64, 16_384.0];

/// The outcome of one method.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The method.
    pub kind: IntegratorKind,
    /// Paths that were traced: from the camera, or from lights if those are all.
    pub paths: u64,
    /// Cost of one path, in units of beginning one.
    pub cost: f64,
    pub(super) grid: MomentGrid,
    /// More paths of the method, if they were traced.
    longer: Option<MomentGrid>,
}

impl Trial {
    /// Traces paths of `kind`, as many as its share of the work allows.
    pub(super) fn of(context: &RenderContext, kind: IntegratorKind, costs: &Costs) -> Self {
        let cost = costs.of_kind(kind);
        // With merging and without it bidirectional tracing traces the same paths, so that their means differ by what is merged.
        let share = if kind.traits().extends.is_some() { MERGING } else { 1.0 };
        let paths = (WORK * share / cost).round().clamp(PATHS[0], PATHS[1]) as u64;
        let grid = trace(context, kind, paths, places_of(paths));
        Self { kind, paths, cost, grid, longer: None }
    }

    /// This trial with a second one of more paths from the same places, which tells more of rare bright paths.
    pub(super) fn lengthened(self, context: &RenderContext) -> Self {
        let longer = trace(context, self.kind, LONGER * self.paths, places_of(self.paths));
        Self { longer: Some(longer), ..self }
    }

    /// True if there was a second trial.
    pub(super) fn is_long(&self) -> bool {
        self.longer.is_some()
    }

    /// The variances of the method: of the longer trial, if there is one. Means are compared by first trials: with more paths, methods were
    /// charged for bright paths that another one had by chance (particle tracing of narrow lobes, whose means have heavy tails, too).
    pub(super) fn noise(&self) -> &MomentGrid {
        self.longer.as_ref().unwrap_or(&self.grid)
    }
}

/// Number of places along either side from which so many camera paths start.
fn places_of(paths: u64) -> u32 {
    1 << ((paths / FROM_ONE_PLACE).max(1).ilog2() / 2).min(PLACE_BITS)
}

/// Traces paths of a trial.
fn trace(context: &RenderContext, kind: IntegratorKind, paths: u64, places: u32) -> MomentGrid {
    // Lights that are seen directly have no noise in any method, but would be most of what few places see.
    let (seed, window, places) = (SEED, UvWindow::PICTURE, Some(places));
    let context = RenderContext { seed, window, hide_emitters: true, places, ..context.clone() };
    visit(kind, TracedPaths { context, paths })
}

/// Traces the paths of a trial.
struct TracedPaths {
    context: RenderContext,
    paths: u64,
}

impl IntegratorVisitor for TracedPaths {
    type Output = MomentGrid;

    fn visit<I: Integrator + From<RenderContext>>(self) -> MomentGrid {
        MomentGrid::trace(&I::from(self.context), self.paths)
    }
}

/// Cells along either side of the picture: camera paths start in each.
pub(super) const SIDE: usize = 16;

pub(super) const CELLS: usize = SIDE * SIDE;

/// Sums of luminance in one cell.
#[derive(Clone, Copy, Debug, Default)]
struct MomentCell {
    /// Number, sum and squares of camera samples.
    camera: [f64; 3],
    /// Pairs of camera samples from one place, and half the sum of their squared differences.
    pairs: [f64; 2],
    /// Sum and squares of light samples, which are densities over uv.
    light: [f64; 2],
}

/// Means and second moments of both streams on a coarse grid over the picture: the samples of a trial.
#[derive(Clone, Debug)]
pub(super) struct MomentGrid {
    cells: Vec<MomentCell>,
    /// Camera samples that are yet to be paired: place, cell and luminance.
    placed: Vec<([u32; 2], usize, f64)>,
    light_paths: f64,
    /// Camera paths per light path; 1 without camera paths.
    camera_paths: f64,
}

impl MomentGrid {
    /// Traces `paths` paths of `integrator`.
    pub(super) fn trace<I: Integrator>(integrator: &I, paths: u64) -> Self {
        let PathCounts { camera, light } = integrator.paths_per_index();
        let indices = paths.div_ceil(camera.max(light));
        let mut grid = Self {
            cells: vec![MomentCell::default(); CELLS],
            placed: Vec::new(),
            light_paths: (indices * light) as f64,
            camera_paths: if camera > 0 && light > 0 { camera as f64 / light as f64 } else { 1.0 },
        };
        let mut scratch = I::Scratch::default();
        (0..indices).for_each(|index| integrator.trace(index, &mut scratch, &mut grid));
        grid.pair();
        grid
    }

    /// Pairs samples from the same place: what differs from one side of a cell to the other is no noise.
    fn pair(&mut self) {
        let mut placed = std::mem::take(&mut self.placed);
        placed.sort_by_key(|p| p.0);
        for same in placed.chunk_by(|a, b| a.0 == b.0) {
            for pair in same.chunks_exact(2) {
                let sums = &mut self.cells[pair[0].1].pairs;
                sums[0] += 1.0;
                sums[1] += 0.5 * (pair[0].2 - pair[1].2).powi(2);
            }
        }
    }

    fn cell(uv: [f32; 2]) -> Option<usize> {
        let [x, y] = uv.map(|c| c * SIDE as f32);
        let side = SIDE as f32;
        // False for NaN.
        let inside = x >= 0.0 && y >= 0.0 && x < side && y < side;
        inside.then(|| y as usize * SIDE + x as usize)
    }

    /// Mean luminance of a cell.
    pub(super) fn mean(&self, cell: usize) -> f64 {
        let c = &self.cells[cell];
        let camera = if c.camera[0] > 0.0 { c.camera[1] / c.camera[0] } else { 0.0 };
        camera + self.per_light_path(c.light[0])
    }

    /// Variance of a pixel's luminance inside the cell, times the paths that were started per unit of picture (from
    /// the camera, where there are such): it does not depend on the resolution. Light paths hit a pixel so rarely that their
    /// variance is their second moment.
    pub(super) fn variance(&self, cell: usize) -> f64 {
        let c = &self.cells[cell];
        let camera = if c.pairs[0] > 0.0 { c.pairs[1] / c.pairs[0] } else { 0.0 };
        camera + self.camera_paths * self.per_light_path(c.light[1])
    }

    /// The same of a cell's luminance, which includes how it varies over the cell.
    pub(super) fn variance_of_mean(&self, cell: usize) -> f64 {
        let c = &self.cells[cell];
        let [n, sum, squares] = c.camera;
        let camera = if n > 1.0 { (squares - sum * sum / n).max(0.0) / (n - 1.0) } else { 0.0 };
        camera + self.camera_paths * self.per_light_path(c.light[1])
    }

    /// A density over uv, integrated over a cell and summed over light paths, as a mean.
    fn per_light_path(&self, sum: f64) -> f64 {
        if self.light_paths > 0.0 { sum * CELLS as f64 / self.light_paths } else { 0.0 }
    }
}

impl SampleSink for MomentGrid {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        let y = f64::from(value.y * weight);
        if let Some(cell) = Self::cell(uv).filter(|_| y.is_finite()) {
            let sums = &mut self.cells[cell].camera;
            *sums = [sums[0] + 1.0, sums[1] + y, sums[2] + y * y];
            self.placed.push((uv.map(f32::to_bits), cell, y));
        }
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        let y = f64::from(value.y);
        if let Some(cell) = Self::cell(uv).filter(|_| y.is_finite()) {
            let sums = &mut self.cells[cell].light;
            (sums[0], sums[1]) = (sums[0] + y, sums[1] + y * y);
        }
    }
}
