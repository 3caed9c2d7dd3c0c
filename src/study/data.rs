//! The results of a study: the content of `study.json`, from which the page, the terminal's summary and the CSV are made.
//!
//! Errors are those of the unblurred linear picture unless said otherwise; relative errors are shares (0.01 is 1 %); times are
//! wall-clock seconds of the stated machine.

use serde::{Deserialize, Serialize};

use crate::study::interval::Interval;

/// Everything about one scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Study {
    /// Format of the file; other formats are not read.
    pub format: u32,
    /// The scene file as given.
    pub scene: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Machine of the measurements. A study is not continued on another machine.
    pub machine: Machine,
    /// Commands that reproduce it, one per line.
    pub command: String,
    /// Seconds to load and prepare the scene, excluded from all curves.
    pub load_seconds: f64,
    /// The reference of all errors.
    pub reference: Option<ReferenceImage>,
    /// Parts 1 and 2: curve and times to errors of each method, including other programs.
    pub methods: Vec<MethodResult>,
    /// Choice of `--integrator auto` for this scene.
    pub auto: Option<AutoChoice>,
    /// Methods whose measurement was ended early, and why.
    pub dropped: Vec<DroppedMethod>,
    /// Width and height of the trials, whose errors are known before the full picture has enough samples; `None` if the picture itself is
    /// small.
    pub trial_size: Option<[u32; 2]>,
    /// Overhead per machine when rendering on several.
    pub farm: FarmCost,
    /// The best method of each region at equal time.
    pub regions: Option<RegionWinners>,
    /// Part 3: costs of effects.
    pub effects: Vec<EffectPrice>,
    /// Speed of the specialised code relative to the general code.
    pub unused_effects: Option<Interval>,
    /// Part 3, continued: costs of options of `render`.
    pub options: Vec<OptionPrice>,
    /// Part 4: costs of display settings.
    pub display: Vec<DisplayPrice>,
    /// Part 5: costs of exact arithmetic.
    pub numeric: Vec<NumericPrice>,
    /// Cost of the error estimate: dividing a run into replicates.
    pub schemes: Vec<SchemePrice>,
    /// Part 6: accuracy of predictions.
    pub predictions: Option<PredictionScore>,
    /// Accuracy of stated errors, by method.
    #[serde(default)]
    pub stated: Vec<StatedErrors>,
    /// Part 7: rejected samples and brightness.
    pub stability: Vec<Stability>,
    /// Parts that were requested but are missing, because the run was interrupted or its budget was spent.
    pub missing: Vec<String>,
}

/// Choice of `--integrator auto`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AutoChoice {
    /// The method.
    pub method: String,
    /// Reason for the choice.
    pub reason: String,
    /// Duration of its trial in seconds.
    pub seconds: f64,
}

/// A method whose measurement was ended early.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DroppedMethod {
    /// The method.
    pub method: String,
    /// Why, as the end of a sentence: `takes at least 4 times as long as path`.
    pub reason: String,
}

/// Overhead per machine, besides rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FarmCost {
    /// Seconds to read and prepare the scene and to write the state of a part.
    pub setup: f64,
    /// Seconds to merge the state of one part.
    pub merge: f64,
}

impl FarmCost {
    /// Seconds on this many machines for work that takes `alone` on one.
    pub fn on(&self, machines: u32, alone: Interval) -> Interval {
        let n = f64::from(machines);
        alone.map(|seconds| self.setup + seconds / n + self.merge * n)
    }
}

/// An option of `render` against a render without it in the same time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct OptionPrice {
    /// As on the command line: `--adaptive`.
    pub name: String,
    /// The method.
    pub method: String,
    /// Duration of each render in seconds.
    pub seconds: f64,
    /// Width and height of both pictures: those of a trial, if there are trials.
    pub size: [u32; 2],
    /// Number of paths with the option over that without it.
    pub paths: Option<f64>,
    /// Relative error at the 95 % quantile with the option over that without it.
    pub error: Option<Interval>,
    /// Mean FLIP of the displayed picture with the option and without.
    pub flip: Option<[f64; 2]>,
}

/// Machine of the measurements.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// The processor's name.
    pub cpu: String,
    /// Tracing threads.
    pub threads: usize,
    /// The Vulkan device, or `cpu`.
    pub device: String,
    /// Its driver with version (Mesa's, if it is Mesa), as far as known.
    pub driver: String,
    /// Program and version.
    pub program: String,
    /// Day of the last run, `2026-11-21`.
    pub date: String,
}

