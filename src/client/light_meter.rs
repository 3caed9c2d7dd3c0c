//! Light meter: estimates the exposure from the first samples of a picture.

use crate::stream::{PathCounts, Sample};

/// Cells per axis of the finest grid; coarser grids have half as many, down to [`COARSEST`].
const FINEST: usize = 16;
const COARSEST: usize = 4;

/// Samples per cell needed for its luminance: with fewer, noise would bias the logarithm low.
const PER_CELL: u64 = 16;

/// Cells darker than this fraction of the mean get less weight, down to zero for black, so that a dark background does not decide.
const DARKEST: f64 = 0.01;

/// Displayed luminance of the geometric mean: middle grey (Reinhard et al. 2002).
pub const MIDDLE_GREY: f64 = 0.18;

/// Sums of luminance over a grid of cells that covers the picture.
#[derive(Clone, Debug, Default)]
pub struct LightMeter {
    /// Per cell, row-major: camera samples, their weights, and light samples; empty before the first sample.
    cells: Vec<[f64; 3]>,
    samples: u64,
    light_paths: u64,
}

impl LightMeter {
    /// Discards all samples.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Adds samples of this many paths.
    pub fn add(&mut self, paths: PathCounts, samples: &[Sample]) {
        self.cells.resize(FINEST * FINEST, [0.0; 3]);
        self.light_paths += paths.light;
        for sample in samples {
            let [x, y] = sample.uv.map(|c| c * FINEST as f32);
            let inside = x >= 0.0 && y >= 0.0 && x < FINEST as f32 && y < FINEST as f32;
            if !inside || !sample.xyz.y.is_finite() {
                continue;
            }
            let cell = &mut self.cells[y as usize * FINEST + x as usize];
            let luminance = f64::from(sample.xyz.y);
            self.samples += 1;
            if sample.w > 0.0 {
                cell[0] += luminance;
                cell[1] += f64::from(sample.w);
            } else {
                cell[2] += luminance;
            }
        }
    }

    /// Exposure factor that displays the geometric mean of the luminance as middle grey under the curve 1 − exp(−Y); `None` while there are
    /// too few samples, and without light. A black background has no weight.
    pub fn exposure(&self) -> Option<f32> {
        let enough = |side: &usize| self.samples >= PER_CELL * (side * side) as u64;
        let side = [FINEST, FINEST / 2, COARSEST].into_iter().find(enough)?;
        let mut cells = vec![[0.0; 3]; side * side];
        for (i, cell) in self.cells.iter().enumerate() {
            let [x, y] = [i % FINEST, i / FINEST].map(|n| n * side / FINEST);
            cells[y * side + x].iter_mut().zip(cell).for_each(|(sum, part)| *sum += part);
        }
        let per_path = (side * side) as f64 / self.light_paths.max(1) as f64;
        let luminance = |[camera, weight, light]: &[f64; 3]| {
            let seen = if *weight > 0.0 { camera / weight } else { 0.0 };
            seen + light * per_path
        };
        let luminances: Vec<f64> = cells.iter().map(luminance).collect();
        let mean = luminances.iter().sum::<f64>() / luminances.len() as f64;
        if mean.is_nan() || mean <= 0.0 {
            return None;
        }
        let darkest = DARKEST * mean;
        let counted = |y: &f64| ((y / darkest).min(1.0), y.max(darkest).ln());
        let sums =
            luminances.iter().map(counted).fold((0.0, 0.0), |(all, sum), (n, y)| (all + n, sum + n * y));
        exposure_for((sums.1 / sums.0).exp())
    }
}

/// Exposure factor that displays this luminance as middle grey under the curve 1 − exp(−Y); `None` for zero.
pub fn exposure_for(luminance: f64) -> Option<f32> {
    let exposure = -(1.0 - MIDDLE_GREY).ln() / luminance;
    (exposure > 0.0 && exposure.is_finite()).then_some(exposure as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Xyz;

    /// `times` camera samples in every cell of the finest grid.
    fn even(times: usize, luminance: impl Fn(usize) -> f32, w: f32) -> Vec<Sample> {
        let sample = |i: usize| {
            let place = |n: usize| (n as f32 + 0.5) / FINEST as f32;
            let y = luminance(i);
            Sample { uv: [place(i % FINEST), place(i / FINEST)], xyz: Xyz { x: y, y, z: y }, w }
        };
        (0..times).flat_map(|_| (0..FINEST * FINEST).map(sample)).collect()
    }

    #[test]
    fn an_even_picture_becomes_middle_grey() {
        let mut meter = LightMeter::default();
        assert_eq!(meter.exposure(), None);
        meter.add(PathCounts { camera: 256, light: 0 }, &even(1, |_| 5.0, 1.0));
        let shown = 1.0 - (-5.0 * meter.exposure().expect("light")).exp();
        assert!((shown - 0.18).abs() < 1e-4, "{shown}");
        meter.clear();
        assert_eq!(meter.exposure(), None);
        meter.add(PathCounts::default(), &[]);
        meter.add(PathCounts { camera: 256, light: 0 }, &even(16, |_| 0.0, 1.0));
        assert_eq!(meter.exposure(), None);
    }

    #[test]
    fn light_samples_are_a_density() {
        // 1000 paths, of which each cell of 256 gets one sample of 1000 / 256: luminance 1 all over.
        let mut meter = LightMeter::default();
        meter.add(PathCounts { camera: 0, light: 1000 }, &even(1, |_| 1000.0 / 256.0, 0.0));
        assert!((meter.exposure().expect("light") - 0.198_45).abs() < 1e-3);
    }

    #[test]
    fn a_lamp_and_a_black_background_do_not_decide() {
        let exposure = |lamp: f32, dark: f32| {
            let mut meter = LightMeter::default();
            let luminance = |i: usize| match i {
                0..4 => lamp,
                _ if i % FINEST < 4 => dark,
                _ => 1.0,
            };
            meter.add(PathCounts { camera: 1, light: 0 }, &even(32, luminance, 1.0));
            meter.exposure().expect("light")
        };
        let plain = exposure(1.0, 1.0);
        assert!(exposure(100.0, 1.0) > 0.8 * plain);
        for dark in [0.0, 1e-9, 1e-6] {
            assert!((exposure(1.0, dark) / plain - 1.0).abs() < 1e-3, "{dark}");
        }
        // Dark but visible parts count.
        assert!(exposure(1.0, 0.02) > 2.0 * plain);
    }

    #[test]
    fn values_that_are_no_numbers_are_left_out() {
        let mut meter = LightMeter::default();
        meter.add(PathCounts::default(), &even(16, |_| 1.0, 1.0));
        let before = meter.exposure();
        let nan = Sample { uv: [0.5; 2], xyz: Xyz { x: 0.0, y: f32::NAN, z: 0.0 }, w: 1.0 };
        meter.add(PathCounts::default(), &[nan, Sample { uv: [f32::NAN, 2.0], ..nan }]);
        assert_eq!(meter.exposure(), before);
    }
}
