//! The initial state of the accounts of a run: its sums, the monitor of its error, and the log of its predictions.

use std::sync::Arc;

use miette::{IntoDiagnostic, Result, WrapErr};

use crate::accounting::accumulator::CheckpointPolicy;
use crate::accounting::observer::{ObservedRender, Observer};
use crate::client::{Denoise, Film};
use crate::denoise::filtered_picture::{FilteredPicture, FilteredView};
use crate::denoise::view_filter::OidnOptions;
use crate::render::predictions;
use crate::render::run_spec::RunSpec;
use crate::scene::desc::PhotonUse;
use crate::study::blur::BlurSchedule;
use crate::study::prediction::PredictionOutcome;
use crate::study::{
    AccumulatedSamples, ErrorEstimate, ErrorMonitor, ErrorQuantile, ErrorStatus, ErrorTarget,
    ExactReplicates, MonitorProgress,
};
use crate::tracer::integrator::{LAST_GENERATION, SAMPLES_PER_GENERATION};

/// The initial state of the accounts of a run, which must be divided into replicates.
pub fn observed(run: &RunSpec, target: Option<ErrorTarget>, policy: CheckpointPolicy) -> ObservedRender {
    let size = [run.film.width, run.film.height];
    let mut monitor =
        ErrorMonitor::new(size, target).with_coverage(run.film.coverage()).that_blurs(run.is_blurred());
    let mut samples = AccumulatedSamples::new(size, run.film.filter.energy());
    // Samples that both eyes share have weights of multiple importance sampling, which are densities, too.
    if run.adaptive || run.stereo.is_some() && run.integrator.streams()[0] {
        samples.set_density_weights();
    }
    if let Some(schedule) = blur(run, policy) {
        (monitor, samples) = (monitor.with_blur(), samples.with_blur(schedule));
    }
    let run = run.clone();
    ObservedRender { monitor, samples, log: Box::new(move |outcomes| predictions::log(&run, outcomes)) }
}

/// Starts observing a run, which must be divided into replicates.
pub fn observe(run: &RunSpec, target: Option<ErrorTarget>, policy: CheckpointPolicy) -> Result<Observer> {
    start(observed(run, target, policy), target, policy)
}

/// Resumes observing a render without a window from its saved exact sums.
pub fn resume(
    run: &RunSpec,
    target: Option<ErrorTarget>,
    sums: ExactReplicates,
    seen: MonitorProgress,
) -> Result<Observer> {
    let policy = CheckpointPolicy::Exact;
    let ObservedRender { monitor, samples, log } = observed(run, target, policy);
    let (monitor, samples) = (monitor.resumed(seen), samples.exact(sums));
    start(ObservedRender { monitor, samples, log }, target, policy)
}

fn start(render: ObservedRender, target: Option<ErrorTarget>, policy: CheckpointPolicy) -> Result<Observer> {
    let observer = Observer::start(render, target, policy).into_diagnostic();
    observer.wrap_err("cannot start the threads that watch the error; --replicates 1 does without")
}

/// What is known of a picture whose render has ended.
#[derive(Default)]
pub struct ObservedPicture {
    /// Its error and outcomes of predictions; `None` with a single randomisation.
    pub error: Option<(Arc<ErrorStatus>, Vec<PredictionOutcome>)>,
    /// Accumulated samples, for the noise filter.
    pub accumulated: Option<AccumulatedSamples>,
}

impl ObservedPicture {
    /// Ends the observation, if there is one; `filters`: the picture is denoised.
    pub fn end(observer: Option<Observer>, filters: bool) -> Self {
        let filtered = observer.as_ref().filter(|_| filters);
        let accumulated = filtered.and_then(Observer::accumulated);
        Self { error: observer.map(|observer| observer.end()), accumulated }
    }

    /// The state of its error, if known.
    pub fn status(&self) -> Option<&ErrorStatus> {
        self.error.as_ref().map(|(status, _)| &**status)
    }

    /// This picture or that of the other eye, if there is one: that with the larger error at a quantile, which decides when a render ends.
    pub fn worse<'a>(&'a self, other: Option<&'a Self>, at: ErrorQuantile) -> &'a Self {
        let error = |picture: &Self| picture.status().map(|state| state.estimate.relative[at.index()].value);
        other.filter(|other| error(other) > error(self)).unwrap_or(self)
    }

    /// Logs the outcomes of the predictions of its error.
    pub fn log_predictions(&self, run: &RunSpec) {
        if let Some((_, outcomes)) = &self.error {
            predictions::log(run, outcomes);
        }
    }

    /// The denoised picture, if samples are kept for it, and its error, if it can be stated. `view` is that of the picture, and `film` has its samples.
    ///
    /// # Errors
    ///
    /// When the film cannot be read, and those of [`FilteredView::filter`].
    pub fn filter(
        &self,
        view: FilteredView<'_>,
        run: &RunSpec,
        film: &mut dyn Film,
        kind: Denoise,
        oidn: OidnOptions,
    ) -> Result<(Option<FilteredPicture>, Option<ErrorEstimate>)> {
        let Some(accumulated) = &self.accumulated else { return Ok((None, None)) };
        let data = film.develop().into_diagnostic()?;
        // If the estimate would not cover all of the error, it is not worth its time.
        let wants_error = self.status().is_some_and(|state| run.states_filtered_error(state));
        let apart = accumulated.apart().filter(|_| wants_error);
        let filtered = view.filter(&accumulated.replicates(), apart, &data, kind, oidn);
        let (picture, error) = filtered.into_diagnostic()?;
        Ok((Some(picture), error))
    }
}

/// Schedule of the photon radius of this render; `None` without photons, and if it may begin with the photon maps of the last render.
fn blur(run: &RunSpec, policy: CheckpointPolicy) -> Option<BlurSchedule> {
    let last_generation = match run.integrator.traits().photons {
        PhotonUse::Gathered if run.deterministic || policy == CheckpointPolicy::Exact => LAST_GENERATION,
        // Only a small fraction of its light paths store photons.
        PhotonUse::Merged if run.photons.caustics => u64::MAX,
        _ => return None,
    };
    Some(BlurSchedule {
        samples_per_generation: SAMPLES_PER_GENERATION,
        samples_per_index: run.integrator.paths_per_index(),
        alpha: run.photons.alpha.unwrap_or(0.0),
        last_generation,
    })
}
