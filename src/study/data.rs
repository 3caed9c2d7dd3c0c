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
    /// Where it was measured. A study is not continued on another machine.
    pub machine: Machine,
    /// The commands that repeat it, one per line.
    pub command: String,
    /// Seconds to load and prepare the scene, which are part of no curve.
    pub load_seconds: f64,
    /// The reference of all errors.
    pub reference: Option<ReferenceImage>,
    /// Parts 1 and 2: the curve and the times to errors of each method, other programs included.
    pub methods: Vec<MethodResult>,
    /// What `--integrator auto` chooses here.
    pub auto: Option<AutoChoice>,
    /// Methods that were not measured to the end, and why.
    pub dropped: Vec<DroppedMethod>,
    /// Width and height of the trials from which errors are known before the picture itself has got so many samples; `None` where the
    /// picture is small enough itself.
    pub trial_size: Option<[u32; 2]>,
    /// What each machine of several needs besides rendering.
    pub farm: FarmCost,
    /// The best method of each region at equal time.
    pub regions: Option<RegionWinners>,
    /// Part 3: costs of effects.
    pub effects: Vec<EffectPrice>,
    /// Speed of the specialised code over that of the code for all effects.
    pub unused_effects: Option<Interval>,
    /// Part 3, continued: costs of options of `render`.
    pub options: Vec<OptionPrice>,
    /// Part 4: costs of display settings.
    pub display: Vec<DisplayPrice>,
    /// Part 5: costs of exact arithmetic.
    pub numeric: Vec<NumericPrice>,
    /// The cost of knowing the error, by way of dividing a run.
    pub schemes: Vec<SchemePrice>,
    /// Part 6: how predictions held.
    pub predictions: Option<PredictionScore>,
    /// How often stated errors held, by method.
    #[serde(default)]
    pub stated: Vec<StatedErrors>,
    /// Part 7: rejected samples and brightness.
    pub stability: Vec<Stability>,
    /// Parts that were requested but are missing, because the run was interrupted or its budget was spent.
    pub missing: Vec<String>,
}

/// What `--integrator auto` chooses after its trial.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AutoChoice {
    /// The method.
    pub method: String,
    /// Why.
    pub reason: String,
    /// Seconds that the trial takes.
    pub seconds: f64,
}

/// A method that was not measured to the end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DroppedMethod {
    /// The method.
    pub method: String,
    /// Why, as the end of a sentence: `takes at least 4 times as long as path`.
    pub reason: String,
}

/// What each of several machines needs besides rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FarmCost {
    /// Seconds to read and prepare the scene and to write the state of a part.
    pub setup: f64,
    /// Seconds to merge the state of one part.
    pub merge: f64,
}

impl FarmCost {
    /// Seconds on so many machines of what takes `alone` on one.
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
    /// Seconds that both renders had.
    pub seconds: f64,
    /// Width and height of both pictures: those of a trial, if there are trials.
    pub size: [u32; 2],
    /// Its paths over those without it.
    pub paths: Option<f64>,
    /// Its relative error at 95 % of the picture over that without it.
    pub error: Option<Interval>,
    /// Mean FLIP of the displayed picture with it and without.
    pub flip: Option<[f64; 2]>,
}

/// The machine.
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

/// The reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReferenceImage {
    /// The file.
    pub file: String,
    /// How it was made: a method, or “given”.
    pub made_by: String,
    /// Seconds that it took; 0 if it was given.
    pub seconds: f64,
    /// Samples per pixel; 0 if unknown.
    pub samples_per_pixel: f64,
    /// Its mean luminance, where it was given: the audit of brightness compares with it. 0 for one that the study has made.
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
    /// Another program.
    pub peer: bool,
    /// In order of time.
    pub points: Vec<CurvePoint>,
    /// Relative RMS error against seconds: slope of the logarithms.
    pub slope: Option<Interval>,
    /// The same against samples.
    pub slope_samples: Option<Interval>,
    /// The method is biased by design: it blurs, less and less.
    #[serde(default)]
    pub biased: bool,
    /// Share of the light that the method has not found, as far as other methods show it significantly.
    #[serde(default)]
    pub missing: f64,
    /// Warnings, such as “slope flatter than −0.4: heavy tail or bias”.
    pub flags: Vec<String>,
    /// Times to relative errors, from the largest error down.
    pub prices: Vec<TimeToError>,
    /// 1/(variance · second), relMSE units.
    pub efficiency: Option<Interval>,
    /// Pictures at the time that all methods share, as `data:` URIs: as displayed, and the FLIP error map.
    pub picture: Option<String>,
    /// See `picture`.
    pub error_map: Option<String>,
}

