//! The choice of the method of light transport: one match per render command.

use std::ops::Range;
use std::sync::Arc;

use miette::{IntoDiagnostic, Result};

use super::run_spec::RunSpec;
use crate::scene::desc::IntegratorKind;
use crate::server::{RenderJob, Server};
use crate::stream::control::Epoch;
use crate::stream::{PathCounts, UvWindow};
use crate::tracer::integrator::{
    BidirectionalTracer, CAMERA_SUBPATHS, Checked, ParticleTracer, PathTracer, PhotonTracer, RenderContext,
    Replicated, Special, Tally,
};
use crate::tracer::{Camera, Integrator, Scene};

/// The tracers of photon mapping, of which the next render may keep the photons.
pub type Photons = Replicated<PhotonTracer>;

/// That the plan of effects is to be checked.
#[derive(Clone, Debug)]
pub struct Check {
    /// Share of the paths, in (0, 1].
    pub share: f64,
    /// The scene prepared for everything, whether it calls for it or not.
    pub general: Arc<Scene>,
}

/// What is to be traced of a scene.
#[derive(Clone, Debug)]
pub struct Order {
    /// Indices: the first, and behind the last if every index were one path.
    pub range: Range<u64>,
    /// Where samples may lie.
    pub window: UvWindow,
    /// Which render this is.
    pub epoch: Epoch,
    /// If the plan is to be checked.
    pub check: Option<Check>,
}

/// What a method is called on the command line and in files.
pub fn name(kind: IntegratorKind) -> &'static str {
    match kind {
        IntegratorKind::Auto => "auto",
        IntegratorKind::Path => "path",
        IntegratorKind::Light => "light",
        IntegratorKind::Bidirectional => "bidirectional",
        IntegratorKind::Photon => "photon",
    }
}

/// Paths that an index of a method stands for.
pub fn paths_per_index(kind: IntegratorKind) -> u64 {
    match kind {
        IntegratorKind::Bidirectional => CAMERA_SUBPATHS,
        _ => 1,
    }
}

/// What the tracers of all methods are made of.
pub fn render_context(
    run: &RunSpec,
    (scene, camera): (Arc<Scene>, Camera),
    window: UvWindow,
) -> RenderContext {
    let RunSpec { seed, max_depth, rr_depth, hide_emitters, photons, .. } = *run;
    RenderContext { scene, camera, seed, window, max_depth, rr_depth, hide_emitters, places: None, photons }
}

/// Has `server` trace a scene by the method that `run` names; `photons` are those of the render before, if it left any, and
/// then those of this one. Returns what a check of the plan finds, if `run` asks for one.
///
/// # Errors
///
/// When the server has ended, or the method cannot be checked.
pub fn start(
    server: &Server,
    run: &RunSpec,
    (scene, camera): (Arc<Scene>, Camera),
    order: Order,
    photons: &mut Option<Photons>,
) -> Result<Option<Arc<Tally>>> {
    let context = render_context(run, (scene, camera), order.window);
    let before = photons.take();
    match run.integrator {
        IntegratorKind::Path | IntegratorKind::Auto => special::<PathTracer>(server, run, context, order),
        IntegratorKind::Light => special::<ParticleTracer>(server, run, context, order),
        IntegratorKind::Bidirectional => special::<BidirectionalTracer>(server, run, context, order),
        IntegratorKind::Photon if order.check.is_some() => {
            check_photons(server, run, context, order).map(Some)
        }
        IntegratorKind::Photon => {
            let mut before = before.iter().flat_map(Replicated::parts);
            let tracer = photons.insert(Replicated::new(&context, run.replicated, |context| {
                let new = PhotonTracer::new(context, run.deterministic);
                match before.next() {
                    Some(before) => new.after(before),
                    None => new,
                }
            }));
            send(server, run, tracer.clone(), order).map(|()| None)
        }
    }
}

/// Sends a tracer with special code, checked if that is asked for.
fn special<I: Special>(
    server: &Server,
    run: &RunSpec,
    context: RenderContext,
    order: Order,
) -> Result<Option<Arc<Tally>>> {
    match order.check.clone() {
        Some(check) => send_checked::<I>(server, run, context, (order, check)).map(Some),
        None => send(server, run, Replicated::new(&context, run.replicated, I::from), order).map(|()| None),
    }
}

fn send_checked<I: Special>(
    server: &Server,
    run: &RunSpec,
    context: RenderContext,
    (order, check): (Order, Check),
) -> Result<Arc<Tally>> {
    let checked = Checked::<I>::new(context, check.general, check.share);
    let tally = checked.tally().clone();
    send(server, run, checked, order).map(|()| tally)
}

/// A sample of photon mapping is made of many paths, so that both sides must have traced all of them.
fn check_photons(server: &Server, run: &RunSpec, context: RenderContext, order: Order) -> Result<Arc<Tally>> {
    let check = order.check.clone().filter(|check| check.share >= 1.0 && run.deterministic);
    let check = check.filter(|_| context.scene.white().is_none());
    let Some(check) = check else {
        return Err(miette::miette!(
            help = "give --check-plan 1 and --deterministic, in a scene with colours; or choose another --integrator",
            "a sample of photon mapping is made of many paths: the plan can be checked on all of them only"
        ));
    };
    send_checked::<PhotonTracer>(server, run, context, (order, check))
}

fn send<I: Integrator>(server: &Server, run: &RunSpec, integrator: I, order: Order) -> Result<()> {
    let PathCounts { camera, light } = integrator.paths_per_index();
    let Range { start, end } = order.range;
    // As many paths as asked for, whatever an index holds.
    let end = start + (end - start).div_ceil(camera.max(light).max(1));
    let mut job = RenderJob::new(Arc::new(integrator), start..end);
    job.window = order.window;
    if run.deterministic {
        job.deadline = None;
    }
    server.render(job, order.epoch).into_diagnostic()
}
