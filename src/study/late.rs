//! Light that is still being found.
//!
//! The stated error knows only what samples have met. In a picture where few paths find much of the light it is too small, and
//! by itself it cannot tell. Two things can:
//!
//! - [`LargestShares`]: where one sample carries a noticeable part of the light of a region, others like it are yet to come.
//! - A **probe**: a few paths by another method, from both ends, less than one for a hundred of the render's. Where their mean
//!   luminance in a sixteenth of the picture is significantly above the picture's, the render's method has not found that
//!   light.

use std::fmt;

use serde::Serialize;

use crate::study::error::ReplicatePixel;
use crate::study::format::percent;
use crate::study::largest::LargestShares;

use crate::image::compare::luminance;

/// Columns and rows of the blocks that a probe is compared in.
pub const PROBE_BLOCKS: usize = 4;

/// The render's paths for each one of the probe.
const PATHS_PER_PROBE: f64 = 256.0;

/// Least and largest number of paths of a probe.
const PROBE_PATHS: [f64; 2] = [2048.0, 65_536.0];

/// Number of standard errors from which a difference of means counts.
const SIGNIFICANT: f64 = 4.0;

/// Share of the picture on which the light of single samples counts, as the errors that are stated leave out 5 %.
const WIDE: f64 = 0.05;

/// Traces so many paths by another method: mean luminance and its variance in each of [`PROBE_BLOCKS`]² blocks, row by row.
pub type Probe = Box<dyn FnMut(u64) -> Vec<[f64; 2]> + Send>;

/// What is known of light that has not been found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LateLight {
    /// How much of the light single samples carry.
    pub largest: LargestShares,
    /// Share of the light that the probe has found and the picture lacks; `None` without a probe.
    pub missing: Option<f64>,
}

impl LateLight {
    /// Why the stated error cannot be trusted; `None` if nothing speaks against it.
    pub fn warning(&self) -> Option<String> {
        let missing = self.missing.filter(|missing| *missing > 0.0);
        let because = match (missing, self.largest.large_in > WIDE) {
            (Some(missing), _) => format!("paths from both ends find {} more of it", percent(missing)),
            (None, true) => format!("one sample carries {} of it", percent(self.largest.one)),
            (None, false) => return None,
        };
        Some(format!("light is still being found, the error is larger than stated: {because}"))
    }
}

/// A [`Probe`] and what it has found.
pub(super) struct ProbeState {
    probe: Probe,
    paths: f64,
    blocks: Vec<[f64; 2]>,
}

impl fmt::Debug for ProbeState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ProbeState").field("paths", &self.paths).field("blocks", &self.blocks).finish()
    }
}

impl ProbeState {
    pub(super) fn new(probe: Probe) -> Self {
        Self { probe, paths: 0.0, blocks: Vec::new() }
    }

    /// Probes anew where the render's `paths` have doubled.
    pub(super) fn update(&mut self, paths: f64) {
        let [least, most] = PROBE_PATHS;
        let wanted = (paths / PATHS_PER_PROBE).min(most);
        if wanted >= least && wanted >= 2.0 * self.paths {
            (self.paths, self.blocks) = (wanted, (self.probe)(wanted as u64));
        }
    }

    /// Share of the light that the picture lacks; `None` before the first probe.
    pub(super) fn missing(&self, pixels: &[ReplicatePixel], size: [usize; 2]) -> Option<f64> {
        if self.blocks.is_empty() {
            return None;
        }
        let picture = blocks(pixels, size);
        let lacking = |(probe, picture): (&[f64; 2], &[f64; 2])| {
            let gap = probe[0] - picture[0];
            if gap > SIGNIFICANT * (probe[1] + picture[1]).sqrt() { gap } else { 0.0 }
        };
        let gap: f64 = self.blocks.iter().zip(&picture).map(lacking).sum();
        let found: f64 = picture.iter().map(|block| block[0]).sum();
        (found + gap > 0.0).then(|| gap / (found + gap))
    }
}

/// Mean luminance of a picture and its variance, block by block.
fn blocks(pixels: &[ReplicatePixel], [width, height]: [usize; 2]) -> Vec<[f64; 2]> {
    let mut sums = vec![[0.0; 3]; PROBE_BLOCKS * PROBE_BLOCKS];
    for (i, pixel) in pixels.iter().enumerate() {
        let [x, y] = [i % width * PROBE_BLOCKS / width, i / width * PROBE_BLOCKS / height];
        let square = luminance(pixel.difference).powi(2) * f64::from(pixel.factor);
        let sum = &mut sums[y * PROBE_BLOCKS + x];
        *sum = [sum[0] + luminance(pixel.mean), sum[1] + square, sum[2] + 1.0];
    }
    sums.iter().map(|[sum, square, n]| [sum / n.max(1.0), square / (n * n).max(1.0)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_probe_is_small_and_finds_what_lacks() {
        let found = |y: f64| -> Probe { Box::new(move |paths| vec![[y, 1.0 / paths as f64]; 16]) };
        let pixel = ReplicatePixel { mean: [1.0; 3], difference: [0.01; 3], factor: 0.25, seen: true };
        let missing = |y: f64, paths: f64| {
            let mut state = ProbeState::new(found(y));
            state.update(paths);
            state.missing(&vec![pixel; 64 * 64], [64, 64])
        };
        assert_eq!(missing(2.0, 100_000.0), None);
        let half = missing(2.0, 2e6).expect("10 000 paths");
        assert!((half - 0.5).abs() < 1e-6, "{half}");
        assert_eq!((missing(1.03, 2e6), missing(0.5, 2e6)), (Some(0.0), Some(0.0)));
    }

    #[test]
    fn warnings_name_their_reason() {
        let mut late = LateLight::default();
        assert_eq!(late.warning(), None);
        late.largest = LargestShares { one: 0.2, one_per_tile: 0.3, large_in: 0.04 };
        assert_eq!(late.warning(), None);
        late.largest.large_in = 0.5;
        assert!(
            late.warning()
                .is_some_and(|text| text.ends_with(&format!("one sample carries {} of it", percent(0.2))))
        );
        late.missing = Some(0.14);
        assert!(late.warning().is_some_and(|text| text.contains(&format!("find {} more", percent(0.14)))));
    }
}
