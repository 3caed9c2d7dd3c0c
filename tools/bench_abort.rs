//! From command to standstill: how long `abort` takes in every scene of `scenes/`, path tracing and photon mapping; p99
//! must stay below 5 ms.
//!
//! `cargo run --release --example bench_abort [threads]`; by default all cores trace, then all but one.

#![allow(clippy::unwrap_used, reason = "a measuring tool: a panic is the message")]

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use pointillist::scene;
use pointillist::server::{RenderJob, Server};
use pointillist::stream::{DrainOrder, Epoch, Event, UvWindow};
use pointillist::tracer::integrator::{PathTracer, PhotonTracer, RenderContext};
use pointillist::tracer::{Camera, PrepareOptions, Scene};

/// Aborts per scene.
const ABORTS: u64 = 500;

fn main() {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let given = std::env::args().nth(1).and_then(|text| text.parse().ok());
    let mut scenes: Vec<_> = std::fs::read_dir("scenes")
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "xml"))
        .collect();
    scenes.sort();
    println!("abort to finish event, {ABORTS} times, ms");
    for threads in given.map_or(vec![cores, (cores - 1).max(1)], |n| vec![n]) {
        for path in &scenes {
            for photons in [false, true] {
                let mut times = aborts(path, threads, photons);
                times.sort_by(f64::total_cmp);
                let at = |q: f64| times[((times.len() - 1) as f64 * q).round() as usize];
                println!(
                    "  {:<28} {:<6} {threads} threads  p50 {:.3}  p99 {:.3}  max {:.3}",
                    path.display(),
                    if photons { "photon" } else { "path" },
                    at(0.5),
                    at(0.99),
                    at(1.0)
                );
            }
        }
    }
}

fn aborts(path: &Path, threads: usize, photons: bool) -> Vec<f64> {
    let desc = scene::load(path, &[]).unwrap().desc;
    let prepared = Scene::prepare(&desc).unwrap();
    let camera = Camera::new(&desc.camera, &desc.film, &PrepareOptions::from_film(&desc.film)).unwrap();
    let context = RenderContext::new(Arc::new(prepared), camera, &desc.integrator, 0, UvWindow::PICTURE);
    let RenderContext { scene, camera, seed, window, .. } = context.clone();
    let tracer = Arc::new(PathTracer::new(scene, camera, &desc.integrator, seed, window));
    let (server, mut lanes) = Server::start(threads).unwrap();
    (1..=ABORTS)
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
        .collect()
}
