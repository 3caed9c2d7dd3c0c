//! Sums over rectangles of a grid in constant time.

use std::ops::AddAssign;

/// Sums over rectangles of tiles, by a summed-area table (Crow 1984).
pub(super) struct SummedAreas<T> {
    columns: usize,
    sums: Vec<T>,
}

impl<T: Copy + Default + AddAssign + Subtract> SummedAreas<T> {
    /// Builds the table of a grid.
    pub(super) fn new(tiles: &[T], [columns, rows]: [usize; 2]) -> Self {
        let mut sums = vec![T::default(); (columns + 1) * (rows + 1)];
        for y in 0..rows {
            let mut row = T::default();
            for x in 0..columns {
                row += tiles[y * columns + x];
                let mut sum = sums[y * (columns + 1) + x + 1];
                sum += row;
                sums[(y + 1) * (columns + 1) + x + 1] = sum;
            }
        }
        Self { columns: columns + 1, sums }
    }

    /// Sum over columns and rows from `from` up to `to`, exclusive.
    pub(super) fn sum(&self, from: [usize; 2], to: [usize; 2]) -> T {
        let at = |x: usize, y: usize| self.sums[y * self.columns + x];
        let mut sum = at(to[0], to[1]).minus(at(from[0], to[1])).minus(at(to[0], from[1]));
        sum += at(from[0], from[1]);
        sum
    }
}

/// The difference of sums.
pub(super) trait Subtract {
    fn minus(self, other: Self) -> Self;
}

/// Range of the tiles within `reach` of tile `i` of a grid: first column and row, and one past the last.
pub(super) fn tiles_around(i: usize, [columns, rows]: [usize; 2], reach: usize) -> ([usize; 2], [usize; 2]) {
    let (x, y) = (i % columns, i / columns);
    let from = [x.saturating_sub(reach), y.saturating_sub(reach)];
    (from, [(x + reach + 1).min(columns), (y + reach + 1).min(rows)])
}
