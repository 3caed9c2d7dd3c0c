//! What each effect of the tracer costs: paths with it and without it, in turn, on one thread.

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::app::facts::RunFacts;
use crate::app::{interrupt, method};
use crate::color::Xyz;
use crate::scene::SceneDesc;
use crate::scene::desc::IntegratorKind;
use crate::stream::{SampleSink, UvWindow};
use crate::tracer::features::{self, Feature};
use crate::tracer::integrator::{BidirectionalTracer, ParticleTracer, PathTracer, PhotonTracer};
use crate::tracer::{Camera, Integrator, Scene};

/// Time of one turn.
const TURN: Duration = Duration::from_millis(20);

/// Turns of each; the median counts.
const TURNS: usize = 9;

/// Indices between two looks at the clock.
const AT_ONCE: u64 = 32;

/// The share of the tracing time that is saved without each of `wanted`; `None` for what cannot be left out.
///
/// What is measured is the time of a path, and paths without an effect may also be shorter.
///
/// # Errors
///
/// When a scene without an effect cannot be prepared.
pub fn shares(
    desc: &SceneDesc,
    (scene, camera): (&Arc<Scene>, &Camera),
    facts: &RunFacts,
    wanted: &[Feature],
) -> Result<Vec<(Feature, Option<f64>)>> {
    let mut whole = runner(facts, scene.clone(), camera.clone(), desc);
    whole(TURN);
    let mut found = Vec::new();
    for &feature in wanted {
        let mut less = desc.clone();
        if features::without(&mut less, feature).is_err() || interrupt::asked() {
            found.push((feature, None));
            continue;
        }
        let scene = Arc::new(scene.edited(&less).into_diagnostic()?);
        let camera = Camera::of(&less).into_diagnostic()?;
        let mut without = runner(facts, scene, camera, &less);
        without(TURN);
        let mut ratios: Vec<f64> = (0..TURNS).map(|_| without(TURN) / whole(TURN)).collect();
        ratios.sort_by(f64::total_cmp);
        found.push((feature, Some(1.0 - ratios[TURNS / 2])));
    }
    Ok(found)
}

/// Traces for about as long as it is told to, and tells the seconds of an index.
type Runner = Box<dyn FnMut(Duration) -> f64>;

fn runner(facts: &RunFacts, scene: Arc<Scene>, camera: Camera, desc: &SceneDesc) -> Runner {
    let facts = RunFacts { photons: desc.integrator.photons, ..facts.clone() };
    let setup = method::setup(&facts, (scene, camera), UvWindow::PICTURE);
    match facts.integrator {
        IntegratorKind::Path | IntegratorKind::Auto => run(PathTracer { setup }),
        IntegratorKind::Light => run(ParticleTracer { setup }),
        IntegratorKind::Bidirectional => run(BidirectionalTracer { setup }),
        IntegratorKind::Photon => run(PhotonTracer::new(setup, true)),
    }
}

fn run<I: Integrator>(integrator: I) -> Runner {
    let (mut next, mut scratch) = (0, I::Scratch::default());
    Box::new(move |time| {
        let (start, first) = (Instant::now(), next);
        while start.elapsed() < time {
            for _ in 0..AT_ONCE {
                integrator.trace(next, &mut scratch, &mut Nowhere);
                next += 1;
            }
        }
        start.elapsed().as_secs_f64() / (next - first) as f64
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
