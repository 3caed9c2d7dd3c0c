//! Monitors the error of a picture while it is rendered: checkpoints, predictions, and whether the target is reached.

use crate::study::accumulated::AccumulatedSamples;
use crate::study::blur::BlurWatch;
use crate::study::curve::{Checkpoint, PowerLaw};
use crate::study::error::{ErrorEstimate, OtherSamples, TileSubset};
use crate::study::error_tile::ReplicatePixel;
use crate::study::late::LateLight;
use crate::study::prediction::{
    LightClass, Prediction, PredictionOutcome, next_target, predict, time_reached,
};
use crate::study::replicates::Replicates;
use crate::study::witness::{WitnessState, Witnesses, unfound};

/// Samples per pixel at the first checkpoint.
const FIRST_CHECKPOINT: f64 = 4.0;

/// Ratio of samples between checkpoints; each costs as much time as some thousand paths.
const CHECKPOINT_RATIO: f64 = 1.25;

/// Ratio of samples between checkpoints close to the target.
const CLOSE_CHECKPOINT_RATIO: f64 = 1.05;

/// Least ratio of predicted to elapsed time of a scored prediction.
const SCORED_RATIO: f64 = 1.25;

/// The quantile of the picture's errors that one number stands for. The comments are the help of `--error-at`.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Default, clap::ValueEnum, serde::Serialize, serde::Deserialize,
)]
pub enum ErrorQuantile {
    /// Median error.
    Median,
    /// The error that 95 % of the picture stays below.
    #[default]
    P95,
    /// The error that 99 % of the picture stays below.
    P99,
}

impl ErrorQuantile {
    /// Index into [`ErrorEstimate::relative`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// The share of the picture in words: `95 %`.
    pub fn share(self) -> &'static str {
        ["50 %", "95 %", "99 %"][self.index()]
    }
}

/// Error target of a render.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ErrorTarget {
    /// Relative error.
    pub error: f64,
    /// The quantile that must reach it.
    pub at: ErrorQuantile,
}

/// Error of a render at its last checkpoint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ErrorStatus {
    /// Paths per pixel at the last checkpoint; 0 before the first.
    pub samples_per_pixel: f64,
    /// Error estimate over all tiles.
    pub estimate: ErrorEstimate,
    /// Error estimate over the held-out tiles, which do not influence the decision to stop; over all tiles without a target.
    pub held_out: ErrorEstimate,
    /// Errors at all checkpoints so far.
    pub checkpoints: Vec<Checkpoint>,
    /// Predicted time to the target, or to the next round error.
    pub prediction: Option<Prediction>,
    /// Whether the deciding tiles have reached the target.
    pub reached: bool,
    /// Number of columns of tiles, and relative error of each tile.
    pub map: (usize, Vec<f64>),
    /// Indicators of light that has not been found.
    pub late: LateLight,
    /// Fraction of the squared relative error due to photon blur, which all these errors include. `None` if the method has no blur, and if
    /// the blur is unknown or insignificant; then only the upper ends of the intervals include it.
    pub blur: Option<f64>,
}

impl ErrorStatus {
    /// Class of the picture's light.
    pub fn light(&self) -> LightClass {
        let is_late = self.late.unfound().is_some() || self.late.warning().is_some();
        match self.blur {
            Some(blur) if blur > BLURRED => LightClass::Blurred,
            _ if is_late => LightClass::Late,
            _ => LightClass::Ordinary,
        }
    }
}

/// A picture counts as blurred from this fraction of its squared error on.
const BLURRED: f64 = 0.1;

/// Progress of an [`ErrorMonitor`], from which another one can resume with the same decisions.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MonitorProgress {
    /// Errors at all checkpoints so far.
    pub checkpoints: Vec<Checkpoint>,
    /// Number of paths at the next checkpoint; `None` before a monitor has started.
    pub due: Option<f64>,
}

/// Looks at the [accumulated samples](AccumulatedSamples) of one render now and then and updates its [`ErrorStatus`].
#[derive(Debug)]
pub struct ErrorMonitor {
    /// Width and height of the picture in pixels.
    size: [usize; 2],
    target: Option<ErrorTarget>,
    at: ErrorQuantile,
    status: ErrorStatus,
    predictions: Vec<Prediction>,
    witnesses: Option<WitnessState>,
    blur: Option<BlurWatch>,
    /// Whether the method has photon blur, known or not.
    blurs: bool,
    /// Other samples; the displayed picture is the mean of this render and these.
    others: Vec<OtherSamples>,
    /// Number of paths among these that cover the whole picture.
    base: f64,
    /// Fraction of the paths that start within the picture.
    coverage: f64,
    /// Number of paths at the next checkpoint.
    due: f64,
}

impl ErrorMonitor {
    /// A monitor of a picture of `size` pixels.
    pub fn new(size: [u32; 2], target: Option<ErrorTarget>) -> Self {
        let pixels = f64::from(size[0]) * f64::from(size[1]);
        Self {
            size: size.map(|n| n as usize),
            at: target.map(|target| target.at).unwrap_or_default(),
            target,
            status: ErrorStatus::default(),
            predictions: Vec::new(),
            witnesses: None,
            blur: None,
            blurs: false,
            others: Vec::new(),
            base: 0.0,
            coverage: 1.0,
            due: FIRST_CHECKPOINT * pixels,
        }
    }

