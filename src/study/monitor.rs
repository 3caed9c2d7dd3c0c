//! Monitors the error of a picture while it is rendered: checkpoints, predictions, and whether the target is reached.

use crate::stream::{PathCounts, Sample};
use crate::study::apart::SamplesApart;
use crate::study::blur::{BlurSchedule, BlurWatch};
use crate::study::curve::{Checkpoint, PowerLaw};
use crate::study::error::{ErrorEstimate, OtherSamples, TileSubset};
use crate::study::error_tile::ReplicatePixel;
use crate::study::exact_replicates::ExactReplicates;
use crate::study::late::LateLight;
use crate::study::prediction::{
    LightClass, Prediction, PredictionOutcome, next_target, predict, time_reached,
};
use crate::study::replicates::Replicates;
use crate::study::witness::{WitnessState, Witnesses, unfound};

/// Samples per pixel at the first checkpoint.
const FIRST_CHECKPOINT: f64 = 4.0;

/// Ratio of samples between two checkpoints: each costs as much time as some thousand paths.
const CHECKPOINT_RATIO: f64 = 1.25;

/// The same ratio close to the target.
const CLOSE_CHECKPOINT_RATIO: f64 = 1.05;

/// Predictions are scored only if they look ahead by this factor of time.
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

/// The error at which a render may stop.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ErrorTarget {
    /// Relative error.
    pub error: f64,
    /// The quantile that must reach it.
    pub at: ErrorQuantile,
}

/// The error of a render as of its last checkpoint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ErrorStatus {
    /// Paths per pixel at the last checkpoint; 0 before the first.
    pub samples_per_pixel: f64,
    /// The error of the whole picture.
    pub estimate: ErrorEstimate,
    /// The error of the held-out tiles, which take no part in the decision to stop; of all tiles where there is no target.
    pub held_out: ErrorEstimate,
    /// The error so far.
    pub checkpoints: Vec<Checkpoint>,
    /// When the target, or the next round error, will be reached.
    pub prediction: Option<Prediction>,
    /// The deciding tiles have reached the target.
    pub reached: bool,
    /// Number of columns of tiles, and the relative error of each tile.
    pub map: (usize, Vec<f64>),
    /// What is known of light that has not been found.
    pub late: LateLight,
    /// The share of the squared relative error that is the blur of photons, which is part of all these errors; `None` where it is not known, or may
    /// be noise and is in the upper ends of the intervals alone, or the method has none.
    pub blur: Option<f64>,
}

impl ErrorStatus {
    /// What the light of the picture is like.
    pub fn light(&self) -> LightClass {
        let is_late = self.late.unfound().is_some() || self.late.warning().is_some();
        match self.blur {
            Some(blur) if blur > BLURRED => LightClass::Blurred,
            _ if is_late => LightClass::Late,
            _ => LightClass::Ordinary,
        }
    }
}

/// A picture counts as blurred from this share of its squared error on.
const BLURRED: f64 = 0.1;

/// How far an [`ErrorMonitor`] has come, so that another one stops where it would have stopped.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct MonitorProgress {
    /// The error so far.
    pub checkpoints: Vec<Checkpoint>,
    /// Paths at the next checkpoint; `None` before a monitor has begun.
    pub due: Option<f64>,
}

/// Takes the samples of one render and keeps its [`ErrorStatus`].
#[derive(Debug)]
pub struct ErrorMonitor {
    sums: Replicates,
    /// What `sums` are rounded from when they are read, where a render keeps exact sums.
    exact: Option<ExactReplicates>,
    target: Option<ErrorTarget>,
    at: ErrorQuantile,
    status: ErrorStatus,
    predictions: Vec<Prediction>,
    witnesses: Option<WitnessState>,
    blur: Option<BlurWatch>,
    /// The method blurs, also where its blur is not known.
    blurs: bool,
    /// Some of the samples of each replicate, where they are kept apart.
    apart: Option<SamplesApart>,
    /// What is shown is the mean of this render's picture and these.
    others: Vec<OtherSamples>,
    /// Paths of those among them that cover the whole picture.
    base: f64,
    /// Part of the paths that begins within the picture.
    coverage: f64,
    /// Paths at the next checkpoint.
    due: f64,
}

