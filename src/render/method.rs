//! Light transport of a run: choosing the method (`--integrator auto`) and starting its tracer.
//!
//! Behind [`start`] everything is generic over the integrator.

use std::ops::Range;
use std::sync::Arc;

use miette::{IntoDiagnostic, Result};

use crate::job::Job;
use crate::render::process::tell;
use crate::render::run_spec::{ChoiceReport, RunSpec};
use crate::scene::desc::{IntegratorDesc, IntegratorKind};
use crate::server::{RenderJob, Server};
use crate::stream::control::Epoch;
use crate::stream::{PathCounts, UvWindow};
use crate::study::error_tile::TILE;
use crate::study::format::percent;
use crate::study::witness::Witnesses;
use crate::study::{LateLight, MissingLight};
use crate::tracer::choice::{self, IntegratorChoice};
use crate::tracer::integrator::{
    CheckedIntegrator, IntegratorVisitor, PhotonTracer, PlanCheckTally, RenderContext, Replicated,
    SeesPhotons, Stereo, visit,
};
use crate::tracer::screen::ScreenSampling;
use crate::tracer::witness;
use crate::tracer::{Camera, Integrator, Scene};

/// Fraction of missing light from which on the method is changed, which discards the samples so far.
const CHANGES_OVER: f64 = 0.02;

/// Tracers of photon mapping; the next render may reuse their photon maps.
pub type Photons = Replicated<PhotonTracer>;

/// Parameters of a render.
#[derive(Clone, Debug)]
pub struct RenderOrder {
    pub scene: Arc<Scene>,
    /// The camera; with two eyes that of the left.
    pub camera: Camera,
    /// The camera of the right eye, if there are two.
    pub right_eye: Option<Camera>,
    /// Range of indices, counted as if every index were one path.
    pub range: Range<u64>,
    pub window: UvWindow,
    pub epoch: Epoch,
    /// How camera paths are distributed over the window.
    pub sampling: ScreenSampling,
    /// Check of the effect plan, if requested.
    pub check: Option<CheckOrder>,
}

/// Check of the effect plan: a fraction of the paths is also traced by general code.
#[derive(Clone, Debug)]
pub struct CheckOrder {
    /// Fraction of the paths, in (0, 1].
    pub share: f64,
    /// The scene prepared for all effects, needed or not.
    pub general: Arc<Scene>,
}

/// Converts a range of indices to the unit of [`RenderOrder::range`].
pub fn as_paths(kind: IntegratorKind, indices: &Range<u64>) -> Range<u64> {
    let paths = (indices.end - indices.start).saturating_mul(kind.paths_per_index());
    indices.start..indices.start.saturating_add(paths)
}

/// Context shared by the tracers of all methods.
pub fn render_context(run: &RunSpec, scene: Arc<Scene>, camera: Camera, window: UvWindow) -> RenderContext {
    let RunSpec { seed, integrator, max_depth, rr_depth, hide_emitters, photons, .. } = *run;
    let desc = IntegratorDesc {
        kind: integrator,
        max_depth,
        rr_depth,
        hide_emitters,
        photons,
        ..IntegratorDesc::default()
    };
    RenderContext::new(scene, camera, &desc, seed, window).of_size([run.film.width, run.film.height])
}

/// Starts rendering on `server` by the method of `run`. `photons`: photon maps of the last render, replaced by those of this one. Returns
/// the tally of the check, if requested.
///
/// # Errors
///
/// If the server has ended, or the method cannot be checked.
pub fn start(
    server: &Server,
    run: &RunSpec,
    order: RenderOrder,
    photons: &mut Option<Photons>,
) -> Result<Option<Arc<PlanCheckTally>>> {
    if run.integrator.streams() == [false, true] && !order.camera.is_found_by_light() {
        return Err(miette::miette!(
            help = "choose --integrator path or bidirectional",
            "no path from a light finds the rays of the sensors `radiancemeter` and `distant`, which have one direction, and {} has no others",
            run.integrator.traits().title
        ));
    }
    let last = photons.take();
    if run.integrator == IntegratorKind::Photon && order.check.is_none() && order.right_eye.is_none() {
        let mut last = last.iter().flat_map(|last| &last.parts);
        let make = |context| {
            let new = PhotonTracer::new(context, run.deterministic);
            match last.next() {
                Some(last) => new.after(last),
                None => new,
            }
        };
        let tracer = photons.insert(Replicated::new(&context_of(run, &order), run.replicated, make));
        return send(server, run, tracer.clone(), order).map(|()| None);
    }
    visit(run.integrator, Start { server, run, order })
}

