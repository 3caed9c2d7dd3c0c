//! `--adaptive`: a pilot that samples the screen evenly, then more camera paths where the picture needs them
//! ([`tracer::screen`](crate::tracer::screen)).

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use miette::Result;
use serde::Serialize;

use crate::accounting::observer::Observer;
use crate::client::DisplayView;
use crate::render::options::RenderOptions;
use crate::render::run_spec::RunSpec;
use crate::render::state::RenderGoal;
use crate::stream::{CHUNK, REPLICATES};
use crate::study::Replicates;
use crate::tracer::sampler::cells::ScreenCells;
use crate::tracer::screen::{ScreenDensity, ScreenSampling};

/// Fraction (one part in so many) of the samples or time that the pilot gets.
const PILOT_SHARE: u32 = 16;

/// Least samples per pixel of the pilot.
const LEAST_PILOT: f64 = 4.0;

/// Least samples per pixel of the picture.
const LEAST_SAMPLES: f64 = 16.0;

/// Samples per pixel of the pilot if the goal is an error.
const PILOT_TO_ERROR: f64 = 16.0;

/// A stage of a render.
#[derive(Clone, Debug)]
pub struct RenderStage {
    pub part: StagePart,
    /// Range of indices.
    pub indices: Range<u64>,
    /// Rendering time since the beginning at which the stage ends.
    pub until: Option<Duration>,
}

/// Purpose of a [`RenderStage`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StagePart {
    /// A render with evenly distributed camera paths.
    Even,
    /// Estimates where the picture needs samples.
    Pilot,
    /// Distributes camera paths by the pilot's estimate.
    Main,
}

impl RenderStage {
    /// A range of indices of an even render.
    pub fn even(indices: Range<u64>, until: Option<Duration>) -> Self {
        Self { part: StagePart::Even, indices, until }
    }
}

/// Adaptive sampling in the report. Field names are JSON keys.
#[derive(Clone, Debug, Serialize)]
pub struct AdaptiveReport {
    /// Samples per pixel of the pilot, overscan included.
    pub pilot_samples_per_pixel: f64,
    /// Regions of the screen along each side.
    pub regions: u32,
    /// Density of camera paths relative to the mean: least, median and greatest.
    pub density: [f32; 3],
}

/// Rejects options that are incompatible with `--adaptive`.
///
/// # Errors
///
/// If there is such an option; the message names both, and what to do.
pub fn check(args: &RenderOptions) -> Result<()> {
    let only_time = args.time.is_some() && args.samples.is_none() && args.spp.is_none();
    let refused = [
        (
            args.replicates == 1,
            "--replicates 1",
            "two randomisations tell where the error is",
            "leave --replicates away",
        ),
        (
            args.check_plan > 0.0,
            "--check-plan",
            "it traces one randomisation alone",
            "leave one of them away",
        ),
        (
            args.first_index > 0,
            "--first-index",
            "a path depends on the pilot before it",
            "leave one of them away",
        ),
        (
            args.reweight_fireflies.is_some(),
            "--reweight-fireflies",
            "it takes samples of equal weight",
            "leave one of them away",
        ),
        (
            args.display.vm > 0.0,
            "--vm",
            "the variance within pixels takes samples of equal weight",
            "use --denoise to mask noise",
        ),
        (
            args.display.view != DisplayView::Picture,
            "--show",
            "the variance within pixels takes samples of equal weight",
            "leave one of them away; the stated error is that of the picture",
        ),
        (
            args.deterministic && only_time,
            "--deterministic and --time",
            "the length of the pilot would depend on the time",
            "give --spp or --samples instead of --time",
        ),
    ];
    match refused.into_iter().find(|(given, ..)| *given) {
        Some((_, option, why, advice)) => {
            Err(miette::miette!(help = advice, "--adaptive does not go with {option}: {why}"))
        }
        None => Ok(()),
    }
}

