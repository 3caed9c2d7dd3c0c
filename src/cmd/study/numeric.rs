//! Part 5: cost and benefit of more precise arithmetic.

use std::hint::black_box;
use std::time::Instant;

use miette::Result;

use crate::cmd::study::renderer::StudyRenderer;
use crate::cmd::study::session::{StudySession, TimeBudget};
use crate::scene::desc::IntegratorKind;
use crate::study::Interval;
use crate::study::data::NumericPrice;
use crate::study::measurement::Measurement;

/// Number of terms per sum, about what one pixel receives in an hour of a fast tracer.
const TERMS: usize = 1 << 20;

/// Number of sums compared.
const SUMS: usize = 9;

/// Approximate duration in seconds.
const SECONDS: f64 = 1.0;

pub fn numeric(StudySession { renderer, folder, .. }: &mut StudySession, budget: &TimeBudget) -> Result<()> {
    if folder.has(|m| matches!(m, Measurement::Numeric(_))) || budget.left() < SECONDS {
        return Ok(());
    }
    let values = luminances(renderer);
    let exact: f64 = values.iter().map(|&v| f64::from(v)).sum();
    let plain = |values: &[f32]| f64::from(values.iter().fold(0.0f32, |sum, v| sum + v));
    let folded = |values: &[f32]| {
        // Like the film: short sums in one float, folded into two (Knuth's two-sum).
        let (mut hi, mut lo) = (0.0f32, 0.0f32);
        for part in values.chunks(crate::client::filter::ADDS_PER_SUM as usize) {
            let short = part.iter().fold(0.0f32, |sum, v| sum + v);
            let sum = hi + short;
            let back = sum - hi;
            lo += (hi - (sum - back)) + (short - back);
            hi = sum;
        }
        f64::from(hi) + f64::from(lo)
    };
    let naive_variance = |values: &[f32]| {
        let [s, q] = values.iter().fold([0.0f32; 2], |[s, q], v| [s + v, q + v * v]);
        f64::from(q) - f64::from(s) * f64::from(s) / values.len() as f64
    };
    let deviations = |values: &[f32]| {
        let (mut mean, mut sum) = (0.0f32, 0.0f32);
        for (i, v) in values.iter().enumerate() {
            let d = v - mean;
            mean += d / (i + 1) as f32;
            sum += d * (v - mean);
        }
        f64::from(sum)
    };
    let mean = exact / values.len() as f64;
    let spread: f64 = values.iter().map(|&v| (f64::from(v) - mean).powi(2)).sum();
    let sums = compare(&values, exact, &plain, &folded);
    let variances = compare(&values, spread, &naive_variance, &deviations);
    let mut keep = |choice: &str, forms: [&str; 2], (time, error), what: &str| {
        let [choice, what] = [choice, what].map(str::to_string);
        let forms = forms.map(str::to_string);
        folder.keep(Measurement::Numeric(NumericPrice { choice, forms, time, error, what }))
    };
    let forms = ["one float", "two floats"];
    keep("sums of the film", forms, sums, "sum of 2^20 luminances of this scene")?;
    let forms = ["squares less the squared sum", "deviations from the mean"];
    keep("sums of the variance", forms, variances, "variance of 2^20 luminances of this scene")
}

/// Time of the exact form over that of the cheap one, measured alternately; error of the cheap one over that of the exact one.
fn compare(
    values: &[f32],
    truth: f64,
    cheap: &dyn Fn(&[f32]) -> f64,
    exact: &dyn Fn(&[f32]) -> f64,
) -> (Interval, Interval) {
    let time = |form: &dyn Fn(&[f32]) -> f64, values: &[f32]| {
        let start = Instant::now();
        let sum = black_box(form(black_box(values)));
        (start.elapsed().as_secs_f64(), (sum / truth - 1.0).abs())
    };
    let (mut times, mut errors) = (Vec::new(), Vec::new());
    let mut order = values.to_vec();
    for turn in 0..SUMS {
        // The same values in another order round differently.
        order.rotate_left(values.len() / SUMS + turn);
        let (a, b) = (time(cheap, &order), time(exact, &order));
        times.push(b.0 / a.0);
        // An error of 0 is below the precision of the double reference.
        errors.push((a.1.max(1e-12) / b.1.max(1e-12)).ln());
    }
    let error = Interval::of_mean(&errors).unwrap_or_default().map(f64::exp);
    (Interval::of_median(&times).unwrap_or_default(), error)
}

/// Luminances of the scene's samples, repeated as often as needed.
fn luminances(renderer: &StudyRenderer) -> Vec<f32> {
    let run = renderer.run(IntegratorKind::Path, 1);
    let samples =
        crate::render::effect_price::samples(&run, renderer.scene.clone(), renderer.camera.clone(), 1 << 14);
    let seen: Vec<f32> = samples.into_iter().filter(|y| *y > 0.0).collect();
    match seen.is_empty() {
        true => (0..TERMS).map(|i| 0.1 + (i % 7) as f32).collect(),
        false => seen.iter().cycle().take(TERMS).copied().collect(),
    }
}
