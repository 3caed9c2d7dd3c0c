//! Cost of the error estimate: pictures with and without replicates, of equal sample counts.

use miette::Result;

use crate::cmd::study::converge::speed;
use crate::cmd::study::renderer::RenderLimit;
use crate::cmd::study::session::{StudySession, TimeBudget};
use crate::render::process;
use crate::render::run_spec::RunSpec;
use crate::study::Interval;
use crate::study::data::SchemePrice;
use crate::study::measurement::Measurement;

/// Samples per pixel of the pictures.
const SAMPLES: f64 = 16.0;

/// Measures pairs of pictures until the budget is spent, but at least three.
pub fn schemes(session: &mut StudySession, budget: &TimeBudget) -> Result<()> {
    let run = session.unbiased();
    let StudySession { renderer, folder, judge, .. } = session;
    if folder.has(|m| matches!(m, Measurement::Scheme(_))) {
        return Ok(());
    }
    // At least three pairs, at the speed of the method so far.
    let speed = speed(folder, run.integrator);
    if speed <= 0.0 || budget.left() < 6.5 * SAMPLES * renderer.texels() / speed {
        return Ok(());
    }
    let paths = RenderLimit::Paths((SAMPLES * renderer.texels()) as u64);
    let (mut ratios, mut stated) = (Vec::new(), Vec::new());
    for seed in 7000.. {
        budget.say("a picture with replicates and one without");
        let mut errors = [0.0; 2];
        for (error, replicated) in errors.iter_mut().zip([true, false]) {
            let run = RunSpec { seed, replicated, ..run.clone() };
            let traced = renderer.trace(&run, paths)?;
            if traced.driven.interrupted {
                return Ok(());
            }
            let Some([_, found]) = judge.error_of(&traced.rgb) else { return Ok(()) };
            *error = found.value.max(0.0).sqrt();
            let own = traced.estimate().map(|own| own.rel_mse.value).filter(|own| *own > 0.0 && *error > 0.0);
            stated.extend(own.map(|own| 0.5 * (own / found.value).ln()));
        }
        if errors.contains(&0.0) {
            return Ok(()); // black: there is nothing to know
        }
        ratios.push((errors[0] / errors[1]).ln());
        let full = budget.left() < 0.0 && ratios.len() >= 3;
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
