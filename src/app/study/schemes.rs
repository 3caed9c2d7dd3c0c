//! What it costs to know the error: pictures with replicates and without, of as many samples.

use miette::Result;

use super::against::ReferencePicture;
use super::folder::StudyFolder;
use super::stage::{RenderLimit, StudyRenderer};
use super::{TimeBudget, unbiased};
use crate::app::process;
use crate::app::run_spec::RunSpec;
use crate::study::Interval;
use crate::study::data::SchemePrice;
use crate::study::measurement::Measurement;

/// Samples per pixel of the pictures.
const SAMPLES: f64 = 16.0;

/// Measures pairs of pictures until the time is spent; three at least.
///
/// # Errors
///
/// When nothing can be rendered or kept.
pub fn schemes(
    stage: &mut StudyRenderer,
    folder: &mut StudyFolder,
    against: &ReferencePicture,
    clock: &TimeBudget,
) -> Result<()> {
    if folder.measurements.iter().any(|m| matches!(m, Measurement::Scheme(_))) || clock.left() <= 0.0 {
        return Ok(());
    }
    let run = unbiased(stage);
    let paths = RenderLimit::Paths((SAMPLES * stage.texels()) as u64);
    let (mut ratios, mut stated) = (Vec::new(), Vec::new());
    for seed in 7000.. {
        clock.say("a picture with replicates and one without");
        let mut errors = [0.0; 2];
        for (error, replicated) in errors.iter_mut().zip([true, false]) {
            let run = RunSpec { seed, replicated, ..run.clone() };
            let traced = stage.trace(&run, paths)?;
            if traced.driven.interrupted {
                return Ok(());
            }
            let run = against.judge_run(stage, &run, &traced, 0.0)?;
            *error = run.rel_mse.value.sqrt();
            stated.extend(run.noise.map(|noise| 0.5 * (noise.value / run.rel_mse.value).ln()));
        }
        if errors.contains(&0.0) {
            return Ok(()); // black: there is nothing to know
        }
        ratios.push((errors[0] / errors[1]).ln());
        let full = clock.left() < 0.0 && ratios.len() >= 3;
        if full || ratios.len() >= 8 || process::is_interrupted() {
            break;
        }
    }
    let mean = |logs: &[f64]| Interval::of_mean(logs).unwrap_or_default().map(f64::exp);
    folder.keep(Measurement::Scheme(SchemePrice {
        name: "two independent randomisations".to_string(),
        used: true,
        error: mean(&ratios),
        stated: mean(&stated),
    }))
}
