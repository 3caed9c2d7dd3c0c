//! The measurements of a study, lines of `measurements.jsonl`. Each is written at once, so that an interrupted run keeps them and a
//! second run adds to them.

use serde::{Deserialize, Serialize};

use crate::study::data::{DisplayPrice, EffectPrice, NumericPrice, ReferenceImage, SchemePrice};
use crate::study::interval::Interval;
use crate::study::prediction::PredictionOutcome;

/// One line of the file.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "measured")]
pub enum Measurement {
    /// The reference of all errors; measurements before it were made against another one.
    Reference(ReferenceImage),
    /// The command that made the lines before it.
    Command {
        /// The command line.
        command: String,
    },
    /// One rendered picture.
    Run(Box<RenderMeasurement>),
    /// The cost of an effect of the scene.
    Effect(EffectPrice),
    /// What leaving out unused effects saves.
    Unused {
        /// Speed of the specialised code over that of the general code.
        ratio: f64,
    },
    /// The cost of a setting of the display.
    Display(DisplayPrice),
    /// The cost of a choice of arithmetic.
    Numeric(NumericPrice),
    /// The cost of a way to divide a run.
    Scheme(SchemePrice),
}

/// One rendered picture: how it was made, and its errors.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct RenderMeasurement {
    /// Name of the method, or of the other program.
    pub method: String,
    /// Another program made it.
    pub peer: bool,
    /// Seconds that the render was given.
    pub budget: f64,
    /// Its seed.
    pub seed: u32,
    /// Wall-clock seconds of rendering.
    pub seconds: f64,
    /// Seconds of processor time spent tracing.
    pub trace_seconds: f64,
    /// Seconds of the client spent splatting.
    pub splat_seconds: f64,
    /// Seconds from sums to picture.
    pub display_seconds: f64,
    /// Paths per pixel.
    pub samples_per_pixel: f64,
    /// Paths.
    pub paths: u64,
    /// relMSE against the reference, after subtraction of the reference's own.
    pub rel_mse: Interval,
    /// The same without the worst 0.1 % of pixels.
    pub trimmed: f64,
    /// Relative error against the reference at median, p95 and p99 of the picture.
    pub relative: [Interval; 3],
    /// relMSE that the replicates state.
    pub noise: Option<Interval>,
    /// Relative errors that the replicates state.
    pub stated: Option<[Interval; 3]>,
    /// SMAPE.
    pub smape: f64,
    /// FLIP of the displayed picture.
    pub flip: f64,
    /// FLIP of the picture that is displayed through the noise filter; `None` for undivided runs and other programs.
    #[serde(default)]
    pub flip_filtered: Option<f64>,
    /// Mean luminance over the reference's.
    pub energy: f64,
    /// Mean square error on the grid of [`REGIONS`], row by row, relative to the squared mean luminance.
    pub regions: Vec<f32>,
    /// The displayed picture, a `data:` URI.
    pub picture: Option<String>,
    /// The FLIP error map, a `data:` URI.
    pub error_map: Option<String>,
    /// Samples that were not finite: cause, count, command that repeats the first.
    pub rejected: Vec<(String, u64, String)>,
    /// Predictions of this render and their outcomes.
    #[serde(rename = "kept")]
    pub predictions: Vec<PredictionOutcome>,
}

/// Seconds of Figures 3 and 4 of the paper; the page shows these pictures side by side.
pub const FIGURES: [f64; 4] = [1.0 / 30.0, 1.0 / 3.0, 3.0, 30.0];

/// Columns and rows of the regions whose best methods are shown.
pub const REGIONS: [usize; 2] = [12, 12];
