//! Measurements of a study, one per line of `measurements.jsonl`. Each is written immediately, so that an interrupted run keeps them and a
//! later run adds to them.

use serde::{Deserialize, Serialize};

use crate::study::brightness::MeanLuminance;
use crate::study::data::{
    AutoChoice, DisplayPrice, DroppedMethod, EffectPrice, NumericPrice, OptionPrice, ReferenceImage,
    SchemePrice,
};
use crate::study::interval::Interval;
use crate::study::prediction::PredictionOutcome;

/// A line of the file.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "measured")]
pub enum Measurement {
    /// Reference of all errors. It grows with every run; a given one replaces it and discards everything measured against it.
    Reference(ReferenceImage),
    /// Command that produced the preceding lines.
    Command {
        /// The command line.
        command: String,
    },
    /// A rendered picture; a later line of the same method, size and seed replaces an earlier one.
    Run(Box<RenderMeasurement>),
    /// A method whose measurement was ended early, with the reason.
    Dropped(DroppedMethod),
    /// Choice of `--integrator auto`.
    Auto(AutoChoice),
    /// Measurement of an option of `render`.
    Option(OptionPrice),
    /// Measurement of an effect of the scene.
    Effect(EffectPrice),
    /// Gain from leaving out the code of unused effects.
    Unused {
        /// Speed of the specialised code over that of the general code.
        ratio: f64,
    },
    /// Measurement of a display setting.
    Display(DisplayPrice),
    /// Measurement of a choice of arithmetic.
    Numeric(NumericPrice),
    /// Measurement of a scheme that divides a run.
    Scheme(SchemePrice),
}

/// A rendered picture with its errors. Errors of the linear picture are known if every pixel has a sample.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct RenderMeasurement {
    /// Name of the method, or of the other program.
    pub method: String,
    /// Whether another program rendered it.
    pub peer: bool,
    /// Whether the method is biased by design (photon blur that shrinks over time).
    #[serde(default)]
    pub biased: bool,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Whether it is a trial: smaller than the studied picture, so that its error is known early.
    #[serde(default)]
    pub is_trial: bool,
    /// Requested render time in seconds.
    pub budget: f64,
    /// Its seed.
    pub seed: u32,
    /// Wall-clock seconds of rendering.
    pub seconds: f64,
    /// CPU seconds spent tracing.
    pub trace_seconds: f64,
    /// Seconds of the client spent splatting.
    pub splat_seconds: f64,
    /// Seconds from sums to picture.
    pub display_seconds: f64,
    /// Paths per pixel.
    pub samples_per_pixel: f64,
    /// Paths.
    pub paths: u64,
    /// relMSE after subtracting the reference's own.
    pub rel_mse: Option<Interval>,
    /// As `rel_mse`, without the worst 0.1 % of pixels.
    pub trimmed: Option<f64>,
    /// Relative error at median, p95 and p99 of the picture, after subtracting the reference's own.
    pub relative: Option<[Interval; 3]>,
    /// relMSE estimated from the replicates, relative to the luminance of the reference.
    pub noise: Option<Interval>,
    /// Relative errors estimated from the replicates.
    pub stated: Option<[Interval; 3]>,
    /// The same quantiles against the reference, if its own errors are much smaller; `stated` should contain them.
    #[serde(default)]
    pub truth: Option<[f64; 3]>,
    /// Fraction of the light that the method misses, as far as other methods show it significantly.
    #[serde(default)]
    pub missing: f64,
    /// SMAPE.
    pub smape: Option<f64>,
    /// FLIP of the displayed picture; `None` for a trial.
    pub flip: Option<f64>,
    /// FLIP of the denoised picture; `None` for undivided runs, trials and other programs.
    #[serde(default)]
    pub flip_filtered: Option<f64>,
    /// Mean luminance of each replicate.
    #[serde(default)]
    pub brightness: Vec<MeanLuminance>,
    /// Mean square error on the grid of [`REGIONS`], row-major, relative to the squared mean luminance.
    pub regions: Vec<f32>,
    /// The displayed picture, a `data:` URI.
    pub picture: Option<String>,
    /// The FLIP error map, a `data:` URI.
    pub error_map: Option<String>,
    /// Rejected samples: cause, count, and command that replays the first.
    pub rejected: Vec<(String, u64, String)>,
    /// Predictions of this render with their outcomes.
    #[serde(rename = "kept")]
    pub predictions: Vec<PredictionOutcome>,
}

impl RenderMeasurement {
    /// Whether both measure the same render.
    pub fn is_same(&self, other: &Self) -> bool {
        (&self.method, self.size, self.seed, self.budget)
            == (&other.method, other.size, other.seed, other.budget)
    }
}

/// Render times of the paper's Figures 3 and 4, seconds; the page shows these pictures side by side.
pub const FIGURES: [f64; 4] = [1.0 / 30.0, 1.0 / 3.0, 3.0, 30.0];

/// Grid of regions whose best methods are shown: columns and rows.
pub const REGIONS: [usize; 2] = [12, 12];