/// Reference picture.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReferenceImage {
    /// The file.
    pub file: String,
    /// How it was made: a method, or “given”.
    pub made_by: String,
    /// Render time in seconds; 0 if it was given.
    pub seconds: f64,
    /// Samples per pixel; 0 if unknown.
    pub samples_per_pixel: f64,
    /// Mean luminance of a given reference, used in the audit of brightness; 0 for one made by the study.
    #[serde(default)]
    pub luminance: f64,
    /// Its own relative errors at median, p95 and p99 of the picture; 0 if unknown.
    #[serde(default)]
    pub relative: [f64; 3],
    /// Its own relMSE, estimated from its replicates and subtracted from what is measured against it; `None` if unknown.
    pub rel_mse: Option<f64>,
    /// `data:` URI, as displayed.
    pub picture: String,
}

/// The results of one method of light transport, or of another program.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MethodResult {
    /// `path`, `bidirectional`, …, `Mitsuba 3.9.1 path`.
    pub name: String,
    /// Whether it is another program.
    pub peer: bool,
    /// Points of the curve, in order of time.
    pub points: Vec<CurvePoint>,
    /// Relative RMS error against seconds: slope of the logarithms.
    pub slope: Option<Interval>,
    /// As `slope`, against samples.
    pub slope_samples: Option<Interval>,
    /// Whether the method is biased by design (photon blur that shrinks over time).
    #[serde(default)]
    pub biased: bool,
    /// Fraction of the light that the method misses, as far as other methods show it significantly.
    #[serde(default)]
    pub missing: f64,
    /// Warnings, such as “slope flatter than −0.4: heavy tail or bias”.
    pub flags: Vec<String>,
    /// Times to relative errors, from the largest error down.
    pub prices: Vec<TimeToError>,
    /// 1/(variance · second), relMSE units.
    pub efficiency: Option<Interval>,
    /// Pictures at the longest time shared by all methods, as `data:` URIs: displayed, and FLIP error map.
    pub picture: Option<String>,
    /// See `picture`.
    pub error_map: Option<String>,
}

/// One point of a curve.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Requested time in seconds.
    pub budget: f64,
    /// Wall-clock seconds of rendering: tracing and splatting, which run concurrently.
    pub seconds: f64,
    /// CPU seconds spent tracing.
    pub trace_seconds: f64,
    /// Seconds of the client's time spent splatting.
    pub splat_seconds: f64,
    /// Seconds from sums to displayed picture.
    pub display_seconds: f64,
    /// Paths per pixel.
    pub samples_per_pixel: f64,
    /// Number of independent runs averaged.
    pub runs: usize,
    /// relMSE after subtracting the reference's own; `None` if pixels have no samples.
    pub rel_mse: Option<Interval>,
    /// As `rel_mse`, without the worst 0.1 % of pixels.
    pub rel_mse_trimmed: Option<Interval>,
    /// Noise part of `rel_mse`, from replicates; `None` for other programs, which have none.
    pub noise: Option<Interval>,
    /// Bias part: `rel_mse − noise`.
    pub bias: Option<Interval>,
    /// 50 %, 95 % and 99 % quantiles of the relative error over tiles of 8×8 pixels, after subtracting the reference's own; `None` if
    /// pixels have no samples.
    pub relative: Option<[Interval; 3]>,
    /// The same quantiles as estimated from the replicates without a reference; `None` for other programs.
    #[serde(default)]
    pub stated: Option<[Interval; 3]>,
    /// SMAPE; of one run, without an interval.
    pub smape: Option<Interval>,
    /// Mean FLIP of the displayed picture; of one run, without an interval.
    pub flip: Option<Interval>,
    /// As `flip`, for the denoised picture; `None` for other programs.
    #[serde(default)]
    pub flip_filtered: Option<Interval>,
    /// Displayed picture of one of the runs as `data:` URI, at the times of the paper's Figures 3 and 4.
    #[serde(default)]
    pub picture: Option<String>,
}

impl CurvePoint {
    /// Whether the bias is significant and exceeds a fifth of the noise.
    pub fn is_biased(&self) -> bool {
        let noise = self.noise.map_or(0.0, |noise| noise.value);
        self.bias.is_some_and(|bias| bias.low > 0.0 && bias.value > 0.2 * noise)
    }
}

