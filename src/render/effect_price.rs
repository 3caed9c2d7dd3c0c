//! Costs of the tracer's effects: paths with and without the effect are timed alternately on one thread.

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::color::Xyz;
use crate::render::effect_plan::PlannedEffect;
use crate::render::run_spec::RunSpec;
use crate::render::{method, process};
use crate::scene::SceneDesc;
use crate::server::thread_cpu_time;
use crate::stream::{SampleSink, UvWindow};
use crate::tracer::effects;
use crate::tracer::integrator::{IntegratorVisitor, PathTracer, RenderContext, visit};
use crate::tracer::{Camera, Integrator, Scene};

/// Effort of a measurement.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    pub turn: Duration,
    /// Number of alternations; the median counts.
    pub turns: usize,
}

/// For a printed table.
pub const THOROUGH: Effort = Effort { turn: Duration::from_millis(20), turns: 9 };

/// For the window: about a second of one core for all effects, plus the preparation of scenes whose geometry changes.
pub const BRIEF: Effort = Effort { turn: Duration::from_millis(6), turns: 7 };

/// Indices traced between two readings of the clock.
const AT_ONCE: u64 = 64;

/// Scene whose effects are measured.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// Description from which `scene` was prepared.
    pub desc: &'a SceneDesc,
    pub scene: &'a Arc<Scene>,
    pub camera: &'a Camera,
    /// Specification of the run, which selects the method.
    pub run: &'a RunSpec,
}

/// Times effects of the tracer one by one against the unchanged scene.
pub struct EffectTimer<'a> {
    subject: Subject<'a>,
    effort: Effort,
    /// Description with the method of the run, which may differ from the file's.
    own: SceneDesc,
    now: Runner,
}

impl<'a> EffectTimer<'a> {
    /// Prepares the unchanged scene.
    pub fn new(subject: Subject<'a>, effort: Effort) -> Self {
        let Subject { desc, scene, camera, run } = subject;
        let mut own = desc.clone();
        own.integrator.kind = run.integrator;
        let mut now = runner(run, scene.clone(), camera.clone(), &own);
        now(effort.turn);
        Self { subject, effort, own, now }
    }

    /// Measures the cost of an effect: if on, the fraction of the tracing time saved without it; if off, the time that a small example of
    /// it would add. An effect that can be neither removed nor added has no cost; nor has any after Ctrl-C.
    ///
    /// Times are per index, and paths without an effect may also be shorter.
    ///
    /// # Errors
    ///
    /// When the scene with or without the effect cannot be prepared.
    pub fn charge(&mut self, entry: &mut PlannedEffect) -> Result<()> {
        let mut turns = self.ratios(entry)?;
        turns.sort_by(f64::total_cmp);
        let ratio = turns.get(turns.len() / 2);
        match entry.on {
            true => entry.cost.share = ratio.map(|ratio| 1.0 - ratio),
            false => entry.cost.if_on_share = ratio.map(|ratio| ratio - 1.0),
        }
        Ok(())
    }

    /// For each alternation: time of a path without the effect (with it, if off) over that of a path in the unchanged scene. Empty if
    /// [`charge`](Self::charge) finds no cost.
    ///
    /// # Errors
    ///
    /// As for `charge`.
    pub fn ratios(&mut self, entry: &PlannedEffect) -> Result<Vec<f64>> {
        let Self { subject: Subject { scene, run, .. }, effort: Effort { turn, turns }, own, now } = self;
        let Some(effect) = entry.effect else { return Ok(Vec::new()) };
        let mut other = own.clone();
        let possible = match entry.on {
            true => effects::without(&mut other, effect).is_ok(),
            false => effects::with(&mut other, effect),
        };
        if !possible || process::is_interrupted() {
            return Ok(Vec::new());
        }
        let scene = Arc::new(scene.edited(&other).into_diagnostic()?);
        let camera = Camera::of(&other).into_diagnostic()?;
        let mut other = runner(run, scene, camera, &other);
        other(*turn);
        let measured: Vec<_> = (0..*turns)
            .map_while(|_| (!process::is_interrupted()).then(|| other(*turn) / now(*turn)))
            .collect();
        Ok(if measured.len() < *turns { Vec::new() } else { measured })
    }
}

/// Traces for about the given time and returns seconds per path.
pub type Runner = Box<dyn FnMut(Duration) -> f64>;

/// A runner of a scene by the method that `desc` names.
pub fn runner(run: &RunSpec, scene: Arc<Scene>, camera: Camera, desc: &SceneDesc) -> Runner {
    let run = RunSpec { photons: desc.integrator.photons, ..run.clone() };
    let context = method::render_context(&run, scene, camera, UvWindow::PICTURE);
    visit(desc.integrator.kind, TimedPaths { context })
}

/// Makes the runner of a method.
struct TimedPaths {
    context: RenderContext,
}

impl IntegratorVisitor for TimedPaths {
    type Output = Runner;

    fn visit<I: Integrator + From<RenderContext>>(self) -> Runner {
        tracing_timer(I::from(self.context))
    }
}

fn tracing_timer<I: Integrator>(integrator: I) -> Runner {
    let (mut next, mut scratch) = (0, I::Scratch::default());
    let counts = integrator.paths_per_index();
    let paths = counts.camera.max(counts.light) as f64;
    let mut nowhere = EachSample(|uv, value, weight| _ = std::hint::black_box((uv, value, weight)));
    Box::new(move |time| {
        // CPU time of this thread if the system reports it, since other threads may preempt it.
        let (start, cpu, first) = (Instant::now(), thread_cpu_time(), next);
        let elapsed = || {
            thread_cpu_time().zip(cpu).map_or_else(|| start.elapsed(), |(now, then)| now.saturating_sub(then))
        };
        while elapsed() < time {
            for _ in 0..AT_ONCE {
                integrator.trace(next, &mut scratch, &mut nowhere);
                next += 1;
            }
        }
        elapsed().as_secs_f64() / ((next - first) as f64 * paths)
    })
}

/// Luminances of the samples of the first `paths` path-traced paths.
pub fn samples(run: &RunSpec, scene: Arc<Scene>, camera: Camera, paths: u64) -> Vec<f32> {
    let tracer = PathTracer { context: method::render_context(run, scene, camera, UvWindow::PICTURE) };
    let mut luminances = Vec::new();
    let mut sink = EachSample(|_, value: Xyz, _| luminances.push(value.y));
    (0..paths).for_each(|index| tracer.trace(index, &mut Default::default(), &mut sink));
    luminances
}

/// A sink that passes position, value and weight of every sample to a function. The weight of light samples is 1.
struct EachSample<F>(F);

impl<F: FnMut([f32; 2], Xyz, f32)> SampleSink for EachSample<F> {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        (self.0)(uv, value, weight);
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        (self.0)(uv, value, 1.0);
    }
}