    /// As `self`, for a method whose photon blur follows the schedule that the [samples](AccumulatedSamples::with_blur) have: the error
    /// includes the blur.
    pub fn with_blur(self) -> Self {
        Self { blur: Some(BlurWatch::default()), ..self }
    }

    /// As `self`, for a method with or without photon blur, which determines the prior of the slope.
    pub fn that_blurs(self, blurs: bool) -> Self {
        Self { blurs, ..self }
    }

    /// As `self`, resuming with the progress of another monitor.
    pub fn resumed(self, seen: MonitorProgress) -> Self {
        let MonitorProgress { checkpoints, due } = seen;
        let due = due.unwrap_or(self.due);
        // A state does not contain the moments needed to estimate blur, and every resumed render must state the same error.
        let blur = None;
        Self { blur, due, status: ErrorStatus { checkpoints, ..self.status }, ..self }
    }

    /// The progress from which another monitor can resume.
    pub fn progress(&self) -> MonitorProgress {
        MonitorProgress { checkpoints: self.status.checkpoints.clone(), due: Some(self.due) }
    }

    /// Includes light that these witnesses find and the picture lacks in the stated error.
    pub fn set_witnesses(&mut self, witnesses: Witnesses) {
        self.witnesses = Some(WitnessState::new(witnesses));
    }

    /// Takes the witnesses, for a monitor of the same render.
    pub fn take_witnesses(&mut self) -> Option<Witnesses> {
        self.witnesses.take().map(WitnessState::into_witnesses)
    }

    /// As `self`, for a render in which only this fraction of the paths starts within the picture; the others surround it, for the film's
    /// filter.
    pub fn with_coverage(self, coverage: f64) -> Self {
        Self { coverage, ..self }
    }

    /// Averages the displayed picture within a rectangle with these other samples, weighted by paths; `seconds` after the render began, the
    /// error changes accordingly.
    pub fn add_others(&mut self, others: OtherSamples, samples: &AccumulatedSamples, seconds: f64) {
        let is_whole = others.origin == [0, 0] && others.size == self.size;
        if is_whole {
            self.base += others.per_pixel.iter().map(|n| f64::from(*n)).sum::<f64>() / self.coverage;
        }
        self.others.push(others);
        // Earlier errors belong to another picture and must not enter the fit.
        let had_any = !std::mem::take(&mut self.status.checkpoints).is_empty();
        if is_whole || had_any {
            self.take_checkpoint(samples, seconds);
        }
    }

    /// The displayed picture in a rectangle that begins at pixel `first`, for a monitor of that rectangle; `None` before each replicate has
    /// traced a path.
    pub fn shown(
        &self,
        samples: &AccumulatedSamples,
        first: [usize; 2],
        size: [usize; 2],
    ) -> Option<OtherSamples> {
        let [width, height] = self.size;
        let (pixels, per_pixel) = self.pixels(&samples.replicates())?;
        let rows = first[1]..(first[1] + size[1]).min(height);
        let columns = first[0]..(first[0] + size[0]).min(width);
        let places = || rows.clone().flat_map(|y| columns.clone().map(move |x| y * width + x));
        Some(OtherSamples {
            origin: [0, 0],
            size: [columns.len(), rows.len()],
            pixels: places().map(|i| pixels[i]).collect(),
            per_pixel: places().map(|i| per_pixel[i]).collect(),
        })
    }

    /// This render alone, for a monitor of a picture in which it begins at pixel `origin`; `None` as for [`shown`](Self::shown).
    pub fn own(&self, samples: &AccumulatedSamples, origin: [i64; 2]) -> Option<OtherSamples> {
        let pixels = samples.replicates().pixels()?;
        let per_pixel = vec![self.per_pixel(samples.paths()); pixels.len()];
        Some(OtherSamples { origin, size: self.size, pixels, per_pixel })
    }

    /// This many paths of the render, per pixel.
    fn per_pixel(&self, paths: u64) -> f32 {
        let [width, height] = self.size;
        (paths as f64 * self.coverage / (width * height) as f64) as f32
    }

    /// Mean and difference of the replicates per pixel of the displayed picture, and its paths per pixel.
    fn pixels(&self, sums: &Replicates) -> Option<(Vec<ReplicatePixel>, Vec<f32>)> {
        let [width, height] = self.size;
        let unseen = || (!self.others.is_empty()).then(|| vec![ReplicatePixel::default(); width * height]);
        let mut pixels = sums.pixels().or_else(unseen)?;
        let mut per_pixel = vec![self.per_pixel(sums.paths()); pixels.len()];
        self.others.iter().for_each(|others| others.mix_into(&mut pixels, width, &mut per_pixel));
        Some((pixels, per_pixel))
    }

    /// Sets another target at the same quantile and predicts it from the checkpoints so far.
    pub fn set_target(&mut self, target: Option<ErrorTarget>) {
        self.target = target;
        self.status.reached = false;
        if let Some(&Checkpoint { samples, error, .. }) = self.status.checkpoints.last() {
            self.update_prediction(samples, error);
        }
    }

