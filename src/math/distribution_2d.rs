//! Discrete distributions in two dimensions: sampling a cell of a grid in proportion to weights.

use super::distribution::boundaries;

/// Number of values in [0, 1) of a random number of 24 bits.
const STEPS: u32 = 1 << 24;

/// A sample of a [`Distribution2d`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledCell {
    /// Column and row.
    pub cell: [usize; 2],
    /// Position in the cell, uniform in (0, 1)²: the part of the random numbers that the selection of the cell leaves.
    pub offset: [f32; 2],
    /// Its probability, exactly that with which it is sampled.
    pub probability: f32,
}

/// Cells of a grid with probabilities in proportion to weights. First a row is sampled, then a column of that row. A cell of
/// weight zero is never sampled, any other can be.
///
/// Random numbers are multiples of 2⁻²⁴, so rows, and columns of a row, get whole numbers of these steps, as in
/// [`Distribution`](super::distribution::Distribution). So the reported probability is the exact one, also for cells so dim that
/// a plain cumulative table would never sample them.
#[derive(Clone, Debug)]
pub struct Distribution2d {
    width: usize,
    /// Row `y` owns the steps from `rows[y]` up to `rows[y + 1]`, from 0 to 2²⁴.
    rows: Vec<u32>,
    /// `width + 1` such bounds for each row, all 0 for a row without weight.
    columns: Vec<u32>,
}

impl Distribution2d {
    /// A distribution in proportion to `weights`, `[height][width]`. `None` if there is no positive weight, if one is negative or
    /// not finite, if there are more than 2²⁴ columns or rows, or if `weights` is not a whole number of rows.
    pub fn new(width: usize, weights: &[f32]) -> Option<Self> {
        if width == 0 || !weights.len().is_multiple_of(width) {
            return None;
        }
        let height = weights.len() / width;
        let mut columns = Vec::with_capacity(height * (width + 1));
        let mut sums = Vec::with_capacity(height);
        let mut row = Vec::with_capacity(width);
        for weights in weights.chunks_exact(width) {
            row.clear();
            row.extend(weights.iter().map(|w| f64::from(*w)));
            if row.iter().all(|w| *w == 0.0) {
                columns.resize(columns.len() + width + 1, 0);
            } else {
                columns.extend(boundaries(&row, u64::from(STEPS))?.iter().map(|v| *v as u32));
            }
            sums.push(row.iter().sum());
        }
        let rows = boundaries(&sums, u64::from(STEPS))?.iter().map(|v| *v as u32).collect();
        Some(Self { width, rows, columns })
    }

    /// The probability of the cell in column `x` of row `y`, which must exist.
    #[inline]
    pub fn probability(&self, [x, y]: [usize; 2]) -> f32 {
        let share = |bounds: &[u32], i: usize| (bounds[i + 1] - bounds[i]) as f32 * (1.0 / STEPS as f32);
        share(&self.rows, y) * share(self.row(y), x)
    }

    /// Samples a cell: its row by `u[1]` and its column by `u[0]`, each in [0, 1).
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> SampledCell {
        let (y, offset_y) = locate(&self.rows, u[1]);
        let (x, offset_x) = locate(self.row(y), u[0]);
        SampledCell { cell: [x, y], offset: [offset_x, offset_y], probability: self.probability([x, y]) }
    }

    #[inline]
    fn row(&self, y: usize) -> &[u32] {
        &self.columns[y * (self.width + 1)..][..=self.width]
    }
}

/// The entry that owns `u`, and the position of `u` in it.
#[inline]
fn locate(bounds: &[u32], u: f32) -> (usize, f32) {
    // A cast from float saturates, and converts NaN to 0.
    let step = ((u * STEPS as f32) as u32).min(STEPS - 1);
    let index = bounds.partition_point(|first| *first <= step) - 1;
    let (first, end) = (bounds[index], bounds[index + 1]);
    // The middle of the step.
    let offset = ((step - first) as f32 + 0.5) / (end - first) as f32;
    (index, offset.min(1.0 - f32::EPSILON))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: u32) -> impl Iterator<Item = [f32; 2]> {
        (0..n * n).map(move |i| [((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32])
    }

    #[test]
    fn chooses_in_proportion_and_leaves_uniform_offsets() {
        let weights = [1.0, 0.0, 3.0, 0.0, 0.0, 0.0, 0.5, 2.5, 1.0];
        let d = Distribution2d::new(3, &weights).expect("positive weights");
        let (mut counts, mut offsets) = ([0u32; 9], [0.0f64; 2]);
        let n = 1000;
        for u in grid(n) {
            let c = d.sample(u);
            assert_eq!(c.probability, d.probability(c.cell));
            assert!(c.offset.iter().all(|v| (0.0..1.0).contains(v)), "{c:?}");
            counts[c.cell[1] * 3 + c.cell[0]] += 1;
            (0..2).for_each(|i| offsets[i] += f64::from(c.offset[i]) / f64::from(n * n));
        }
        for (i, w) in weights.iter().enumerate() {
            let (got, p) = (f64::from(counts[i]) / f64::from(n * n), f64::from(w / 8.0));
            assert!((got - p).abs() < 3e-3, "cell {i}: {got}, not {p}");
            assert!((f64::from(d.probability([i % 3, i / 3])) - p).abs() < 1e-6);
        }
        assert!(offsets.iter().all(|m| (m - 0.5).abs() < 1e-2), "{offsets:?}");
    }

    /// Beside a sun, what a table of sums in single precision would lose can still be chosen, as often as it says.
    #[test]
    fn the_dimmest_cell_can_be_chosen() {
        let mut weights = vec![1e-6; 64 * 32];
        weights[700] = 1e9;
        let d = Distribution2d::new(64, &weights).expect("positive weights");
        let sum: f64 = (0..2048).map(|i| f64::from(d.probability([i % 64, i / 64]))).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        for y in [0, 10, 31] {
            for x in [0, 63] {
                let owned = f64::from(d.probability([x, y]));
                let step = |bound: u32| bound as f32 / STEPS as f32;
                let found = d.sample([step(d.row(y)[x]), step(d.rows[y])]);
                assert!(owned > 0.0 && found.cell == [x, y], "{found:?} instead of {x}, {y}");
            }
        }
    }

    #[test]
    fn refuses_what_has_no_distribution() {
        for weights in [&[][..], &[0.0; 4], &[1.0, -1.0, 0.0, 0.0], &[f32::NAN; 2], &[1.0; 3]] {
            assert!(Distribution2d::new(2, weights).is_none(), "{weights:?}");
        }
        assert!(Distribution2d::new(0, &[]).is_none());
        let d = Distribution2d::new(1, &[1.0, 1.0]).expect("positive weights");
        assert_eq!([7.0, -1.0, f32::NAN, f32::INFINITY].map(|u| d.sample([u, u]).cell[1]), [1, 0, 0, 1]);
    }
}