/// The stages of an adaptive render of `run` to this goal.
///
/// # Errors
///
/// If the method traces no camera paths, or there are too few samples for a pilot.
pub fn stages(run: &RunSpec, goal: &RenderGoal) -> Result<Vec<RenderStage>> {
    if let [false, _] = run.integrator.streams() {
        return Err(miette::miette!(
            help = "choose --integrator bidirectional or path, or leave --adaptive away",
            "--adaptive distributes camera paths over the screen, and `{}` traces none",
            run.integrator.name()
        ));
    }
    let per_index = run.integrator.paths_per_index() as f64;
    let texels: f64 = run.film.padded_extent().map(f64::from).iter().product();
    // Whole chunks of every replicate and eye. A pilot has as many samples of each eye as of one.
    let eyes: u64 = if run.stereo.is_some() { 2 } else { 1 };
    let chunks = CHUNK * REPLICATES as u64 * eyes;
    let indices_of = |spp: f64| ((spp * eyes as f64 * texels / per_index) as u64).next_multiple_of(chunks);
    let least = indices_of(LEAST_PILOT);
    let stage = |part, indices, until| RenderStage { part, indices, until };
    let all = goal.indices.end;
    if all == u64::MAX {
        let Some(time) = goal.time else {
            let pilot = indices_of(PILOT_TO_ERROR);
            return Ok(vec![stage(StagePart::Pilot, 0..pilot, None), stage(StagePart::Main, 0..all, None)]);
        };
        return Ok(vec![
            stage(StagePart::Pilot, 0..least, Some(time)),
            stage(StagePart::Pilot, least..all, Some(time / PILOT_SHARE)),
            stage(StagePart::Main, 0..all, Some(time)),
        ]);
    }
    let wanted = (LEAST_SAMPLES * texels / per_index).max(2.0 * least as f64);
    if (all as f64) < wanted.floor() {
        return Err(miette::miette!(
            help = "give more samples, or leave --adaptive away",
            "--adaptive needs {:.0} samples per pixel or more here, because a pilot has at least {:.0} of them",
            (wanted * per_index / texels).ceil(),
            (least as f64 * per_index / texels).ceil()
        ));
    }
    let share = (all / u64::from(PILOT_SHARE)).next_multiple_of(chunks);
    let pilot = least.max(share);
    Ok(vec![stage(StagePart::Pilot, 0..pilot, goal.time), stage(StagePart::Main, 0..all - pilot, goal.time)])
}

/// Sampling of the main stage, from the pilot's errors in `observer` and of the `right_eye`, if there is one, however few its samples are.
///
/// Both eyes have one density over the screen: the paths of each have samples of both, at places that differ by the disparity only, which is
/// small beside a region. With n(r) paths in region r the variances of both eyes there are V_l(r) / n(r) and V_r(r) / n(r), up to a common
/// factor. The sum of all is least for a given number of paths where n² is proportional to V_l + V_r (by Lagrange's multiplier), so that
/// [`ScreenDensity`], which takes the root, is made of that sum.
pub fn sampling(
    run: &RunSpec,
    observer: &Observer,
    right_eye: Option<&Observer>,
) -> (ScreenSampling, AdaptiveReport) {
    let texels: f64 = run.film.padded_extent().map(f64::from).iter().product();
    let level = ScreenDensity::level(texels);
    let seen = |observer: &Observer| observer.accumulated().map(|samples| samples.replicates());
    let errors = |seen: &Replicates| seen.region_errors(&run.film.window(), level);
    let (seen, right_seen) = (seen(observer), right_eye.and_then(seen));
    let of_eyes = [&seen, &right_seen].map(|seen| seen.as_deref().and_then(errors));
    let density = ScreenDensity::new(&sum_of_errors(of_eyes).unwrap_or_else(|| vec![1.0; 1 << (2 * level)]));
    let mut sorted: Vec<f32> = density.relative().collect();
    sorted.sort_unstable_by(f32::total_cmp);
    let report = AdaptiveReport {
        pilot_samples_per_pixel: seen.as_ref().map_or(0, |seen| seen.paths()) as f64 / texels,
        regions: 1 << level,
        density: [sorted[0], sorted[sorted.len() / 2], sorted[sorted.len() - 1]],
    };
    let cells = ScreenCells::of_picture([run.film.width, run.film.height], &run.film.window());
    (ScreenSampling::adaptive(Arc::new(density), run.seed, &cells), report)
}

/// The sum of the errors of both eyes in each region, or those of one.
fn sum_of_errors([left, right]: [Option<Vec<f64>>; 2]) -> Option<Vec<f64>> {
    match (left, right) {
        (Some(left), Some(right)) => {
            Some(left.iter().zip(&right).map(|(left, right)| left + right).collect())
        }
        (left, right) => left.or(right),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Among densities in the family √(V_l + c·V_r) that of the sum, c = 1, has the least variance of both eyes together; that of either eye
    /// alone has more.
    #[test]
    fn the_sum_of_the_errors_of_both_eyes_has_the_best_density() {
        let (left, right) = (vec![1.0, 4.0, 9.0, 0.25], vec![16.0, 1.0, 9.0, 4.0]);
        let variance = |wanted: &[f64]| {
            let total: f64 = wanted.iter().map(|error| error.sqrt()).sum();
            let per_path = |i: usize| (left[i] + right[i]) * total / wanted[i].sqrt();
            (0..4).map(per_path).sum::<f64>()
        };
        let sum = sum_of_errors([Some(left.clone()), Some(right.clone())]).expect("both are known");
        let best = variance(&sum);
        for c in [0.0, 0.5, 2.0] {
            let other: Vec<f64> = left.iter().zip(&right).map(|(left, right)| left + c * right).collect();
            assert!(best < variance(&other), "{c}");
        }
        let larger: Vec<f64> = left.iter().zip(&right).map(|(left, right)| left.max(*right)).collect();
        assert!(best < variance(&larger));
        assert_eq!(sum_of_errors([None, Some(right.clone())]), Some(right));
        assert_eq!(sum_of_errors([None, None]), None);
    }
}
