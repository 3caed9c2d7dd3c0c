//! Watching a picture while it is rendered: its error now, its curve so far, and what to expect.

use crate::stream::{PathCounts, Sample};
use crate::study::curve::Look;
use crate::study::error::{ErrorField, Figures, Part};
use crate::study::prediction::{Kept, Prediction, next_target, predict, reached};
use crate::study::replicates::Replicates;

/// Samples between two looks, as a factor: each costs as much as some thousand paths.
const GROWTH: f64 = 1.25;

/// Near the target looks are closer.
const CLOSE: f64 = 1.05;

/// Predictions that are remembered look ahead by this factor of time at least.
const AHEAD: f64 = 1.25;

/// The first look, in samples per pixel.
const FIRST: f64 = 4.0;

/// Which error is meant where one number is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Quantity {
    /// Half of the picture is better.
    Median,
    /// 95 % of the picture are better.
    #[default]
    P95,
    /// 99 % are.
    P99,
}

impl Quantity {
    /// Place in [`Figures::relative`].
    pub fn index(self) -> usize {
        self as usize
    }

    /// For people: `95 %`.
    pub fn share(self) -> &'static str {
        ["50 %", "95 %", "99 %"][self.index()]
    }
}

/// What somebody wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Relative error.
    pub error: f64,
    /// At which quantile.
    pub at: Quantity,
}

/// What is known at a moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct State {
    /// Paths per pixel at the last look; the first has not been yet if 0.
    pub samples_per_pixel: f64,
    /// The error, from everything.
    pub figures: Figures,
    /// The same from the half that decided nothing.
    pub stated: Figures,
    /// The curve.
    pub looks: Vec<Look>,
    /// When the target, or the next round error, will be reached.
    pub prediction: Option<Prediction>,
    /// The target is reached, as the other half says.
    pub reached: bool,
    /// Relative error of every neighbourhood, and how many columns there are.
    pub map: (usize, Vec<f64>),
}

/// Watches one render.
#[derive(Debug)]
pub struct Watch {
    sums: Replicates,
    target: Option<Target>,
    at: Quantity,
    state: State,
    predictions: Vec<Prediction>,
    /// Paths at which to look again.
    due: f64,
}

impl Watch {
    /// Watches a picture of `size` pixels whose film's filter has this energy.
    pub fn new(size: [u32; 2], energy: f32, target: Option<Target>) -> Self {
        let pixels = f64::from(size[0]) * f64::from(size[1]);
        Self {
            sums: Replicates::new(size, energy),
            at: target.map(|target| target.at).unwrap_or_default(),
            target,
            state: State::default(),
            predictions: Vec::new(),
            due: FIRST * pixels,
        }
    }

    /// Another target at the same quantile; what has been seen stays, and is the base of another prediction.
    pub fn aim(&mut self, target: Option<Target>) {
        self.target = target;
        self.state.reached = false;
        if let Some(&Look { samples, error, .. }) = self.state.looks.last() {
            self.foretell(samples, error);
        }
    }

    /// Takes a block; see [`Replicates::add`].
    pub fn add(&mut self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        self.sums.add(first_index, paths, samples);
    }

    /// True when there is enough new to look at.
    pub fn is_due(&self) -> bool {
        self.sums.paths() as f64 >= self.due
    }

    /// What was known at the last look.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The sums.
    pub fn replicates(&self) -> &Replicates {
        &self.sums
    }

    /// Takes stock, `seconds` after the render began.
    pub fn look(&mut self, seconds: f64) {
        let samples = self.sums.paths() as f64;
        self.due = samples.max(1.0) * GROWTH;
        let size = self.sums.size();
        let field = self.sums.pixels().and_then(|pixels| ErrorField::new(&pixels, size));
        let Some(field) = field else { return };
        let figures = field.figures(Part::All);
        let error = figures.relative[self.at.index()];
        // Nothing has luminance yet: that is no small error.
        if error.value <= 0.0 || !error.value.is_finite() {
            return;
        }
        let look = Look { seconds, samples, error: error.value, deviation: Figures::log_deviation(&error) };
        self.state.looks.push(look);
        self.state.samples_per_pixel = samples / (size[0] * size[1]) as f64;
        self.state.figures = figures;
        self.state.stated = if self.target.is_some() { field.figures(Part::State) } else { figures };
        self.state.map = (field.grid()[0], field.map());
        if let Some(target) = self.target {
            let decided = field.figures(Part::Decide).relative[target.at.index()].value;
            // Twice, so that light that is found late has a chance.
            self.state.reached |= self.state.looks.len() > 1 && decided > 0.0 && decided <= target.error;
        }
        self.foretell(samples, error.value);
    }

    /// Predicts, and looks sooner where the target is near.
    fn foretell(&mut self, samples: f64, error: f64) {
        let target = self.target.map(|target| target.error).or_else(|| next_target(error));
        let looks = &self.state.looks;
        self.state.prediction =
            target.filter(|target| error > *target).and_then(|target| predict(looks, target));
        self.predictions.extend(self.state.prediction);
        let fit = crate::study::curve::Fit::new(looks);
        if let (Some(target), Some(fit)) = (self.target, fit)
            && let Some((x, _)) = fit.until(target.error)
        {
            self.due = samples * x.exp().clamp(CLOSE, GROWTH);
        }
    }

    /// Every prediction and what came of it, now that the render has ended after `seconds`.
    pub fn kept(&self, seconds: f64) -> Vec<Kept> {
        let looks = &self.state.looks;
        let stopped = |prediction: &Prediction| {
            let wanted = self.target.is_some_and(|target| target.error == prediction.target);
            (wanted && self.state.reached).then_some(seconds)
        };
        let kept = |&prediction: &Prediction| Kept {
            prediction,
            reached: stopped(&prediction).or_else(|| reached(looks, prediction.target, prediction.at)),
            ended: seconds,
        };
        // Those that look ahead, and not each of the many that were made from nearly the same looks.
        let mut told: Vec<Prediction> = Vec::new();
        for said in &self.predictions {
            let before = told.iter().rfind(|other| other.target == said.target);
            if said.seconds.value > AHEAD * said.at && before.is_none_or(|other| said.at > 2.0 * other.at) {
                told.push(*said);
            }
        }
        told.iter().map(kept).collect()
    }
}