/// Starts the tracer of a method.
struct Start<'a> {
    server: &'a Server,
    run: &'a RunSpec,
    order: RenderOrder,
}

impl IntegratorVisitor for Start<'_> {
    type Output = Result<Option<Arc<PlanCheckTally>>>;

    fn visit<I: Integrator + From<RenderContext>>(self) -> Self::Output {
        let Self { server, run, order } = self;
        if order.check.is_some() && !run.integrator.shows_light() {
            return Err(miette::miette!(
                "--check-plan compares paths of light, and `{}` traces none: choose another --integrator",
                run.integrator.name()
            ));
        }
        special::<I>(server, run, order)
    }

    fn visit_with_photons<I: Integrator + From<RenderContext> + SeesPhotons>(self) -> Self::Output {
        let Self { server, run, order } = self;
        if order.check.is_some() {
            return check_photons::<I>(server, run, order);
        }
        let make = |context| I::without_photons(context, run.deterministic);
        send_replicated(server, run, order, make).map(|()| None)
    }
}

fn context_of(run: &RunSpec, order: &RenderOrder) -> RenderContext {
    let context = render_context(run, order.scene.clone(), order.camera.clone(), order.window);
    let screen = order.sampling.clone();
    RenderContext { seed: screen.seed(run.seed), screen, ..context }
}

/// Starts a tracer of specialised code, with the check if requested.
fn special<I: Integrator + From<RenderContext>>(
    server: &Server,
    run: &RunSpec,
    order: RenderOrder,
) -> Result<Option<Arc<PlanCheckTally>>> {
    let Some(check) = order.check.clone() else {
        return send_replicated(server, run, order, I::from).map(|()| None);
    };
    let context = context_of(run, &order);
    let checked = CheckedIntegrator::<I>::new(context, check.general, check.share);
    let tally = checked.tally().clone();
    send(server, run, checked, order).map(|()| Some(tally))
}

/// A sample of photon mapping depends on many paths, so both codes must trace all of them.
fn check_photons<I: Integrator + From<RenderContext>>(
    server: &Server,
    run: &RunSpec,
    order: RenderOrder,
) -> Result<Option<Arc<PlanCheckTally>>> {
    let complete = order.check.as_ref().is_some_and(|check| check.share >= 1.0) && run.deterministic;
    if !complete || order.scene.white().is_some() {
        return Err(miette::miette!(
            help = "give --check-plan 1 and --deterministic, in a scene with colours; or choose another --integrator",
            "a sample of photon mapping is made of many paths: the plan can be checked on all of them only"
        ));
    }
    special::<I>(server, run, order)
}

/// Sends the replicates of a tracer that `make` makes, for one eye or two.
fn send_replicated<I: Integrator>(
    server: &Server,
    run: &RunSpec,
    order: RenderOrder,
    make: impl Fn(RenderContext) -> I,
) -> Result<()> {
    let context = context_of(run, &order);
    match order.right_eye.clone() {
        None => send(server, run, Replicated::new(&context, run.replicated, make), order),
        Some(right) => {
            let eyes = |context: RenderContext| Stereo::new(&context, &right, &make);
            send(server, run, Replicated::new(&context, run.replicated, eyes), order)
        }
    }
}

