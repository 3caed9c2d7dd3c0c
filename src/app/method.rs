//! The choice of the method of light transport: one match per render command.

use std::ops::Range;
use std::sync::Arc;

use miette::{IntoDiagnostic, Result};

use super::args::effects::Forced;
use super::facts::RunFacts;
use crate::scene::desc::IntegratorKind;
use crate::server::{RenderJob, Server};
use crate::stream::control::Epoch;
use crate::stream::{PathCounts, UvWindow};
use crate::tracer::features::Feature;
use crate::tracer::integrator::{
    BidirectionalTracer, Checked, ParticleTracer, PathTracer, PhotonTracer, Setup, Special, Tally,
};
use crate::tracer::{Camera, Integrator, Scene};

/// What is to be traced of a scene.
#[derive(Clone, Debug)]
pub struct Order {
    /// Indices: the first, and behind the last if every index were one path.
    pub range: Range<u64>,
    /// Where samples may lie.
    pub window: UvWindow,
    /// Which render this is.
    pub epoch: Epoch,
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

/// What the tracers of all methods are made of.
pub fn setup(facts: &RunFacts, (scene, camera): (Arc<Scene>, Camera), window: UvWindow) -> Setup {
    let RunFacts { seed, max_depth, rr_depth, hide_emitters, photons, .. } = *facts;
    let spectral = facts.effects.contains(&Forced { feature: Feature::Wavelengths, on: true });
    Setup { scene, camera, seed, window, max_depth, rr_depth, hide_emitters, places: None, photons, spectral }
}

/// Has `server` trace a scene by the method that `facts` name; `photons` are those of the render before, if it left any, and
/// then those of this one. Returns what a check of the plan finds, if `facts` ask for one.
///
/// # Errors
///
/// When the server has ended, or the method cannot be checked.
pub fn start(
    server: &Server,
    facts: &RunFacts,
    (scene, camera): (Arc<Scene>, Camera),
    order: Order,
    photons: &mut Option<PhotonTracer>,
) -> Result<Option<Arc<Tally>>> {
    let setup = setup(facts, (scene, camera), order.window);
    let before = photons.take();
    match facts.integrator {
        IntegratorKind::Path | IntegratorKind::Auto => special::<PathTracer>(server, facts, setup, order),
        IntegratorKind::Light => special::<ParticleTracer>(server, facts, setup, order),
        IntegratorKind::Bidirectional => special::<BidirectionalTracer>(server, facts, setup, order),
        IntegratorKind::Photon if facts.check_plan > 0.0 => Err(miette::miette!(
            help = "choose another --integrator",
            "--check-plan compares path by path, and a sample of photon mapping is made of many"
        )),
        IntegratorKind::Photon => {
            let new = PhotonTracer::new(setup, facts.deterministic);
            let tracer = photons.insert(match &before {
                Some(before) => new.after(before),
                None => new,
            });
            send(server, facts, tracer.clone(), order).map(|()| None)
        }
    }
}

/// Sends a tracer with special code, checked if that is asked for.
fn special<I: Special>(
    server: &Server,
    facts: &RunFacts,
    setup: Setup,
    order: Order,
) -> Result<Option<Arc<Tally>>> {
    if facts.check_plan > 0.0 {
        let checked = Checked::<I>::new(setup, facts.check_plan);
        let tally = checked.tally().clone();
        return send(server, facts, checked, order).map(|()| Some(tally));
    }
    send(server, facts, I::from(setup), order).map(|()| None)
}

fn send<I: Integrator>(server: &Server, facts: &RunFacts, integrator: I, order: Order) -> Result<()> {
    let PathCounts { camera, light } = integrator.paths_per_index();
    let Range { start, end } = order.range;
    // As many paths as asked for, whatever an index holds.
    let end = start + (end - start).div_ceil(camera.max(light).max(1));
    let mut job = RenderJob::new(Arc::new(integrator), start..end);
    job.window = order.window;
    if facts.deterministic {
        job.deadline = None;
    }
    server.render(job, order.epoch).into_diagnostic()
}
