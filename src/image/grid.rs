//! A typed pixel grid.

/// Pixels `[height][width]` in rows from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grid<T> {
    width: usize,
    height: usize,
    data: Vec<T>,
}

impl<T: Copy> Grid<T> {
    /// A grid of equal pixels, or `None` when the memory is not to be had.
    pub fn try_filled(width: usize, height: usize, value: T) -> Option<Self> {
        let len = width.checked_mul(height)?;
        let mut data = Vec::new();
        data.try_reserve_exact(len).ok()?;
        data.resize(len, value);
        Some(Self { width, height, data })
    }

    /// Wraps rows of pixels; `None` unless there are exactly `width · height` of them.
    pub fn from_rows(width: usize, height: usize, data: Vec<T>) -> Option<Self> {
        (width.checked_mul(height) == Some(data.len())).then_some(Self { width, height, data })
    }

    /// Width in pixels.
    pub const fn width(&self) -> usize {
        self.width
    }

    /// Height in pixels.
    pub const fn height(&self) -> usize {
        self.height
    }

    /// All pixels, row by row.
    pub fn pixels(&self) -> &[T] {
        &self.data
    }

    /// All pixels, row by row.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        &mut self.data
    }

    /// The pixels as a vector, row by row.
    pub fn into_pixels(self) -> Vec<T> {
        self.data
    }

    /// One row of pixels; `y` below [`height`](Self::height).
    #[inline]
    pub fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..][..self.width]
    }

    /// The pixel at column `x` of row `y`, both within the grid.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> T {
        self.row(y)[x]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_from_the_top() {
        let grid = Grid::from_rows(2, 3, vec![0, 1, 2, 3, 4, 5]).expect("6 pixels");
        assert_eq!(grid.row(1), [2, 3]);
        assert_eq!(grid.at(1, 2), 5);
        assert_eq!(Grid::from_rows(2, 2, vec![0; 3]), None);
        assert!(Grid::try_filled(usize::MAX, 2, 0u8).is_none());
        assert!(Grid::try_filled(1 << 30, 1 << 30, 0u8).is_none());
    }
}