    /// Number of paths of this render from which on a checkpoint is due.
    pub fn due(&self) -> f64 {
        self.due - self.base
    }

    /// Status at the last checkpoint.
    pub fn status(&self) -> &ErrorStatus {
        &self.status
    }

    /// Estimates the error of the picture of these samples, `seconds` after the render began, and updates the prediction.
    pub fn take_checkpoint(&mut self, samples: &AccumulatedSamples, seconds: f64) {
        let (sums, blurred) = (samples.replicates(), samples.blurred());
        // Those of others that cover the whole picture count as well.
        let samples = samples.paths() as f64 + self.base;
        self.due = samples.max(1.0) * CHECKPOINT_RATIO;
        let size = self.size;
        let Some((pixels, _)) = self.pixels(&sums) else { return };
        let others = self.base * self.coverage / (size[0] * size[1]) as f64;
        let per_pixel = sums.per_pixel() + others;
        let Some((mut field, largest)) = sums.error_with(&pixels, per_pixel) else { return };
        if let Some(witnesses) = &mut self.witnesses {
            witnesses.update(samples, size, self.target.is_some());
        }
        let energy = sums.kernel().energy();
        let unfound = unfound(self.witnesses.as_ref(), &pixels, size, &sums.largest, per_pixel, energy);
        self.status.late = LateLight {
            largest,
            missing: unfound.share,
            caustics: unfound.caustics,
            highlights: unfound.in_highlights,
        };
        field.add_unfound(unfound);
        // If other samples are displayed as well, their blur differs.
        let own = self.blur.as_mut().filter(|_| self.others.is_empty());
        let blur = own.and_then(|blur| blur.update(&sums, blurred));
        self.status.blur = blur.and_then(|blur| field.add_blur(blur));
        let estimate = field.estimate(TileSubset::All);
        let error = estimate.relative[self.at.index()];
        // An error of 0 means that the picture is still black.
        if error.value <= 0.0 || !error.value.is_finite() {
            return;
        }
        let deviation = ErrorEstimate::log_deviation(&error);
        let status = &mut self.status;
        status.checkpoints.push(Checkpoint { seconds, samples, error: error.value, deviation });
        status.samples_per_pixel = samples / (size[0] * size[1]) as f64;
        status.estimate = estimate;
        status.held_out = if self.target.is_some() { field.estimate(TileSubset::HeldOut) } else { estimate };
        status.map = (field.grid()[0], field.map());
        if let Some(target) = self.target {
            let deciding = field.estimate(TileSubset::Deciding).relative[target.at.index()].value;
            // Never at the first checkpoint, from which light found by few paths may be missing, nor while more light is known to be
            // missing.
            let is_complete = status.late.missing.is_none_or(|missing| missing <= target.error);
            status.reached |=
                status.checkpoints.len() > 1 && deciding > 0.0 && deciding <= target.error && is_complete;
        }
        self.update_prediction(samples, error.value);
    }

    /// Updates the prediction, and brings the next checkpoint forward if the target is close.
    fn update_prediction(&mut self, samples: f64, error: f64) {
        let target = self.target.map(|target| target.error).or_else(|| next_target(error));
        let (checkpoints, blurs) = (&self.status.checkpoints, self.blurs);
        self.status.prediction =
            target.filter(|target| error > *target).and_then(|target| predict(checkpoints, target, blurs));
        self.predictions.extend(self.status.prediction);
        if let (Some(target), Some(fit)) = (self.target, PowerLaw::new(checkpoints, blurs))
            && let Some((x, _)) = fit.until(target.error)
        {
            self.due = samples * x.exp().clamp(CLOSE_CHECKPOINT_RATIO, CHECKPOINT_RATIO);
        }
    }

    /// Scored predictions with their outcomes, for a render that ended after `seconds`.
    pub fn prediction_outcomes(&self, seconds: f64) -> Vec<PredictionOutcome> {
        let checkpoints = &self.status.checkpoints;
        let stopped = |prediction: &Prediction| {
            let wanted = self.target.is_some_and(|target| target.error == prediction.target);
            (wanted && self.status.reached).then_some(seconds)
        };
        let outcome = |&prediction: &Prediction| PredictionOutcome {
            prediction,
            reached: stopped(&prediction)
                .or_else(|| time_reached(checkpoints, prediction.target, prediction.at)),
            ended: seconds,
            // While the blur of a method with photon blur is unknown, so is the class of its light.
            light: (self.blur.is_none() || self.status.blur.is_some()).then(|| self.status.light()),
        };
        // One per doubling of time, since many predictions are made from nearly the same checkpoints.
        let mut scored: Vec<Prediction> = Vec::new();
        for new in &self.predictions {
            let before = scored.iter().rfind(|other| other.target == new.target);
            if new.seconds.value > SCORED_RATIO * new.at && before.is_none_or(|other| new.at > 2.0 * other.at)
            {
                scored.push(*new);
            }
        }
        scored.iter().map(outcome).collect()
    }
}
