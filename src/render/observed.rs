//! The initial state of the accounts of a run: its sums, the monitor of its error, and the log of its predictions.

use miette::{IntoDiagnostic, Result, WrapErr};

use crate::accounting::accumulator::CheckpointPolicy;
use crate::accounting::observer::{ObservedRender, Observer};
use crate::render::predictions;
use crate::render::run_spec::RunSpec;
use crate::scene::desc::PhotonUse;
use crate::study::blur::BlurSchedule;
use crate::study::{AccumulatedSamples, ErrorMonitor, ErrorTarget, ExactReplicates, MonitorProgress};
use crate::tracer::integrator::{LAST_GENERATION, SAMPLES_PER_GENERATION};

/// The initial state of the accounts of a run, which must be divided into replicates.
pub fn observed(run: &RunSpec, target: Option<ErrorTarget>, policy: CheckpointPolicy) -> ObservedRender {
    let size = [run.film.width, run.film.height];
    let mut monitor =
        ErrorMonitor::new(size, target).with_coverage(run.film.coverage()).that_blurs(run.is_blurred());
    let mut samples = AccumulatedSamples::new(size, run.film.filter.energy());
    if run.adaptive {
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