/// One point of a curve.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    /// Seconds that were asked for.
    pub budget: f64,
    /// Wall-clock seconds of rendering: tracing and splatting, which run side by side.
    pub seconds: f64,
    /// Seconds of processor time spent tracing.
    pub trace_seconds: f64,
    /// Seconds of the client's time spent splatting.
    pub splat_seconds: f64,
    /// Seconds from sums to displayed picture.
    pub display_seconds: f64,
    /// Paths per pixel.
    pub samples_per_pixel: f64,
    /// Independent runs in the figures.
    pub runs: usize,
    /// relMSE, without the reference's own; `None` where pixels have no sample.
    pub rel_mse: Option<Interval>,
    /// The same without the worst 0.1 % of pixels.
    pub rel_mse_trimmed: Option<Interval>,
    /// The part of `rel_mse` that is noise, from replicates; `None` for other programs, which have none.
    pub noise: Option<Interval>,
    /// The part that is bias: `rel_mse − noise`.
    pub bias: Option<Interval>,
    /// Relative error that half, 95 % and 99 % of the picture (8×8 pixels each) stay below, without the reference's own; `None` where
    /// pixels have no sample.
    pub relative: Option<[Interval; 3]>,
    /// The same errors as the replicates state them without a reference; `None` for other programs.
    #[serde(default)]
    pub stated: Option<[Interval; 3]>,
    /// SMAPE; of one run, without an interval.
    pub smape: Option<Interval>,
    /// Mean FLIP of the displayed picture; of one run, without an interval.
    pub flip: Option<Interval>,
    /// The same of the picture that is displayed through the noise filter; `None` for other programs.
    #[serde(default)]
    pub flip_filtered: Option<Interval>,
    /// The displayed picture of one of the runs as `data:` URI, at the times of the paper's Figures 3 and 4.
    #[serde(default)]
    pub picture: Option<String>,
}

impl CurvePoint {
    /// True where the bias is significant and larger than a fifth of the noise.
    pub fn is_biased(&self) -> bool {
        let noise = self.noise.map_or(0.0, |noise| noise.value);
        self.bias.is_some_and(|bias| bias.low > 0.0 && bias.value > 0.2 * noise)
    }
}

/// Time to an error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TimeToError {
    /// Relative error at 95 % of the picture: 0.05, 0.02, 0.01, 0.005.
    pub error: f64,
    /// Seconds; `None` where nothing tells the time.
    pub seconds: Option<Interval>,
    /// False when the time is predicted.
    pub measured: bool,
}

/// The best method of each cell of a coarse grid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RegionWinners {
    /// Seconds that every method had.
    pub seconds: f64,
    /// Columns and rows.
    pub grid: [usize; 2],
    /// Index into `Study::methods`, row by row from the top.
    pub winner: Vec<usize>,
    /// How much larger the mean square error of the second best is.
    pub margin: Vec<f64>,
}

/// An effect of the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EffectPrice {
    /// As `pointillist explain` calls it.
    pub name: String,
    /// The scene uses it.
    pub on: bool,
    /// Why it is on or off.
    pub reason: String,
    /// Time of a path with it over the time without.
    pub time: Option<Interval>,
    /// Share of the variance that it causes; negative if the variance is larger without it.
    pub variance: Option<f64>,
    /// By how much the mean FLIP against the reference grows when it is left out.
    pub loss: Option<f64>,
    /// The picture without it, `data:` URI.
    pub picture: Option<String>,
}

/// A setting of the display.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DisplayPrice {
    /// The group: `reconstruction`, `kernel`, `masking`, `filter`, `sums`, `variance`, `glare`.
    pub knob: String,
    /// The setting.
    pub setting: String,
    /// It is the default.
    pub default: bool,
    /// Milliseconds of the device per repaint, or per million samples where `per_sample`.
    pub milliseconds: Option<Interval>,
    /// The milliseconds are for a million samples.
    pub per_sample: bool,
    /// relMSE of the displayed linear picture at few samples (`samples_per_pixel`), against the reference.
    pub rel_mse: Option<f64>,
    /// FLIP of the same.
    pub flip: Option<f64>,
    /// Samples per pixel of the picture that was judged.
    pub samples_per_pixel: f64,
}

/// A choice of arithmetic.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct NumericPrice {
    /// What is chosen: `sums of the film`.
    pub choice: String,
    /// The cheap form and the more exact one.
    pub forms: [String; 2],
    /// Time of the exact form over that of the cheap one.
    pub time: Interval,
    /// Error of the cheap form over that of the exact one.
    pub error: Interval,
    /// What is measured as error.
    pub what: String,
}

/// The cost of a way to divide a run so that its error is known.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SchemePrice {
    /// `2 independent randomisations`.
    pub name: String,
    /// It is in use.
    pub used: bool,
    /// Error over that of an undivided run of as many samples.
    pub error: Interval,
    /// Stated error over the true one; 1 is honest.
    pub stated: Interval,
}

/// How often predictions held.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PredictionScore {
    /// Predictions whose outcome is known.
    pub known: usize,
    /// Those whose 90 % interval held.
    pub held: usize,
    /// Predictions that were not due when the run ended.
    pub open: usize,
    /// Predicted over true time, geometric mean.
    pub ratio: f64,
}

/// How often the errors that the renders of one method stated held against the reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StatedErrors {
    /// The method.
    pub method: String,
    /// Pictures whose true errors are known: those of the reference are much smaller.
    pub pictures: usize,
    /// Those whose 90 % interval held at median, p95 and p99 of the picture.
    pub held: [usize; 3],
    /// Stated over true error of 95 % of the picture, geometric mean.
    pub ratio: Interval,
}

/// The samples of one method.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stability {
    /// The method.
    pub method: String,
    /// Paths checked.
    pub paths: u64,
    /// Samples that were not finite: cause, count, command that replays the first.
    pub rejected: Vec<(String, u64, String)>,
    /// Mean luminance over that of the other unbiased methods.
    pub energy: Option<Interval>,
    /// That differs from 1 by more than chance.
    #[serde(default)]
    pub alarm: bool,
    /// The method is biased by design, so that its brightness may differ.
    #[serde(default)]
    pub biased: bool,
}
