//! Approximation of the film's filter on per-pixel sums.

use std::ops::Range;

/// A symmetric kernel of five weights with sum 1, applied along columns and rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothingKernel {
    weights: [f32; 3],
}

impl SmoothingKernel {
    /// Fraction of a pixel's variance that remains: the sum of squared weights, over both axes.
    pub fn energy(&self) -> f64 {
        let [c, a, b] = self.weights.map(f64::from);
        (c * c + 2.0 * (a * a + b * b)).powi(2)
    }

    /// The Gaussian kernel whose squared weights sum to the root of `energy`, the fraction of a pixel's variance that a splat filter leaves
    /// over both axes. It is narrower than the filter, because sub-pixel positions are lost already.
    pub fn of_energy(energy: f32) -> Self {
        let wanted = f64::from(energy).clamp(0.05, 1.0).sqrt();
        let row = |width: f64| {
            let [a, b] = [(-1.0 / width).exp(), (-4.0 / width).exp()];
            [1.0, a, b].map(|w| w / (1.0 + 2.0 * (a + b)))
        };
        let squares = |[c, a, b]: [f64; 3]| c * c + 2.0 * (a * a + b * b);
        // `width` is twice the variance; the squares fall with it.
        let (mut low, mut high) = (1e-3f64, 1e3f64);
        for _ in 0..60 {
            let middle = f64::sqrt(low * high);
            if squares(row(middle)) > wanted { low = middle } else { high = middle }
        }
        let weights = if wanted >= 1.0 { [1.0, 0.0, 0.0] } else { row(low) };
        Self { weights: weights.map(|w| w as f32) }
    }

    /// Rows needed to filter `rows` of a picture of this height.
    pub fn near(rows: &Range<usize>, height: usize) -> Range<usize> {
        rows.start.saturating_sub(2)..(rows.end + 2).min(height)
    }

    /// As [`apply`](Self::apply), these rows only.
    pub fn rows(&self, sums: &[[f32; 4]], [width, height]: [usize; 2], rows: Range<usize>) -> Vec<[f32; 4]> {
        let near = Self::near(&rows, height);
        let mut filtered = self.apply(&sums[near.start * width..near.end * width], [width, near.len()]);
        filtered.truncate((rows.end - near.start) * width);
        filtered.split_off((rows.start - near.start) * width)
    }

    /// Filters `sums` of `width × height` pixels; pixels beyond the border count as 0.
    pub fn apply(&self, sums: &[[f32; 4]], [width, height]: [usize; 2]) -> Vec<[f32; 4]> {
        if self.weights[0] == 1.0 || sums.is_empty() {
            return sums.to_vec();
        }
        let mut columns = Vec::with_capacity(sums.len());
        // Two zero pixels of padding before and after each row.
        let mut padded = vec![[0.0; 4]; width + 4];
        for row in sums.chunks_exact(width) {
            padded[2..][..width].copy_from_slice(row);
            columns.extend(padded.array_windows().map(|five: &[_; 5]| self.mean(five.each_ref())));
        }
        let nothing = vec![[0.0; 4]; width];
        let row = |y: usize, up: usize| match (y + up).checked_sub(2) {
            Some(y) if y < height => &columns[y * width..][..width],
            _ => &nothing,
        };
        let mut filtered = Vec::with_capacity(sums.len());
        for y in 0..height {
            let five: [&[[f32; 4]]; 5] = std::array::from_fn(|up| row(y, up));
            filtered.extend((0..width).map(|x| self.mean(five.map(|row| &row[x]))));
        }
        filtered
    }

    /// Sum of the weights within a row of `len` pixels around pixel `at`.
    pub fn share(&self, at: usize, len: usize) -> f32 {
        let [c, a, b] = self.weights;
        let weight = |distance: usize, weight: f32| {
            let sides = usize::from(at >= distance) + usize::from(at + distance < len);
            sides as f32 * weight
        };
        c + weight(1, a) + weight(2, b)
    }

    /// The weighted mean of five pixels.
    fn mean(&self, five: [&[f32; 4]; 5]) -> [f32; 4] {
        let [c, a, b] = self.weights;
        std::array::from_fn(|i| {
            c * five[2][i] + a * (five[1][i] + five[3][i]) + b * (five[0][i] + five[4][i])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_row_has_the_energy_that_was_asked_for() {
        for energy in [0.1386, 0.4444, 0.9, 1.0] {
            let SmoothingKernel { weights: [c, a, b] } = SmoothingKernel::of_energy(energy);
            assert!((c + 2.0 * (a + b) - 1.0).abs() < 1e-5);
            let squares = c * c + 2.0 * (a * a + b * b);
            assert!((squares * squares / energy - 1.0).abs() < 1e-3, "{energy}: {squares}");
        }
    }

    #[test]
    fn rows_are_those_of_the_whole() {
        let kernel = SmoothingKernel::of_energy(0.4);
        let sums: Vec<[f32; 4]> = (0..6 * 9).map(|i| [((i * 37) % 17) as f32; 4]).collect();
        let whole = kernel.apply(&sums, [6, 9]);
        for rows in [0..9, 0..1, 3..5, 8..9, 1..8] {
            assert_eq!(kernel.rows(&sums, [6, 9], rows.clone()), whole[rows.start * 6..rows.end * 6]);
        }
    }

    #[test]
    fn a_point_spreads_over_both_axes_and_not_beyond_the_border() {
        let kernel = SmoothingKernel::of_energy(0.4);
        let mut sums = vec![[0.0; 4]; 7 * 6];
        sums[3 * 7 + 3] = [1.0; 4];
        let spread = kernel.apply(&sums, [7, 6]);
        let [c, a, b] = kernel.weights;
        assert!((spread[3 * 7 + 3][0] - c * c).abs() < 1e-6 && (spread[3 * 7 + 4][0] - c * a).abs() < 1e-6);
        assert!((spread[5 * 7 + 1][0] - b * b).abs() < 1e-6);
        let total: f32 = spread.iter().map(|p| p[0]).sum();
        assert!((total - 1.0).abs() < 1e-5);
        let ones = kernel.apply(&vec![[1.0; 4]; 7 * 6], [7, 6]);
        for (i, one) in ones.iter().enumerate() {
            assert!((one[0] - kernel.share(i % 7, 7) * kernel.share(i / 7, 6)).abs() < 1e-6);
        }
        let mut corner = vec![[0.0; 4]; 4];
        corner[0] = [1.0; 4];
        assert!(kernel.apply(&corner, [2, 2]).iter().map(|p| p[0]).sum::<f32>() < 1.0);
    }
}