/// Time to an error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TimeToError {
    /// Relative error (95 % quantile): 0.05, 0.02, 0.01, 0.005.
    pub error: f64,
    /// Seconds; `None` if unknown.
    pub seconds: Option<Interval>,
    /// False if the time is predicted.
    pub measured: bool,
}

/// The best method of each cell of a coarse grid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RegionWinners {
    /// Render time of every method in seconds.
    pub seconds: f64,
    /// Columns and rows.
    pub grid: [usize; 2],
    /// Index into `Study::methods`, row-major from the top.
    pub winner: Vec<usize>,
    /// Ratio of the mean squared error of the second-best method to the best one's.
    pub margin: Vec<f64>,
}

/// Measurements of an effect of the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EffectPrice {
    /// Name as in `pointillist explain`.
    pub name: String,
    /// Whether the scene uses it.
    pub on: bool,
    /// Why it is on or off.
    pub reason: String,
    /// Time of a path with the effect over the time without.
    pub time: Option<Interval>,
    /// Fraction of the variance caused by the effect; negative if the variance is larger without it.
    pub variance: Option<f64>,
    /// Increase of the mean FLIP against the reference when it is left out.
    pub loss: Option<f64>,
    /// The picture without it, `data:` URI.
    pub picture: Option<String>,
}

/// Measurements of a display setting.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DisplayPrice {
    /// The group: `reconstruction`, `kernel`, `masking`, `filter`, `sums`, `variance`, `glare`.
    pub knob: String,
    /// The setting.
    pub setting: String,
    /// Whether it is the default.
    pub default: bool,
    /// GPU milliseconds per repaint, or per million samples if `per_sample`.
    pub milliseconds: Option<Interval>,
    /// Whether the milliseconds are per million samples.
    pub per_sample: bool,
    /// relMSE of the displayed linear picture at few samples (`samples_per_pixel`), against the reference.
    pub rel_mse: Option<f64>,
    /// FLIP of the same picture.
    pub flip: Option<f64>,
    /// Samples per pixel of the judged picture.
    pub samples_per_pixel: f64,
}

/// Measurements of a choice of arithmetic.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NumericPrice {
    /// Subject of the choice, such as `sums of the film`.
    pub choice: String,
    /// Names of the cheap and the more precise form.
    pub forms: [String; 2],
    /// Time of the exact form over that of the cheap one.
    pub time: Interval,
    /// Error of the cheap form over that of the exact one.
    pub error: Interval,
    /// Quantity measured as error.
    pub what: String,
}

/// Cost of a scheme that divides a run to estimate its error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SchemePrice {
    /// `2 independent randomisations`.
    pub name: String,
    /// Whether it is in use.
    pub used: bool,
    /// Error relative to an undivided run of as many samples.
    pub error: Interval,
    /// Stated error over the true one; 1 is honest.
    pub stated: Interval,
}

/// Accuracy of predictions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PredictionScore {
    /// Number of predictions with known outcomes.
    pub known: usize,
    /// Number of these whose 90 % interval contained the outcome.
    pub held: usize,
    /// Number of predictions not due when the run ended.
    pub open: usize,
    /// Geometric mean of predicted over true time.
    pub ratio: f64,
}

/// Accuracy of the errors stated by one method's renders, against the reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StatedErrors {
    /// The method.
    pub method: String,
    /// Number of pictures whose true error is known, that is, much larger than the reference's.
    pub pictures: usize,
    /// Number of these whose 90 % interval contained the true error at median, p95 and p99 of the picture.
    pub held: [usize; 3],
    /// Geometric mean of stated over true error at the 95 % quantile.
    pub ratio: Interval,
}

/// Rejected samples and brightness of one method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stability {
    /// The method.
    pub method: String,
    /// Paths checked.
    pub paths: u64,
    /// Rejected samples: cause, count, and command that replays the first.
    pub rejected: Vec<(String, u64, String)>,
    /// Mean luminance over that of the other unbiased methods.
    pub energy: Option<Interval>,
    /// Whether that differs from 1 by more than chance.
    #[serde(default)]
    pub alarm: bool,
    /// Whether the method is biased by design, so that its brightness may differ.
    #[serde(default)]
    pub biased: bool,
}