fn send<I: Integrator>(server: &Server, run: &RunSpec, integrator: I, order: RenderOrder) -> Result<()> {
    let PathCounts { camera, light } = integrator.paths_per_index();
    let Range { start, end } = order.range;
    // As many paths as requested, however many an index stands for.
    let end = start + (end - start).div_ceil(camera.max(light).max(1));
    let mut job = RenderJob::new(Arc::new(integrator), start..end);
    job.window = order.window;
    if run.deterministic {
        job.deadline = None;
    }
    server.render(job, order.epoch).into_diagnostic()
}

/// Chooses the method if `run` asks for it, and stores method and reason in `run`. The choice does not depend on the number of threads,
/// because every trial is single-threaded.
pub fn choose(run: &mut RunSpec, scene: &Arc<Scene>, camera: &Camera, threads: usize) {
    if run.integrator != IntegratorKind::Auto {
        return;
    }
    let context = trial_context(run, scene, camera);
    let chosen = ChoiceReport::from(choice::choose(&context, threads));
    run.integrator = chosen.kind;
    run.auto = Some(chosen);
}

/// Witness paths, which find light that the method of `run` may miss; `None` if no method finds more.
pub fn witnesses(run: &RunSpec, scene: &Arc<Scene>, camera: &Camera) -> Option<Witnesses> {
    let context = RenderContext { seed: run.seed, ..trial_context(run, scene, camera) };
    witness::pair(context, TILE as u32, run.integrator).map(|witnesses| Box::new(witnesses) as Witnesses)
}

/// Context of the trials, with its own seed, so that the choice does not depend on the run's.
fn trial_context(run: &RunSpec, scene: &Arc<Scene>, camera: &Camera) -> RenderContext {
    let run = RunSpec { seed: 0, ..run.clone() };
    render_context(&run, scene.clone(), camera.clone(), UvWindow::PICTURE)
}

/// Chooses the method for a window in the background, anew whenever scene or view have changed and come to rest.
#[derive(Debug)]
pub struct Chooser {
    /// Whether the choice is automatic.
    pub wanted: bool,
    /// Scene or view have changed since the last choice began.
    pub stale: bool,
    running: Option<Job<IntegratorChoice>>,
    /// The choice is final, because it was made from witness paths, which are more reliable than trials.
    settled: bool,
}

impl Chooser {
    /// A chooser that has not seen a scene yet.
    pub fn new(wanted: bool) -> Self {
        Self { wanted, stale: true, running: None, settled: false }
    }

    /// Begins a choice for this scene and view, unless one is in progress.
    pub fn begin(&mut self, run: &RunSpec, scene: &Arc<Scene>, camera: &Camera) {
        if !self.wanted || self.settled || !self.stale || self.running.is_some() {
            return;
        }
        self.stale = false;
        let context = trial_context(run, scene, camera);
        // If no thread can be started the method stays unchanged.
        self.running = Job::start("the choice of the method", move |_| choice::choose(&context, 1)).ok();
    }

    /// Returns the choice that was begun, once, when it is ready.
    pub fn take(&mut self) -> Option<ChoiceReport> {
        let choice = Job::take(&mut self.running)?.inspect_err(|panic| tracing::error!("{panic}"));
        // The scene may have been edited since the choice began. The result is still better than none, and the next choice begins when the
        // view is at rest.
        choice.ok().map(ChoiceReport::from)
    }

    /// With the automatic choice, switches `run` to the method that finds the light which its picture lacks, if that is a substantial
    /// fraction. Returns whether it did; the method is then final. A choice due or in progress takes precedence.
    pub fn change_over(&mut self, run: &mut RunSpec, late: &LateLight) -> bool {
        if !self.wanted || self.stale && !self.settled || self.running.is_some() {
            return false;
        }
        let Some((kind, share)) = late.kind().and_then(|light| that_finds(light).zip(late.share(light)))
        else {
            return false;
        };
        let Some(choice) = run.auto.as_mut().filter(|_| run.integrator != kind && share > CHANGES_OVER)
        else {
            return false;
        };
        let reason = format!(
            "auto: {} — witnesses have found {} of the light that {} has not",
            kind.name(),
            percent(share),
            run.integrator.name()
        );
        // The trials did not include this method.
        *choice = ChoiceReport { kind, reason, candidates: Vec::new() };
        (run.integrator, self.settled) = (kind, true);
        true
    }
}

