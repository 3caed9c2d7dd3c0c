//! `--integrator auto`: the method that suits the scene, chosen on all cores at once, and what is said about it.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

use serde::Serialize;

use super::run_spec::RunSpec;
use super::{method, tell};
use crate::scene::desc::IntegratorKind;
use crate::stream::UvWindow;
use crate::tracer::choice::{self, CANDIDATES, Choice, Survey, Trial};
use crate::tracer::integrator::RenderContext;
use crate::tracer::{Camera, Scene};

/// What was chosen and why. Field names are JSON keys.
#[derive(Clone, Debug, Serialize)]
pub struct Chosen {
    /// The method.
    #[serde(skip)]
    pub kind: IntegratorKind,
    /// One line.
    pub reason: String,
    /// Every method that was tried.
    pub candidates: Vec<Candidate>,
}

/// One method that was tried.
#[derive(Clone, Debug, Serialize)]
pub struct Candidate {
    /// Its name.
    pub method: &'static str,
    /// It can show everything that the picture holds.
    pub complete: bool,
    /// Estimated time to the same error, relative to the chosen method's; absent where it is never reached.
    pub relative_time: Option<f64>,
    /// Relative variance per path, with what was missed.
    pub variance: f64,
    /// Share of the light that its trial has not found.
    pub missed: f64,
    /// Cost of a path, in units of a camera vertex.
    pub cost: f64,
    /// Mean luminance of its trial.
    pub mean: f64,
}

impl From<Choice> for Chosen {
    fn from(choice: Choice) -> Self {
        let best = choice.ratings.iter().find(|r| r.kind == choice.kind).map_or(1.0, |r| r.time());
        let candidates = choice.ratings.iter().map(|r| Candidate {
            method: method::name(r.kind),
            complete: r.complete,
            relative_time: Some(r.time() / best).filter(|t| t.is_finite()),
            variance: r.variance,
            missed: r.missed,
            cost: r.cost,
            mean: r.mean,
        });
        let reason = format!("auto: {} — {}", method::name(choice.kind), choice.reason);
        Self { kind: choice.kind, reason, candidates: candidates.collect() }
    }
}

/// Chooses the method if `run` asks for it, and leaves method and reason in `run`. The choice does not depend on the
/// number of threads: each method is tried on one.
pub fn settle(run: &mut RunSpec, scene: &Arc<Scene>, camera: &Camera, threads: usize) {
    if run.integrator != IntegratorKind::Auto {
        return;
    }
    let context = render_context(run, scene, camera);
    let chosen = Chosen::from(if threads > 1 { side_by_side(&context) } else { choice::choose(&context) });
    run.integrator = chosen.kind;
    run.auto = Some(chosen);
}

/// The choice does not depend on the seed.
fn render_context(run: &RunSpec, scene: &Arc<Scene>, camera: &Camera) -> RenderContext {
    RenderContext {
        seed: 0,
        ..method::render_context(run, (scene.clone(), camera.clone()), UvWindow::PICTURE)
    }
}

/// The choice of [`choice::choose`], with the trials side by side.
fn side_by_side(context: &RenderContext) -> Choice {
    let survey = Survey::of(context);
    let trials: Vec<Trial> = std::thread::scope(|scope| {
        let trial = |kind| {
            scope.spawn({
                let survey = &survey;
                move || Trial::of(context, survey, kind)
            })
        };
        let running = CANDIDATES.map(trial);
        // A path that panics does so again when it is rendered, and is reported there.
        running.into_iter().filter_map(|trial| trial.join().ok()).collect()
    });
    choice::decide(&survey, &trials)
}

/// The choice of a window: made beside the tracer, anew when scene or view have changed and come to rest.
#[derive(Debug)]
pub struct Chooser {
    /// A choice is wanted at all.
    pub wanted: bool,
    /// Scene or view have changed since the last choice was begun.
    pub stale: bool,
    running: Option<Receiver<Choice>>,
}

impl Chooser {
    /// One that has not looked at anything yet.
    pub fn new(wanted: bool) -> Self {
        Self { wanted, stale: true, running: None }
    }

    /// Begins a choice for this scene and view, unless one is being made.
    pub fn begin(&mut self, run: &RunSpec, scene: &Arc<Scene>, camera: &Camera) {
        if !self.wanted || !self.stale || self.running.is_some() {
            return;
        }
        self.stale = false;
        let (context, (sender, receiver)) = (render_context(run, scene, camera), channel());
        let work = move || {
            // Nobody listens any more when the window has closed.
            let _ = sender.send(choice::choose(&context));
        };
        // Without a thread the method stays what it is.
        let started = std::thread::Builder::new().name("choice".to_string()).spawn(work);
        self.running = started.is_ok().then_some(receiver);
    }

    /// The choice that was begun, once, when it is there.
    pub fn take(&mut self) -> Option<Chosen> {
        let choice = self.running.as_ref()?.try_recv();
        if !matches!(choice, Err(std::sync::mpsc::TryRecvError::Empty)) {
            self.running = None;
        }
        // An edit may have overtaken it: it is a better guess than none, and the next one begins when the view is at rest.
        choice.ok().map(Chosen::from)
    }
}

/// Says on standard error what was chosen, if it was.
pub fn say(run: &RunSpec) {
    if let Some(chosen) = &run.auto {
        tell(&chosen.reason);
    }
}
