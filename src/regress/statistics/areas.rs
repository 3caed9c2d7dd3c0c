//! Averages over areas of 8×8 pixels.

use crate::image::Grid;

/// Side of an area in pixels.
pub const AREA: usize = 8;

/// The areas of a picture, row by row; those at the right and lower border may be smaller.
#[derive(Clone, Copy, Debug)]
pub struct AreaLayout {
    size: [usize; 2],
    columns: usize,
}

impl AreaLayout {
    /// Of a picture of this width and height in pixels.
    pub fn new(width: usize, height: usize) -> Self {
        Self { size: [width, height], columns: width.div_ceil(AREA) }
    }

    /// Number of areas.
    pub fn count(&self) -> usize {
        self.columns * self.size[1].div_ceil(AREA)
    }

    /// The area of pixel `i` in row order.
    fn area(&self, i: usize) -> usize {
        i / self.size[0] / AREA * self.columns + i % self.size[0] / AREA
    }

    /// A pixel in the middle of an area: column and row.
    pub fn centre(&self, area: usize) -> [usize; 2] {
        let corner = [area % self.columns.max(1) * AREA, area / self.columns.max(1) * AREA];
        std::array::from_fn(|k| (corner[k] + AREA / 2).min(self.size[k].saturating_sub(1)))
    }

    /// Number of pixels of each area for which `used` holds.
    pub fn sizes(&self, used: &[bool]) -> Vec<f64> {
        let mut sizes = vec![0.0; self.count()];
        for (i, _) in used.iter().enumerate().filter(|(_, used)| **used) {
            sizes[self.area(i)] += 1.0;
        }
        sizes
    }

    /// Sum of each channel over the pixels of each area for which `used` holds.
    pub fn sums(&self, pixels: &Grid<[f32; 3]>, used: &[bool]) -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; 3]; self.count()];
        for (i, (pixel, _)) in pixels.pixels().iter().zip(used).enumerate().filter(|(_, (_, used))| **used) {
            let sum = &mut sums[self.area(i)];
            for (sum, &value) in sum.iter_mut().zip(pixel) {
                *sum += f64::from(value);
            }
        }
        sums
    }

    /// Mean of each channel over the pixels of each area for which `used` holds; 0 for an area without such pixels.
    pub fn means(&self, pixels: &Grid<[f32; 3]>, used: &[bool]) -> Vec<[f64; 3]> {
        let sizes = self.sizes(used).into_iter();
        self.sums(pixels, used).into_iter().zip(sizes).map(|(sum, n)| sum.map(|s| s / n.max(1.0))).collect()
    }
}

/// Mean, and variance of single values: 0 for fewer than two.
pub fn mean_and_variance(values: impl ExactSizeIterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.clone().sum::<f64>() / n.max(1.0);
    let squares: f64 = values.map(|v| (v - mean) * (v - mean)).sum();
    (mean, squares / (n - 1.0).max(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn areas_at_the_border_are_smaller_and_pixels_can_be_left_out() {
        let layout = AreaLayout::new(17, 9);
        let mut pixels = Grid::try_filled(17, 9, [1.0; 3]).expect("memory");
        pixels.pixels_mut()[16] = [f32::NAN; 3];
        pixels.pixels_mut()[8] = [65.0, 1.0, 1.0];
        let used: Vec<bool> = pixels.pixels().iter().map(|p| p[0].is_finite()).collect();
        assert_eq!(layout.count(), 6);
        assert_eq!(layout.sizes(&used), [64.0, 64.0, 7.0, 8.0, 8.0, 1.0]);
        let means = layout.means(&pixels, &used);
        assert_eq!(means[1], [2.0, 1.0, 1.0]);
        assert!(means.iter().enumerate().all(|(i, mean)| i == 1 || *mean == [1.0; 3]), "{means:?}");
        assert_eq!((layout.centre(0), layout.centre(5)), ([4, 4], [16, 8]));
    }
}