/// The method that finds this kind of light sooner; `None` if none does.
pub fn that_finds(light: MissingLight) -> Option<IntegratorKind> {
    match light {
        MissingLight::Caustics => Some(IntegratorKind::Vcm),
        MissingLight::Highlights => None,
        MissingLight::Other => Some(IntegratorKind::Bidirectional),
    }
}

/// Reports on standard error which method was chosen and why, if one was.
pub fn tell_choice(run: &RunSpec) {
    if let Some(chosen) = &run.auto {
        tell(&chosen.reason);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

    use super::*;
    use crate::render::load;
    use crate::render::options::SceneOptions;
    use crate::scene::desc::PhotonDesc;

    /// Scene files give lengths in world space; tracers use rendering space, whose scale may differ.
    #[test]
    fn lengths_are_in_rendering_space() {
        let source = SceneOptions::of("scenes/cornell.xml".into());
        let input = load::load(&source).unwrap();
        let mut desc = input.loaded.desc.clone();
        desc.space.scale = 0.25;
        let mut run = input.run(&source, "cpu".to_string());
        run.photons = PhotonDesc { initial_radius: Some(8.0), ..run.photons };
        let (scene, camera) = (Scene::prepare(&desc).unwrap(), Camera::of(&desc).unwrap());
        let context = render_context(&run, Arc::new(scene), camera, UvWindow::PICTURE);
        assert_eq!(context.photons.initial_radius, Some(2.0));
    }

    #[test]
    fn the_program_leaves_its_method_for_one_that_finds_missing_light() {
        let source = SceneOptions::of("scenes/cornell.xml".into());
        let input = load::load(&source).unwrap();
        let mut run = input.run(&source, "cpu".to_string());
        run.integrator = IntegratorKind::Path;
        let missing = |missing: f64, caustics: f64| LateLight {
            missing: Some(missing),
            caustics,
            ..LateLight::default()
        };
        let choice = |kind| ChoiceReport { kind, reason: String::new(), candidates: Vec::new() };
        run.auto = Some(choice(IntegratorKind::Path));
        let chosen = |wanted| Chooser { stale: false, ..Chooser::new(wanted) };
        assert!(!chosen(false).change_over(&mut run, &missing(0.3, 0.3)), "somebody asked for the method");
        assert!(!Chooser::new(true).change_over(&mut run, &missing(0.3, 0.3)), "a choice is due");
        let mut chooser = chosen(true);
        assert!(!chooser.change_over(&mut run, &missing(0.01, 0.01)), "it is little");
        let highlights = LateLight { highlights: 0.25, ..missing(0.3, 0.04) };
        assert!(!chooser.change_over(&mut run, &highlights), "no method finds them better");
        assert!(chooser.change_over(&mut run, &missing(0.3, 0.0)));
        assert_eq!(run.integrator, IntegratorKind::Bidirectional);
        // An edit does not restore the trial's choice, and further light may turn out to be missing.
        chooser.stale = true;
        chooser.begin(
            &run,
            &Arc::new(Scene::prepare(&input.loaded.desc).unwrap()),
            &Camera::of(&input.loaded.desc).unwrap(),
        );
        assert!(chooser.running.is_none() && chooser.take().is_none());
        assert!(chooser.change_over(&mut run, &missing(0.14, 0.13)));
        let report = run.auto.as_ref().unwrap();
        assert_eq!((run.integrator, report.kind), (IntegratorKind::Vcm, IntegratorKind::Vcm));
        assert!(
            report.reason.contains("vcm") && report.reason.contains("bidirectional"),
            "{}",
            report.reason
        );
        assert!(report.reason.contains("13"), "{}", report.reason);
        assert!(!chooser.change_over(&mut run, &missing(0.14, 0.13)), "it is the present one");
    }
}
