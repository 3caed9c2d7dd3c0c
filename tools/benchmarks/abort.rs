//! The time from `abort` to standstill in every scene of `scenes/`, by path tracing and photon mapping; p99 must stay below 5 ms.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use pointillist::server::{RenderJob, Server};
use pointillist::stream::{DrainOrder, Epoch, Event};
use pointillist::tracer::integrator::{PathTracer, PhotonTracer};

use super::common::{Outcome, context, cores, quantiles};

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// The number of tracing threads; all cores and then all but one when not given
    threads: Option<usize>,
}

/// Aborts per scene.
const ABORTS: u64 = 500;

/// Aborts renders of every scene again and again.
pub fn run(arguments: &Arguments) -> Outcome {
    let mut scenes: Vec<_> = std::fs::read_dir("scenes")
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "xml"))
        .collect();
    scenes.sort();
    println!("abort to finish event, {ABORTS} times, ms");
    let usual = vec![cores(), (cores() - 1).max(1)];
    for threads in arguments.threads.map_or(usual, |n| vec![n]) {
        for path in &scenes {
            for photons in [false, true] {
                let [p50, p99, max] = quantiles(aborts(path, threads, photons)?, [0.5, 0.99, 1.0]);
                println!(
                    "  {:<28} {:<6} {threads} threads  p50 {p50:.3}  p99 {p99:.3}  max {max:.3}",
                    path.display(),
                    if photons { "photon" } else { "path" },
                );
            }
        }
    }
    Ok(())
}

fn aborts(path: &Path, threads: usize, photons: bool) -> Outcome<Vec<f64>> {
    let context = context(path)?;
    let tracer = Arc::new(PathTracer { context: context.clone() });
    let (server, mut lanes) = Server::start(threads)?;
    let milliseconds = (1..=ABORTS)
        .map(|number| {
            let epoch = Epoch(number);
            if photons {
                // One map to an epoch.
                let tracer = Arc::new(PhotonTracer::new(context.clone(), false));
                server.render(RenderJob::new(tracer, 0..u64::MAX), epoch).unwrap();
            } else {
                server.render(RenderJob::new(tracer.clone(), 0..u64::MAX), epoch).unwrap();
            }
            lanes.follow(epoch, DrainOrder::Arrival);
            // Some time into the render, another one in every round, the lanes drained as by a client.
            let until = Instant::now() + Duration::from_micros(2000 + 137 * (number % 40));
            while Instant::now() < until {
                lanes.drain(usize::MAX, |_| ());
                lanes.wait(Duration::from_millis(1));
            }
            while server.event().is_some() {}
            let start = Instant::now();
            server.abort();
            loop {
                match server.wait_event(Duration::from_secs(10)).expect("a finish event") {
                    Event::Finished { epoch: ended, .. } if ended == epoch => break,
                    Event::Finished { .. } => (),
                }
            }
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    Ok(milliseconds)
}
