//! The decision: least variance × cost, with two safeguards.
//!
//! The estimate of a method's error at equal time is the mean over the picture of its relative variance per path (relMSE:
//! variance / (Y² + floor²)), times what a path costs. It is not to be trusted where a method has not found all there is, so
//!
//! - particles are out where the picture shows a delta, which they never find;
//! - where a method's mean in a part of the picture is significantly below another's, it is charged for what it has missed:
//!   paths that bring a mean of Δ and of which none was among n have a second moment of at least n Δ².

use crate::scene::desc::IntegratorKind;

use super::grid::{CELLS, SIDE};
use super::survey::Survey;
use super::trial::Trial;
use super::words;

/// Parts of the picture in which means are compared, along either side.
const BLOCKS: usize = 4;

/// Standard errors from which a difference of means counts.
const SIGNIFICANT: f64 = 4.0;

/// Luminance below which errors count as absolute, as a share of the picture's mean.
const FLOOR: f64 = 0.1;

/// Another method must be better than path tracing by this factor: less is within the error of the estimate, and path
/// tracing spreads its samples over the picture most evenly from the first frame on.
const WORTH: f64 = 1.25;

/// What photons must gain over the best of the others: their samples share one map, so that noise falls more slowly than a
/// trial can tell, and they blur.
const PHOTONS_WORTH: f64 = 6.0;

/// Share of the picture that may show deltas before particles are out: none, but for a stray ray between two edges.
const DELTAS: f64 = 0.0002;

/// How one method is judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Rating {
    /// The method.
    pub kind: IntegratorKind,
    /// It can show all of the picture.
    pub complete: bool,
    /// Relative variance per path, with what was missed.
    pub variance: f64,
    /// Share of the light that it has missed, where that is significant.
    pub missed: f64,
    /// Cost of one index, in units of a camera vertex.
    pub cost: f64,
    /// Mean luminance of the picture.
    pub mean: f64,
}

impl Rating {
    /// Time to a given error; infinite where it can never be reached.
    pub fn time(&self) -> f64 {
        if self.complete { self.variance * self.cost } else { f64::INFINITY }
    }

    /// The same, on the safe side for photons.
    fn cautious_time(&self) -> f64 {
        if self.kind == IntegratorKind::Photon { PHOTONS_WORTH * self.time() } else { self.time() }
    }
}

/// A method and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Choice {
    /// The method; never [`IntegratorKind::Auto`].
    pub kind: IntegratorKind,
    /// One sentence without its end.
    pub reason: String,
    /// All that were tried.
    pub ratings: Vec<Rating>,
}

/// Picks one of the methods that were tried.
pub fn decide(survey: &Survey, trials: &[Trial]) -> Choice {
    let complete = |t: &Trial| t.kind != IntegratorKind::Light || survey.delta_seen <= DELTAS;
    let complete: Vec<bool> = trials.iter().map(complete).collect();
    let brightness = brightness(trials, &complete);
    let mean = brightness.iter().sum::<f64>() / CELLS as f64;
    let floor = (FLOOR * mean).powi(2);
    let ratings: Vec<Rating> = trials
        .iter()
        .zip(&complete)
        .map(|(trial, &complete)| {
            let grid = &trial.grid;
            let scattered = |cell: usize| grid.variance(cell) / (brightness[cell].powi(2) + floor);
            let variance =
                if mean > 0.0 { (0..CELLS).map(scattered).sum::<f64>() / CELLS as f64 } else { 0.0 };
            let mut rating =
                Rating { kind: trial.kind, complete, variance, missed: 0.0, cost: trial.cost, mean: 0.0 };
            rating.mean = (0..CELLS).map(|cell| grid.mean(cell)).sum::<f64>() / CELLS as f64;
            charge(&mut rating, trial, (trials, &brightness, floor));
            rating
        })
        .collect();
    let best =
        ratings.iter().filter(|r| r.complete).min_by(|a, b| a.cautious_time().total_cmp(&b.cautious_time()));
    let path = ratings.iter().find(|r| r.kind == IntegratorKind::Path);
    let near = |best: &Rating, path: &Rating| path.cautious_time() <= WORTH * best.cautious_time();
    let kind = match (best, path) {
        (Some(best), Some(path)) if near(best, path) => path.kind,
        (Some(best), _) => best.kind,
        (None, _) => IntegratorKind::Path,
    };
    let reason = words::reason(kind, survey, &ratings);
    Choice { kind, reason, ratings }
}

/// Luminance of each cell, of all that can show it, smoothed: single cells are noise. Photons are left out: all samples of their
/// trial share one map, whose blotches no number of samples averages.
fn brightness(trials: &[Trial], complete: &[bool]) -> Vec<f64> {
    let used = trials.iter().zip(complete).filter(|(t, c)| **c && t.kind != IntegratorKind::Photon);
    let used: Vec<&Trial> = used.map(|(t, _)| t).collect();
    let raw: Vec<f64> = (0..CELLS)
        .map(|cell| used.iter().map(|t| t.grid.mean(cell)).sum::<f64>() / used.len().max(1) as f64)
        .collect();
    let near = |i: usize| i.saturating_sub(1)..=(i + 1).min(SIDE - 1);
    (0..CELLS)
        .map(|cell| {
            let (x, y) = (cell % SIDE, cell / SIDE);
            let around = near(y).flat_map(|y| near(x).map(move |x| y * SIDE + x));
            let (sum, n) = around.fold((0.0, 0.0), |(sum, n), cell| (sum + raw[cell], n + 1.0));
            sum / n
        })
        .collect()
}

/// Mean of a block and its variance.
fn block(trial: &Trial, block: usize) -> (f64, f64) {
    let width = SIDE / BLOCKS;
    let (left, top) = (block % BLOCKS * width, block / BLOCKS * width);
    let cells = (0..width * width).map(|i| (top + i / width) * SIDE + left + i % width);
    let n = (width * width) as f64;
    let (mean, variance) = cells.fold((0.0, 0.0), |(mean, variance), cell| {
        (mean + trial.grid.mean(cell), variance + trial.grid.variance_of_mean(cell))
    });
    // `paths` per unit of picture, n / CELLS of the picture.
    (mean / n, variance / n / (trial.paths as f64 * n / CELLS as f64))
}

/// Charges a method for light that another one, photons excepted, has found and it has not.
fn charge(rating: &mut Rating, trial: &Trial, (others, brightness, floor): (&[Trial], &[f64], f64)) {
    let (blocks, width) = (BLOCKS * BLOCKS, SIDE / BLOCKS);
    let mut missed = 0.0;
    for i in 0..blocks {
        let (mean, variance) = block(trial, i);
        let gap = |other: &Trial| {
            let (more, v) = block(other, i);
            let gap = more - mean;
            if gap > SIGNIFICANT * (v + variance).sqrt() { gap } else { 0.0 }
        };
        let others = others.iter().filter(|o| o.kind != trial.kind && o.kind != IntegratorKind::Photon);
        let gap = others.map(gap).fold(0.0, f64::max);
        let (left, top) = (i % BLOCKS * width, i / BLOCKS * width);
        let y =
            (0..width * width).map(|i| brightness[(top + i / width) * SIDE + left + i % width]).sum::<f64>();
        let y = y / (width * width) as f64;
        let paths = trial.paths as f64 / blocks as f64;
        if gap > 0.0 {
            rating.variance += paths * gap * gap / (y * y + floor) / blocks as f64;
            missed += gap / blocks as f64;
        }
    }
    let mean = brightness.iter().sum::<f64>() / CELLS as f64;
    rating.missed = if mean > 0.0 { missed / mean } else { 0.0 };
}
