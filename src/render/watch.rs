//! A caller that watches a render from inside the process: another program that shows progress, takes pictures on the way, or ends it.

use std::ops::ControlFlow;
use std::time::Duration;

use miette::{IntoDiagnostic, Result};

use crate::client::{Film, Settings};
use crate::image::exr::Layers;
use crate::render::outputs::file_layers;
use crate::render::run_spec::{RunEnd, RunSpec};
use crate::study::{ErrorQuantile, ErrorStatus, Interval};

/// What is called now and then while a render goes on, at least every 20 ms; `Break` ends it with the picture so far.
pub type RenderWatcher<'a> = dyn FnMut(RenderMoment<'_>) -> ControlFlow<()> + 'a;

/// A render in progress.
pub struct RenderMoment<'a> {
    /// Share of the work that is done, 0 to 1; of a render to an error by its predicted time.
    pub share: f64,
    /// Paths per texel of the film so far.
    pub samples_per_pixel: f64,
    /// Time since the render began, without preparing the scene.
    pub elapsed: Duration,
    /// Relative error of the picture at the quantile of the goal, with its 90 % interval; `None` before it is known.
    pub error: Option<Interval>,
    film: &'a mut dyn Film,
    run: &'a RunSpec,
    settings: &'a Settings,
}

impl RenderMoment<'_> {
    /// The picture so far, as an EXR file of it would have it, without the layers that are traced at the end.
    ///
    /// # Errors
    ///
    /// When the film cannot be read.
    pub fn picture(&mut self) -> Result<Layers> {
        // In index order the film keeps its partial batch, so that its sums keep the same bits.
        self.film.keep_batch(self.run.deterministic);
        let data = self.film.develop().into_diagnostic();
        self.film.keep_batch(false);
        Ok(file_layers(&data?, self.run, &RunEnd::default(), &[], self.settings))
    }
}

/// The watcher of a render, with what it is told about.
pub struct RenderWatch<'a> {
    /// Called at every look.
    pub call: &'a mut RenderWatcher<'a>,
    /// The run.
    pub run: &'a RunSpec,
    /// How its picture is shown.
    pub settings: &'a Settings,
    /// Quantile of the error that is told.
    pub at: ErrorQuantile,
    /// Time of earlier stages of the render.
    pub before: Duration,
}

impl RenderWatch<'_> {
    /// Tells the caller; true if it ends the render. `share` of the work is done, `elapsed` is the time of this stage, and `texels` are those of the film.
    pub fn look(
        &mut self,
        film: &mut dyn Film,
        state: Option<&ErrorStatus>,
        share: f64,
        elapsed: Duration,
        texels: f64,
    ) -> bool {
        let known = state.filter(|state| !state.checkpoints.is_empty());
        let moment = RenderMoment {
            share,
            samples_per_pixel: film.counts().paths() as f64 / texels,
            elapsed: self.before + elapsed,
            error: known.map(|state| state.held_out.relative[self.at.index()]),
            film,
            run: self.run,
            settings: self.settings,
        };
        (self.call)(moment).is_break()
    }
}
