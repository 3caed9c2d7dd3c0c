//! What the window costs the tracer: samples per second with the viewer open against tracing alone on all cores, in turn.
//!
//! On a CPU device the loss should be the planned share of the cores.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use pointillist::server::{RenderJob, Server};
use pointillist::stream::{DrainOrder, Epoch};
use pointillist::tracer::integrator::PathTracer;

use super::common::{Outcome, context, cores};
use super::viewer::{DOCK, Viewer, figures};

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// The number of rounds
    #[arg(default_value_t = 3)]
    rounds: usize,
    /// Pixels along a side of the picture
    #[arg(default_value_t = 512)]
    side: u32,
    /// The scene file
    #[arg(default_value = "scenes/cornell.xml")]
    scene: String,
}

/// Seconds of each measurement.
const SECONDS: u64 = 10;

/// Measures both in turn.
pub fn run(arguments: &Arguments) -> Outcome {
    for _ in 0..arguments.rounds {
        let alone = alone(Path::new(&arguments.scene))?;
        let (beside, plan) = beside(&arguments.scene, arguments.side)?;
        println!(
            "alone {:.0} k samples/s, with the window {:.0} k: {:.0} % ({plan})",
            alone / 1e3,
            beside / 1e3,
            100.0 * beside / alone
        );
    }
    Ok(())
}

/// Samples per second of all cores when nobody looks.
fn alone(path: &Path) -> Outcome<f64> {
    let tracer = Arc::new(PathTracer { context: context(path)? });
    let (server, mut lanes) = Server::start(cores())?;
    server.render(RenderJob::new(tracer, 0..u64::MAX), Epoch(1))?;
    lanes.follow(Epoch(1), DrainOrder::Arrival);
    let (start, mut samples) = (Instant::now(), 0);
    while start.elapsed().as_secs() < SECONDS {
        samples += lanes.drain(usize::MAX, |_| ()).samples;
        lanes.wait(Duration::from_millis(10));
    }
    Ok(samples as f64 / start.elapsed().as_secs_f64())
}

/// Samples per second as the viewer counts them, and its plan in words.
fn beside(scene: &str, side: u32) -> Outcome<(f64, String)> {
    let json = Path::new("target/share.json");
    let _ = std::fs::remove_file(json);
    let mut viewer = Viewer::open([side + DOCK, side + 64], scene, |command| {
        command.args(["--size", &format!("{side}x{side}"), "--json"]).arg(json);
    })?;
    std::thread::sleep(Duration::from_secs(SECONDS));
    viewer.ask_to_end();
    viewer.process.wait()?;
    let figures = figures(json);
    let plan = figures["cores"].as_str().unwrap_or("no plan of cores").to_string();
    Ok((figures["traced_samples_per_second"].as_f64().unwrap_or(0.0), plan))
}
