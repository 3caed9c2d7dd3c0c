//! Means and second moments of both streams on a coarse grid over the picture.

use crate::color::Xyz;
use crate::stream::{PathCounts, SampleSink};

/// Cells along either side of the picture.
pub(super) const SIDE: usize = 32;

/// Cells.
pub(super) const CELLS: usize = SIDE * SIDE;

/// Sums of luminance in one cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cell {
    /// Camera samples.
    count: f64,
    /// Of them.
    camera: [f64; 2],
    /// Of light samples, which are densities over uv.
    light: [f64; 2],
}

/// What a trial has found.
#[derive(Clone, Debug)]
pub(super) struct Grid {
    cells: Vec<Cell>,
    light_paths: f64,
    /// Camera paths to a light path; 1 without camera paths.
    camera_paths: f64,
}

impl Grid {
    pub(super) fn new() -> Self {
        Self { cells: vec![Cell::default(); CELLS], light_paths: 0.0, camera_paths: 1.0 }
    }

    /// So many indices were traced, of `counts` paths each.
    pub(super) fn count_light_paths(&mut self, indices: u64, counts: PathCounts) {
        self.light_paths += (indices * counts.light) as f64;
        if counts.camera > 0 && counts.light > 0 {
            self.camera_paths = counts.camera as f64 / counts.light as f64;
        }
    }

    fn cell(&mut self, uv: [f32; 2]) -> Option<&mut Cell> {
        let [x, y] = uv.map(|c| c * SIDE as f32);
        let side = SIDE as f32;
        // False for NaN.
        let inside = x >= 0.0 && y >= 0.0 && x < side && y < side;
        inside.then(|| &mut self.cells[y as usize * SIDE + x as usize])
    }

    /// Mean luminance of a cell.
    pub(super) fn mean(&self, cell: usize) -> f64 {
        let c = &self.cells[cell];
        let camera = if c.count > 0.0 { c.camera[0] / c.count } else { 0.0 };
        camera + self.per_light_path(c.light[0])
    }

    /// Variance of a pixel's luminance inside the cell, times the paths that were started per unit of picture (from
    /// the camera, where there are such): no resolution is left in it. A pixel is so small that a light path meets it rarely: its variance is its second
    /// moment.
    pub(super) fn variance(&self, cell: usize) -> f64 {
        let c = &self.cells[cell];
        let camera = if c.count > 1.0 {
            let mean = c.camera[0] / c.count;
            (c.camera[1] / c.count - mean * mean).max(0.0) * c.count / (c.count - 1.0)
        } else {
            0.0
        };
        camera + self.camera_paths * self.per_light_path(c.light[1])
    }

    /// A density over uv, integrated over a cell and summed over light paths, as a mean.
    fn per_light_path(&self, sum: f64) -> f64 {
        if self.light_paths > 0.0 { sum * CELLS as f64 / self.light_paths } else { 0.0 }
    }
}

impl SampleSink for Grid {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        let y = f64::from(value.y * weight);
        if let Some(cell) = self.cell(uv).filter(|_| y.is_finite()) {
            cell.count += 1.0;
            cell.camera[0] += y;
            cell.camera[1] += y * y;
        }
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        let y = f64::from(value.y);
        if let Some(cell) = self.cell(uv).filter(|_| y.is_finite()) {
            cell.light[0] += y;
            cell.light[1] += y * y;
        }
    }
}
