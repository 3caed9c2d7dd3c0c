//! Samples on screen after a move of the camera, over those that the tracer alone makes in the same time on the same cores.
//!
//! The camera is dragged with a synthetic mouse and then left alone; the viewer notes how many samples its picture has at fixed times
//! after the edit. Both figures depend on how fast the machine is at that moment, so they are taken in turn.

use std::path::{Path, PathBuf};
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
    /// Width of the picture, pixels
    #[arg(default_value_t = 512)]
    width: u32,
    /// Height of the picture, pixels
    #[arg(default_value_t = 512)]
    height: u32,
    /// The scene file
    #[arg(default_value = "scenes/cornell.xml")]
    scene: String,
    /// Moves of the camera
    #[arg(long, default_value_t = 10)]
    edits: u32,
    /// The number of rounds
    #[arg(long, default_value_t = 2)]
    rounds: u32,
    /// Without the panel
    #[arg(long)]
    no_panel: bool,
    /// Without the noise filter
    #[arg(long)]
    no_filter: bool,
}

/// Seconds after an edit; the viewer's keys.
const TIMES: [&str; 5] = ["0.033", "0.1", "0.3", "1", "3"];

/// How long the camera is left alone.
const ALONE: Duration = Duration::from_millis(3200);

/// Measures both in turn.
pub fn run(arguments: &Arguments) -> Outcome {
    println!("seconds after the edit        {TIMES:?}");
    for _ in 0..arguments.rounds {
        let (shown, about) = shown(arguments)?;
        let alone = alone(Path::new(&arguments.scene))?;
        let ratio: Vec<_> = (0..TIMES.len()).map(|i| format!("{:.3}", shown[i] / alone[i])).collect();
        println!(
            "samples on screen {shown:.0?}, tracer alone {alone:.0?}, ratio {}; {about}",
            ratio.join(" ")
        );
    }
    Ok(())
}

/// Mean samples on screen at each time, and the latency of the edits in words.
fn shown(arguments: &Arguments) -> Outcome<([f64; TIMES.len()], String)> {
    let Arguments { width, height, ref scene, edits, no_panel, no_filter, .. } = *arguments;
    let json = PathBuf::from("target/after-edit.json");
    let _ = std::fs::remove_file(&json);
    let mut viewer = Viewer::open([width + DOCK, height + 64], scene, |command| {
        // The method is that of the tracer alone.
        command.args(["--size", &format!("{width}x{height}"), "--integrator", "path", "--json"]).arg(&json);
        if no_panel {
            command.arg("--no-panel");
        }
        if no_filter {
            command.args(["--denoise", "off"]);
        }
    })?;
    std::thread::sleep(Duration::from_secs(2));
    let (x, y) = (width as i32 * 3 / 4, height as i32 * 3 / 4);
    for edit in 0..edits {
        viewer.desktop.pointer(x, y);
        viewer.desktop.button(1, true);
        std::thread::sleep(Duration::from_millis(20));
        viewer.desktop.pointer(x + if edit % 2 == 0 { 24 } else { -24 }, y);
        std::thread::sleep(Duration::from_millis(20));
        viewer.desktop.button(1, false);
        std::thread::sleep(ALONE);
    }
    viewer.ask_to_end();
    viewer.process.wait()?;
    let figures = figures(&json);
    if figures["edits"].as_u64().unwrap_or(0) < u64::from(edits) {
        return Err(format!("{edits} moves of the camera were {} edits", figures["edits"]).into());
    }
    let latency = &figures["edit_latency_ms"];
    let about = format!(
        "edit to picture p50 {:.0} ms, p95 {:.0}; frames p50 {:.0} ms, p95 {:.0}; {} edits",
        latency["p50"].as_f64().unwrap_or(f64::NAN),
        latency["p95"].as_f64().unwrap_or(f64::NAN),
        figures["frame_ms"]["p50"].as_f64().unwrap_or(f64::NAN),
        figures["frame_ms"]["p95"].as_f64().unwrap_or(f64::NAN),
        figures["edits"]
    );
    Ok((TIMES.map(|time| figures["samples_after_edit"][time].as_f64().unwrap_or(f64::NAN)), about))
}

/// Mean samples that all cores make in each time from the beginning of a render when nobody looks.
fn alone(path: &Path) -> Outcome<[f64; TIMES.len()]> {
    const RENDERS: u64 = 4;
    let tracer = Arc::new(PathTracer { context: context(path)? });
    let (server, mut lanes) = Server::start(cores())?;
    let (times, mut sums) = (TIMES.map(|time| time.parse().unwrap_or(f64::NAN)), [0.0; TIMES.len()]);
    for render in 1..=RENDERS {
        let start = Instant::now();
        server.render(RenderJob::new(tracer.clone(), 0..u64::MAX), Epoch(render))?;
        lanes.follow(Epoch(render), DrainOrder::Arrival);
        let mut samples = 0;
        for (sum, time) in sums.iter_mut().zip(times) {
            let end = start + Duration::from_secs_f64(time);
            while let Some(left) = end.checked_duration_since(Instant::now()).filter(|left| !left.is_zero()) {
                lanes.wait(left.min(Duration::from_millis(5)));
                samples += lanes.drain(usize::MAX, |_| ()).samples;
            }
            *sum += samples as f64 / RENDERS as f64;
        }
    }
    Ok(sums)
}
