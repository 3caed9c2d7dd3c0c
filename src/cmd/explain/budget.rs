//! Machines and time to an error target, extrapolated from a short render and the curve fitted to its error.

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};
use serde::Serialize;

use crate::accounting::accumulator::CheckpointPolicy;
use crate::render::method::{self, RenderOrder};
use crate::render::observed;
use crate::render::process;
use crate::render::progress::{Goal, Progress};
use crate::render::run_spec::RunSpec;
use crate::server::Server;
use crate::stream::{DrainOrder, Epoch, PathCounts};
use crate::study::data::FarmCost;
use crate::study::format::{duration, percent, remaining, round_percent};
use crate::study::prediction::time_reached;
use crate::study::{ErrorTarget, Interval};
use crate::tracer::{Camera, Scene};

/// Numbers of machines in the table.
const MACHINES: [u32; 6] = [1, 4, 16, 64, 256, 1024];

/// Seconds per pixel and stream to write a part's state, and to merge it (`tools/farm/README.md`, two cores of an AMD EPYC).
const STATE: f64 = 0.5e-6;
const MERGE: f64 = 0.2e-6;

/// Machines and time to an error target. Field names are JSON keys.
#[derive(Clone, Debug, Serialize)]
pub struct Budget {
    /// Relative error target.
    target: f64,
    /// Quantile of the picture that the target refers to.
    at: &'static str,
    /// Seconds of the trial, and the error at its end, if known.
    trial: f64,
    error: Option<f64>,
    /// Notes on light that the trial may have missed.
    late: Vec<String>,
    /// Seconds that every machine needs to load and prepare the scene and to write its state.
    setup: f64,
    /// Seconds to merge the state of one machine; states are merged one after another.
    merge: f64,
    /// Seconds of rendering on one machine; absent if unknown.
    alone: Option<Interval>,
    /// Seconds on several machines like this one.
    machines: Vec<MachineTime>,
}

/// Time on a number of machines.
#[derive(Clone, Debug, Serialize)]
struct MachineTime {
    machines: u32,
    seconds: Interval,
}

/// Inputs of the trial render.
pub struct TrialSubject<'a> {
    pub run: &'a RunSpec,
    pub scene: &'a Arc<Scene>,
    pub camera: &'a Camera,
    pub threads: usize,
    /// Seconds to load and prepare the scene.
    pub setup: f64,
}

/// Cost per machine, besides rendering, of a part of a picture with this many texels; `setup`: seconds for scene and device.
pub fn farm_cost(setup: f64, texels: f64, has_two_streams: bool) -> FarmCost {
    let streams = if has_two_streams { 2.0 } else { 1.0 };
    FarmCost { setup: setup + STATE * texels * streams, merge: MERGE * texels * streams }
}

impl Budget {
    /// Renders for `time` and extrapolates from the error.
    ///
    /// # Errors
    ///
    /// When a thread cannot be started.
    pub fn measure(subject: &TrialSubject, target: ErrorTarget, time: Duration) -> Result<Self> {
        let TrialSubject { run, scene, camera, threads, setup } = *subject;
        let run = &RunSpec { replicated: true, ..run.clone() };
        let observer = observed::observe(run, Some(target), CheckpointPolicy::Exact)?;
        if let Some(witnesses) = method::witnesses(run, scene, camera) {
            observer.call(witnesses);
        }
        let (server, mut lanes) = Server::start(threads).into_diagnostic()?;
        let order = RenderOrder {
            scene: scene.clone(),
            camera: camera.clone(),
            range: 0..u64::MAX,
            window: run.film.window(),
            epoch: Epoch(1),
            sampling: Default::default(),
            check: None,
            right_eye: None,
        };
        lanes.follow(order.epoch, DrainOrder::Arrival);
        method::start(&server, run, order, &mut None)?;
        let begin = Instant::now();
        let (progress, mut paths) = (Progress::new(Goal::Time(time), false), 0);
        let [width, height] = run.film.padded_extent().map(f64::from);
        while begin.elapsed() < time && !observer.state().reached && !process::is_interrupted() {
            lanes.wait(Duration::from_millis(20));
            lanes.drain(usize::MAX, |block| {
                let PathCounts { camera, light } = block.header.paths;
                paths += camera.max(light);
                observer.samples(block.header.first_index, block.header.paths, block.samples());
            });
            let error = observer.state();
            progress.update(paths, width * height, begin.elapsed(), Some((&error, target.at)));
        }
        progress.finish();
        server.term();
        let (trial, (state, _)) = (begin.elapsed().as_secs_f64(), observer.end());
        let reached = time_reached(&state.checkpoints, target.error, f64::NEG_INFINITY);
        let reached = reached.map(Interval::exact);
        let predicted = state.prediction.filter(|said| said.target == target.error);
        let alone = reached.or(predicted.map(|said| said.seconds));
        let cost = farm_cost(setup, width * height, run.integrator.streams() == [true; 2]);
        let FarmCost { setup, merge } = cost;
        let on = |alone, machines| MachineTime { machines, seconds: cost.on(machines, alone) };
        Ok(Self {
            target: target.error,
            at: target.at.share(),
            trial,
            error: state.checkpoints.last().map(|last| last.error),
            late: state.late.unfound().into_iter().chain(state.late.warning()).collect(),
            setup,
            merge,
            alone,
            machines: alone.into_iter().flat_map(|alone| MACHINES.map(|m| on(alone, m))).collect(),
        })
    }

    /// Formats the table.
    pub fn words(&self) -> String {
        let (target, trial) = (round_percent(self.target), duration(self.trial));
        let now = self.error.map_or("not known yet".to_owned(), percent);
        let late: String = self.late.iter().map(|late| format!("  {late}\n")).collect();
        let Some(alone) = self.alone else {
            return format!(
                "\n{target} of error in {}: not known when, after a trial of {trial} (error {now}); --trial takes longer\n{late}",
                self.at
            );
        };
        let mut words = format!(
            "\n{target} of error in {}: {} of rendering on a machine like this one, from a trial of {trial} (error {now})\n",
            self.at,
            remaining(0.0, alone)
        );
        for MachineTime { machines, seconds } in &self.machines {
            words += &format!(
                "  {machines:>5} {:<9} {}\n",
                if *machines == 1 { "machine" } else { "machines" },
                remaining(0.0, *seconds)
            );
        }
        words
            + &late
            + &format!(
                "  with {} on each machine for scene and state, and {} for each state that is merged; `pointillist shard` renders a part\n",
                duration(self.setup),
                duration(self.merge)
            )
    }
}
