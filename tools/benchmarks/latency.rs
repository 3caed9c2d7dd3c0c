//! Synthetic input to changed pixels, measured from outside the program, beside the viewer's own figure.
//!
//! The viewer traces a limited number of samples and then stands still; a small drag
//! restarts it, and the first pixel that differs ends the measurement. So only what the edit has caused is counted.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::common::{Outcome, quantiles};
use super::support::desktop::Desktop;
use super::viewer::{Viewer, figures};

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// Pixels along a side of the picture
    #[arg(default_value_t = 512)]
    side: u32,
    /// The number of edits
    #[arg(default_value_t = 100)]
    edits: u32,
    /// The scene file
    #[arg(default_value = "scenes/cornell.xml")]
    scene: String,
    /// Options of `pointillist view`, after `--`
    #[arg(last = true)]
    options: Vec<String>,
}

/// Prints what the edits took.
pub fn run(arguments: &Arguments) -> Outcome {
    let Arguments { side, edits, ref scene, ref options } = *arguments;
    let [p50, p95, p99] = quantiles(measure(side, edits, scene, options)?, [0.5, 0.95, 0.99]);
    println!(
        "{side}x{side}, {edits} edits, input to changed pixels: p50 {p50:.1} ms, p95 {p95:.1}, p99 {p99:.1}"
    );
    println!("the viewer's own figures: {:#}", figures(&json_of(side))["edit_latency_ms"]);
    Ok(())
}

/// Where the viewer's own figures are.
fn json_of(side: u32) -> PathBuf {
    PathBuf::from(format!("target/latency-{side}.json"))
}

/// Drags again and again, and waits each time until the picture has changed; returns milliseconds. `options` go to the viewer.
pub fn measure(side: u32, edits: u32, scene: &str, options: &[String]) -> Outcome<Vec<f64>> {
    let json = json_of(side);
    let mut viewer = Viewer::open([side + 64; 2], scene, |command| {
        command.args(["--size", &format!("{side}x{side}"), "--samples", &(side * side / 4).to_string()]);
        command.args(["--threads", "1", "--no-panel", "--json"]).arg(&json).args(options);
    })?;
    std::thread::sleep(Duration::from_secs(2));

    let (desktop, window) = (&viewer.desktop, viewer.window);
    let mut milliseconds = Vec::new();
    let middle = side as i32 / 2;
    for edit in 0..edits as i32 {
        let (x, y) = (middle + edit % 7, middle + edit % 5);
        desktop.pointer(x, y);
        desktop.button(1, true);
        let still = settle(desktop, window);
        let start = Instant::now();
        desktop.pointer(x + if edit % 2 == 0 { 24 } else { -24 }, y);
        while desktop.pixels(window).expect("the window").2 == still {
            assert!(start.elapsed() < Duration::from_secs(10), "edit {edit} was never shown");
        }
        milliseconds.push(start.elapsed().as_secs_f64() * 1e3);
        desktop.button(1, false);
    }
    viewer.ask_to_end();
    viewer.process.wait()?;
    Ok(milliseconds)
}

/// The window's pixels once they have not changed for a while.
fn settle(desktop: &Desktop, window: u32) -> Vec<u8> {
    let mut last = desktop.pixels(window).expect("the window").2;
    let mut since = Instant::now();
    while since.elapsed() < Duration::from_millis(250) {
        std::thread::sleep(Duration::from_millis(20));
        let now = desktop.pixels(window).expect("the window").2;
        if now != last {
            (last, since) = (now, Instant::now());
        }
    }
    last
}
