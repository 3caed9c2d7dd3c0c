//! A typed pixel grid.

/// Pixels `[height][width]` in rows from the top.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grid<T> {
    width: usize,
    height: usize,
    data: Vec<T>,
}

impl<T: Copy> Grid<T> {
    /// A grid of equal pixels; `None` if memory runs out.
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

    /// Mutable [`row`](Self::row).
    #[inline]
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        &mut self.data[y * self.width..][..self.width]
    }

    /// The pixel at column `x` of row `y`, both within the grid.
    #[inline]
    pub fn at(&self, x: usize, y: usize) -> T {
        self.row(y)[x]
    }

    /// Side of the squares that [`reduced`](Self::reduced) joins.
    pub fn step(&self, side: usize) -> usize {
        self.width.max(self.height).div_ceil(side.max(1)).max(1)
    }

    /// A smaller grid whose sides are at most `side`: `join` makes one pixel of each square of pixels. Squares at the right and lower
    /// border may be cut. A grid that fits has its pixels joined one by one.
    pub fn reduced(&self, side: usize, join: impl Fn(&[T]) -> T) -> Self {
        let step = self.step(side);
        let (width, height) = (self.width.div_ceil(step), self.height.div_ceil(step));
        let mut square = Vec::new();
        let mut data = Vec::with_capacity(width * height);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y * step, x * step))) {
            square.clear();
            for row in y..(y + step).min(self.height) {
                square.extend_from_slice(&self.row(row)[x..(x + step).min(self.width)]);
            }
            data.push(join(&square));
        }
        Self { width, height, data }
    }
}
