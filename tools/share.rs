//! What the window costs the tracer: samples per second with the viewer open against tracing alone on all cores, in turn.
//!
//! Usage: `share [rounds] [side] [scene]`. On a CPU device the loss should be the planned share of the cores.

#![allow(clippy::unwrap_used, reason = "a measuring tool: a panic is the message")]

#[allow(dead_code, unused_imports, reason = "each tool uses a part")]
#[path = "../tests/support/desktop.rs"]
mod desktop;
#[allow(dead_code, unused_imports, reason = "each tool uses a part")]
#[path = "../tests/support/xserver.rs"]
mod xserver;

use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use desktop::Desktop;
use pointillist::server::{RenderJob, Server};
use pointillist::stream::{DrainOrder, Epoch, UvWindow};
use pointillist::tracer::integrator::PathTracer;
use pointillist::tracer::{Camera, PrepareOptions, Scene};

/// Seconds of each measurement.
const SECONDS: u64 = 10;

fn main() {
    let mut args = std::env::args().skip(1);
    let rounds: usize = args.next().map_or(3, |a| a.parse().expect("rounds"));
    let side: u32 = args.next().map_or(512, |a| a.parse().expect("side in pixels"));
    let scene = args.next().unwrap_or("scenes/cornell.xml".into());
    for _ in 0..rounds {
        let alone = alone(Path::new(&scene));
        let (beside, plan) = beside(&scene, side);
        println!(
            "alone {:.0} k samples/s, with the window {:.0} k: {:.0} % ({plan})",
            alone / 1e3,
            beside / 1e3,
            100.0 * beside / alone
        );
    }
}

/// Samples per second of all cores when nobody looks.
fn alone(path: &Path) -> f64 {
    let desc = pointillist::scene::load(path, &[]).unwrap().desc;
    let prepared = Scene::prepare(&desc).unwrap();
    let camera = Camera::new(&desc.camera, &desc.film, &PrepareOptions::from_film(&desc.film)).unwrap();
    let tracer =
        Arc::new(PathTracer::new(Arc::new(prepared), camera, &desc.integrator, 0, UvWindow::PICTURE));
    let (server, mut lanes) =
        Server::start(std::thread::available_parallelism().map_or(1, usize::from)).unwrap();
    server.render(RenderJob::new(tracer, 0..u64::MAX), Epoch(1)).unwrap();
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    let (start, mut samples) = (Instant::now(), 0);
    while start.elapsed().as_secs() < SECONDS {
        samples += lanes.drain(usize::MAX, |_| ()).samples;
        lanes.wait(Duration::from_millis(10));
    }
    samples as f64 / start.elapsed().as_secs_f64()
}

/// Samples per second as the viewer counts them, and its plan in words.
fn beside(scene: &str, side: u32) -> (f64, String) {
    let figures = "target/share.json";
    let _ = fs::remove_file(figures);
    let desktop = Desktop::start(side + 64, side + 64);
    let mut viewer = Command::new("target/release/pointillist")
        .env("DISPLAY", &desktop.display)
        .env_remove("WAYLAND_DISPLAY")
        .args(["view", scene, "--size", &format!("{side}x{side}"), "--json", figures])
        .spawn()
        .unwrap();
    desktop.find("ointillist", Duration::from_secs(30)).expect("a window within 30 s");
    std::thread::sleep(Duration::from_secs(SECONDS));
    let _ = Command::new("kill").args(["-TERM", &viewer.id().to_string()]).status();
    viewer.wait().unwrap();
    let json: serde_json::Value = serde_json::from_str(&fs::read_to_string(figures).unwrap()).unwrap();
    let plan = json["plan"].as_str().unwrap_or("no plan").to_string();
    (json["traced_samples_per_second"].as_f64().unwrap_or(0.0), plan)
}
