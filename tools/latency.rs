//! Synthetic input to changed pixels, measured from outside the program, beside the viewer's own figure.
//!
//! Usage: `latency [side] [edits] [scene]`. The viewer traces a limited number of samples and then stands still; a small drag
//! restarts it, and the first pixel that differs ends the measurement. So only what the edit has caused is counted.

#![allow(clippy::unwrap_used, reason = "a measuring tool: a panic is the message")]

#[allow(dead_code, unused_imports, reason = "each tool uses a part")]
#[path = "../tests/support/desktop.rs"]
mod desktop;
#[allow(dead_code, unused_imports, reason = "each tool uses a part")]
#[path = "../tests/support/xserver.rs"]
mod xserver;

use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};

use desktop::Desktop;

fn main() {
    let mut args = std::env::args().skip(1);
    let side: u32 = args.next().map_or(512, |a| a.parse().expect("side in pixels"));
    let edits: usize = args.next().map_or(100, |a| a.parse().expect("a number of edits"));
    let scene = args.next().unwrap_or("scenes/cornell.xml".into());
    let figures = format!("target/latency-{side}.json");
    let desktop = Desktop::start(side + 64, side + 64);
    let mut viewer = Command::new("target/release/pointillist")
        .env("DISPLAY", &desktop.display)
        .env_remove("WAYLAND_DISPLAY")
        .args([
            "view",
            &scene,
            "--size",
            &format!("{side}x{side}"),
            "--samples",
            &(side * side / 4).to_string(),
        ])
        .args(["--threads", "1", "--no-panel", "--json", &figures])
        .spawn()
        .unwrap();
    let window = desktop.find("ointillist", Duration::from_secs(30)).expect("a window within 30 s");
    std::thread::sleep(Duration::from_secs(2));

    let mut milliseconds = Vec::new();
    let middle = side as i32 / 2;
    for edit in 0..edits as i32 {
        let (x, y) = (middle + edit % 7, middle + edit % 5);
        desktop.pointer(x, y);
        desktop.button(1, true);
        let still = settle(&desktop, window);
        let start = Instant::now();
        desktop.pointer(x + if edit % 2 == 0 { 24 } else { -24 }, y);
        while desktop.pixels(window).expect("the window").2 == still {
            assert!(start.elapsed() < Duration::from_secs(10), "edit {edit} was never shown");
        }
        milliseconds.push(start.elapsed().as_secs_f64() * 1e3);
        desktop.button(1, false);
    }
    let _ = Command::new("kill").args(["-TERM", &viewer.id().to_string()]).status();
    viewer.wait().unwrap();

    milliseconds.sort_by(f64::total_cmp);
    let at = |q: f64| milliseconds[((milliseconds.len() - 1) as f64 * q).round() as usize];
    println!(
        "{side}x{side}, {edits} edits, input to changed pixels: p50 {:.1} ms, p95 {:.1}, p99 {:.1}",
        at(0.5),
        at(0.95),
        at(0.99)
    );
    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&figures).unwrap_or_default()).unwrap_or_default();
    println!("the viewer's own figures: {:#}", json["edit_latency_ms"]);
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
