//! The measurements of a study, lines of `measurements.jsonl`. Each is written at once, so that an interrupted run keeps them and a
//! second run adds to them.

use serde::{Deserialize, Serialize};

use crate::study::brightness::MeanLuminance;
use crate::study::data::{
    AutoChoice, DisplayPrice, DroppedMethod, EffectPrice, NumericPrice, OptionPrice, ReferenceImage,
    SchemePrice,
};
use crate::study::interval::Interval;
use crate::study::prediction::PredictionOutcome;

/// One line of the file.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "measured")]
pub enum Measurement {
    /// The reference of all errors. It grows with every run; one from a file replaces it with all that was measured against it.
    Reference(ReferenceImage),
    /// The command that made the lines before it.
    Command {
        /// The command line.
        command: String,
    },
    /// One rendered picture; a later line of the same method, size and seed replaces an earlier one.
    Run(Box<RenderMeasurement>),
    /// A method that was not measured further, and why.
    Dropped(DroppedMethod),
    /// What `--integrator auto` chooses.
    Auto(AutoChoice),
    /// The cost of an option of `render`.
    Option(OptionPrice),
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

/// One rendered picture: how it was made, and its errors. Errors of the linear picture are known where every pixel has a sample.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct RenderMeasurement {
    /// Name of the method, or of the other program.
    pub method: String,
    /// Another program made it.
    pub peer: bool,
    /// The method is biased by design: it blurs, less and less.
    #[serde(default)]
    pub biased: bool,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// It is smaller than the picture that is studied: a trial, from which the errors at its samples per pixel are known early.
    #[serde(default)]
    pub is_trial: bool,
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
    /// relMSE, without the reference's own.
    pub rel_mse: Option<Interval>,
    /// The same without the worst 0.1 % of pixels.
    pub trimmed: Option<f64>,
    /// Relative error at median, p95 and p99 of the picture, without the reference's own.
    pub relative: Option<[Interval; 3]>,
    /// relMSE that the replicates state, relative to the luminance of the reference.
    pub noise: Option<Interval>,
    /// Relative errors that the replicates state.
    pub stated: Option<[Interval; 3]>,
    /// The same figures against the reference, where its own errors are much smaller: what `stated` is to hold.
    #[serde(default)]
    pub truth: Option<[f64; 3]>,
    /// Share of the light that the method has not found, as far as other methods show it significantly.
    #[serde(default)]
    pub missing: f64,
    /// SMAPE.
    pub smape: Option<f64>,
    /// FLIP of the displayed picture; `None` for a trial.
    pub flip: Option<f64>,
    /// FLIP of the picture that is displayed through the noise filter; `None` for undivided runs, trials and other programs.
    #[serde(default)]
    pub flip_filtered: Option<f64>,
    /// Mean luminance by each replicate.
    #[serde(default)]
    pub brightness: Vec<MeanLuminance>,
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

impl RenderMeasurement {
    /// Whether both are of the same render.
    pub fn is_same(&self, other: &Self) -> bool {
        (&self.method, self.size, self.seed, self.budget)
            == (&other.method, other.size, other.seed, other.budget)
    }
}

/// Seconds of Figures 3 and 4 of the paper; the page shows these pictures side by side.
pub const FIGURES: [f64; 4] = [1.0 / 30.0, 1.0 / 3.0, 3.0, 30.0];

/// Columns and rows of the regions whose best methods are shown.
pub const REGIONS: [usize; 2] = [12, 12];