impl ErrorMonitor {
    /// Monitors a picture of `size` pixels whose film has a filter of this [energy](Replicates::new).
    pub fn new(size: [u32; 2], energy: f32, target: Option<ErrorTarget>) -> Self {
        let pixels = f64::from(size[0]) * f64::from(size[1]);
        Self {
            sums: Replicates::new(size, energy),
            exact: None,
            at: target.map(|target| target.at).unwrap_or_default(),
            target,
            status: ErrorStatus::default(),
            predictions: Vec::new(),
            witnesses: None,
            blur: None,
            blurs: false,
            apart: None,
            others: Vec::new(),
            base: 0.0,
            coverage: 1.0,
            due: FIRST_CHECKPOINT * pixels,
        }
    }

    /// The same for samples whose weights are one over their density.
    pub fn with_density_weights(mut self) -> Self {
        self.sums.set_density_weights();
        self
    }

    /// The same for a method that blurs less and less: the error counts its blur.
    pub fn with_blur(self, schedule: BlurSchedule) -> Self {
        Self { blur: Some(BlurWatch::new(schedule)), ..self }
    }

    /// The same for a method that blurs or not, by which its error falls more or less slowly.
    pub fn that_blurs(self, blurs: bool) -> Self {
        Self { blurs, ..self }
    }

    /// From now on some of the samples of each replicate are kept apart as well.
    pub fn keep_apart(&mut self) {
        self.round();
        self.apart = Some(match self.sums.paths() {
            0 => SamplesApart::half_to_come(&self.sums),
            _ => SamplesApart::so_far(&self.sums),
        });
    }

    /// The samples that were kept apart; none are from now on.
    pub fn take_apart(&mut self) -> Option<SamplesApart> {
        self.apart.take()
    }

    /// The same with exact sums, which go on from what another monitor has seen.
    pub fn exact(self, sums: ExactReplicates, seen: MonitorProgress) -> Self {
        let MonitorProgress { checkpoints, due } = seen;
        let due = due.unwrap_or(self.due);
        // A state does not hold the moments from which blur is known, and whoever goes on with it has to state the same error.
        let blur = None;
        Self { exact: Some(sums), blur, due, status: ErrorStatus { checkpoints, ..self.status }, ..self }
    }

    /// The exact sums, if there are any, and what it takes to go on with them in another monitor.
    pub fn progress(&self) -> Option<(ExactReplicates, MonitorProgress)> {
        let seen = MonitorProgress { checkpoints: self.status.checkpoints.clone(), due: Some(self.due) };
        Some((self.exact.clone()?, seen))
    }

    /// From now on the stated error counts what these witnesses find and the picture lacks.
    pub fn set_witnesses(&mut self, witnesses: Witnesses) {
        self.witnesses = Some(WitnessState::new(witnesses));
    }

    /// The witnesses that were set, for a monitor of the same render.
    pub fn take_witnesses(&mut self) -> Option<Witnesses> {
        self.witnesses.take().map(WitnessState::into_witnesses)
    }

    /// The same where only this part of the paths begins within the picture: the others lie around it, for the film's filter.
    pub fn with_coverage(self, coverage: f64) -> Self {
        Self { coverage, ..self }
    }

    /// What is shown is from now on, within a rectangle, the mean of the picture of this render and of these samples, each with the
    /// share of its paths. `seconds` after the render began the error is another one.
    pub fn add_others(&mut self, others: OtherSamples, seconds: f64) {
        let is_whole = others.origin == [0, 0] && others.size == self.sums.size();
        if is_whole {
            self.base += others.per_pixel.iter().map(|n| f64::from(*n)).sum::<f64>() / self.coverage;
        }
        self.others.push(others);
        // The errors before are those of another picture: no curve leads from them to the next one.
        let had_any = !std::mem::take(&mut self.status.checkpoints).is_empty();
        if is_whole || had_any {
            self.take_checkpoint(seconds);
        }
    }

