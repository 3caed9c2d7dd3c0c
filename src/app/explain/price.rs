//! What each effect of the tracer costs: paths with it and without it, in turn, on one thread.

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::app::facts::RunFacts;
use crate::app::plan::Entry;
use crate::app::{interrupt, method};
use crate::color::Xyz;
use crate::scene::SceneDesc;
use crate::scene::desc::IntegratorKind;
use crate::stream::{SampleSink, UvWindow};
use crate::tracer::features;
use crate::tracer::integrator::{BidirectionalTracer, ParticleTracer, PathTracer, PhotonTracer};
use crate::tracer::{Camera, Integrator, Scene};

/// Time of one turn.
const TURN: Duration = Duration::from_millis(20);

/// Turns of each; the median counts.
const TURNS: usize = 9;

/// Indices between two looks at the clock.
const AT_ONCE: u64 = 32;

/// Charges the tracer's effects: those that are on with the share of the tracing time that is saved without them, those that are
/// off with what a small example of them would add. Nothing, where an effect cannot be left out or added.
///
/// What is measured is the time of an index, and paths without an effect may also be shorter.
///
/// # Errors
///
/// When a scene without an effect, or with it, cannot be prepared.
pub fn charge(
    plan: &mut [Entry],
    desc: &SceneDesc,
    (scene, camera): (&Arc<Scene>, &Camera),
    facts: &RunFacts,
) -> Result<()> {
    let mut now = runner(facts, (scene.clone(), camera.clone()), desc);
    now(TURN);
    for entry in plan.iter_mut() {
        let Some(feature) = entry.feature.filter(|_| !interrupt::asked()) else { continue };
        let mut other = desc.clone();
        other.integrator.kind = facts.integrator;
        let possible = match entry.on {
            true => features::without(&mut other, feature).is_ok(),
            false => features::with(&mut other, feature),
        };
        if !possible {
            continue;
        }
        let scene = Arc::new(scene.edited(&other).into_diagnostic()?);
        let camera = Camera::of(&other).into_diagnostic()?;
        let mut other = runner(facts, (scene, camera), &other);
        other(TURN);
        let mut ratios: Vec<f64> = (0..TURNS).map(|_| other(TURN) / now(TURN)).collect();
        ratios.sort_by(f64::total_cmp);
        let ratio = ratios[TURNS / 2];
        match entry.on {
            true => entry.cost.share = Some(1.0 - ratio),
            false => entry.cost.if_on_share = Some(ratio - 1.0),
        }
    }
    Ok(())
}

/// Traces for about as long as it is told to, and tells the seconds of a path.
type Runner = Box<dyn FnMut(Duration) -> f64>;

fn runner(facts: &RunFacts, scene: (Arc<Scene>, Camera), desc: &SceneDesc) -> Runner {
    let facts = RunFacts { photons: desc.integrator.photons, ..facts.clone() };
    let setup = method::setup(&facts, scene, UvWindow::PICTURE);
    match desc.integrator.kind {
        IntegratorKind::Path | IntegratorKind::Auto => run(PathTracer { setup }),
        IntegratorKind::Light => run(ParticleTracer { setup }),
        IntegratorKind::Bidirectional => run(BidirectionalTracer { setup }),
        IntegratorKind::Photon => run(PhotonTracer::new(setup, true)),
    }
}

fn run<I: Integrator>(integrator: I) -> Runner {
    let (mut next, mut scratch) = (0, I::Scratch::default());
    let counts = integrator.paths_per_index();
    let paths = counts.camera.max(counts.light) as f64;
    Box::new(move |time| {
        let (start, first) = (Instant::now(), next);
        while start.elapsed() < time {
            for _ in 0..AT_ONCE {
                integrator.trace(next, &mut scratch, &mut Nowhere);
                next += 1;
            }
        }
        start.elapsed().as_secs_f64() / ((next - first) as f64 * paths)
    })
}

/// Takes samples and forgets them.
struct Nowhere;

impl SampleSink for Nowhere {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        std::hint::black_box((uv, value, weight));
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        std::hint::black_box((uv, value));
    }
}
