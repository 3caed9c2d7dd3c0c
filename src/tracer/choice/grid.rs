//! Means and second moments of both streams on a coarse grid over the picture.

use crate::color::Xyz;
use crate::stream::{PathCounts, SampleSink};

/// Cells along either side of the picture: camera paths start in each.
pub(super) const SIDE: usize = 16;

/// Number of cells.
pub(super) const CELLS: usize = SIDE * SIDE;

/// Sums of luminance in one cell.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MomentCell {
    /// Number, sum and squares of camera samples.
    camera: [f64; 3],
    /// Pairs of camera samples from one place, and half the sum of their squared differences.
    pairs: [f64; 2],
    /// Sum and squares of light samples, which are densities over uv.
    light: [f64; 2],
}

/// A camera sample: its place, its cell and luminance.
type PlacedSample = ([u32; 2], usize, f64);

/// The samples of a trial.
#[derive(Clone, Debug)]
pub(super) struct MomentGrid {
    cells: Vec<MomentCell>,
    /// Camera samples that are yet to be paired.
    placed: Vec<PlacedSample>,
    light_paths: f64,
    /// Camera paths per light path; 1 without camera paths.
    camera_paths: f64,
}

impl MomentGrid {
    pub(super) fn new() -> Self {
        Self {
            cells: vec![MomentCell::default(); CELLS],
            placed: Vec::new(),
            light_paths: 0.0,
            camera_paths: 1.0,
        }
    }

    /// Ends the trial, after so many indices of `counts` paths each.
    pub(super) fn finish(&mut self, indices: u64, counts: PathCounts) {
        self.pair();
        self.light_paths += (indices * counts.light) as f64;
        if counts.camera > 0 && counts.light > 0 {
            self.camera_paths = counts.camera as f64 / counts.light as f64;
        }
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