    /// What is shown of a rectangle of the picture from the pixel `first` on, for a monitor of that rectangle alone; `None` before each
    /// replicate has traced a path.
    pub fn shown(&mut self, first: [usize; 2], size: [usize; 2]) -> Option<OtherSamples> {
        self.round();
        let [width, height] = self.sums.size();
        let (pixels, per_pixel) = self.pixels()?;
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

    /// What this render alone shows, for a monitor of a picture in which it begins at the pixel `origin`; `None` as above.
    pub fn own(&mut self, origin: [i64; 2]) -> Option<OtherSamples> {
        self.round();
        let (size, pixels) = (self.sums.size(), self.sums.pixels()?);
        let per_pixel = vec![self.per_pixel(); pixels.len()];
        Some(OtherSamples { origin, size, pixels, per_pixel })
    }

    /// Paths of this render per pixel.
    fn per_pixel(&self) -> f32 {
        let [width, height] = self.sums.size();
        (self.paths() * self.coverage / (width * height) as f64) as f32
    }

    /// Mean and difference of the replicates in every pixel of what is shown, and its paths per pixel.
    fn pixels(&self) -> Option<(Vec<ReplicatePixel>, Vec<f32>)> {
        let [width, height] = self.sums.size();
        let unseen = || (!self.others.is_empty()).then(|| vec![ReplicatePixel::default(); width * height]);
        let mut pixels = self.sums.pixels().or_else(unseen)?;
        let mut per_pixel = vec![self.per_pixel(); pixels.len()];
        self.others.iter().for_each(|others| others.mix_into(&mut pixels, width, &mut per_pixel));
        Some((pixels, per_pixel))
    }

    /// Paths of what is shown, where others cover all of it.
    fn samples(&self) -> f64 {
        self.paths() + self.base
    }

    /// Sets another target at the same quantile and predicts it from the checkpoints so far.
    pub fn set_target(&mut self, target: Option<ErrorTarget>) {
        self.target = target;
        self.status.reached = false;
        if let Some(&Checkpoint { samples, error, .. }) = self.status.checkpoints.last() {
            self.update_prediction(samples, error);
        }
    }

    /// Adds a block; see [`Replicates::add`].
    pub fn add(&mut self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        if let Some(blur) = &mut self.blur {
            blur.add(first_index, paths);
        }
        if let Some(apart) = &mut self.apart {
            apart.add(first_index, paths, samples);
        }
        match &mut self.exact {
            Some(exact) => exact.add(first_index, paths, samples),
            None => self.sums.add(first_index, paths, samples),
        }
    }

    /// True when there are enough new samples for a checkpoint.
    pub fn is_due(&self) -> bool {
        self.samples() >= self.due
    }

    fn paths(&self) -> f64 {
        self.exact.as_ref().map_or_else(|| self.sums.paths(), ExactReplicates::paths) as f64
    }

    fn round(&mut self) {
        if let Some(exact) = &self.exact {
            self.sums = exact.rounded();
        }
    }

    /// The status as of the last checkpoint.
    pub fn status(&self) -> &ErrorStatus {
        &self.status
    }

    /// The sums of the replicates.
    pub fn replicates(&mut self) -> &Replicates {
        self.round();
        &self.sums
    }

    /// Estimates the error, `seconds` after the render began, and updates the prediction.
    pub fn take_checkpoint(&mut self, seconds: f64) {
        self.round();
        let samples = self.samples();
        self.due = samples.max(1.0) * CHECKPOINT_RATIO;
        let size = self.sums.size();
        let Some((pixels, _)) = self.pixels() else { return };
        let others = self.base * self.coverage / (size[0] * size[1]) as f64;
        let per_pixel = self.sums.per_pixel() + others;
        let Some((mut field, largest)) = self.sums.error_with(&pixels, per_pixel) else { return };
        if let Some(witnesses) = &mut self.witnesses {
            witnesses.update(samples, size, self.target.is_some());
        }
        let largest_samples = &self.sums.largest;
        let energy = self.sums.kernel().energy();
        let unfound = unfound(self.witnesses.as_ref(), &pixels, size, largest_samples, per_pixel, energy);
        self.status.late = LateLight {
            largest,
            missing: unfound.share,
            caustics: unfound.caustics,
            highlights: unfound.in_highlights,
        };
        field.add_unfound(unfound);
        // What is shown besides this render has another blur.
        let own = self.blur.as_mut().filter(|_| self.others.is_empty());
        let blur = own.and_then(|blur| blur.update(&self.sums));
        self.status.blur = blur.and_then(|blur| field.add_blur(blur));
        let estimate = field.estimate(TileSubset::All);
        let error = estimate.relative[self.at.index()];
        // A picture that is still black has no small error.
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
            // Never at the first checkpoint: light that few paths find may be missing from it. Nor while more is known to be missing.
            let is_complete = status.late.missing.is_none_or(|missing| missing <= target.error);
            status.reached |=
                status.checkpoints.len() > 1 && deciding > 0.0 && deciding <= target.error && is_complete;
        }
        self.update_prediction(samples, error.value);
    }

    /// Predicts, and brings the next checkpoint forward where the target is close.
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

    /// The predictions that count and their outcomes, now that the render has ended after `seconds`.
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
            // While the blur of a method that blurs is not known, the light may be of any class.
            light: (self.blur.is_none() || self.status.blur.is_some()).then(|| self.status.light()),
        };
        // One for each doubling of time: many predictions are made from nearly the same checkpoints.
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
