//! The viewer under a user who never rests: camera moves, resizes, controls, for minutes, on a display of its own.
//!
//! Usage: `soak [seconds] [side] [scene] [acts]`, where acts are some of `camera,resize,control` (without: all). Memory is read from outside, second by second; stalls, latencies and validation
//! messages are the viewer's own figures (`--json`). Screenshots go to `target/soak`. Exit status 1 when a bound is broken.

#![allow(clippy::unwrap_used, reason = "a measuring tool: a panic is the message")]

#[allow(dead_code, unused_imports, reason = "each tool uses a part")]
#[path = "../tests/support/desktop.rs"]
mod desktop;
#[allow(dead_code, unused_imports, reason = "each tool uses a part")]
#[path = "../tests/support/xserver.rs"]
mod xserver;

use std::fs;
use std::path::Path;
use std::process::{Child, Command, ExitCode};
use std::time::{Duration, Instant};

use desktop::Desktop;

/// Largest ratio of the most memory in the last third of the time to the most in the second. (Within each third it follows the
/// size of the window and the effects that are on.)
const MEMORY_GROWTH: f64 = 1.05;

/// A small generator: the same user every time.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) % n
    }

    fn between(&mut self, low: i32, high: i32) -> i32 {
        low + self.below((high - low).max(1) as u64) as i32
    }
}

fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let seconds: u64 = args.next().map_or(300, |a| a.parse().expect("seconds"));
    let side: u32 = args.next().map_or(512, |a| a.parse().expect("side in pixels"));
    let scene = args.next().unwrap_or("scenes/cornell.xml".into());
    let acts = args.next().unwrap_or("camera,resize,control".into());
    let folder = Path::new("target/soak");
    let _ = fs::remove_dir_all(folder);
    fs::create_dir_all(folder).unwrap();
    let scene = fs::canonicalize(scene).unwrap();
    let desktop = Desktop::start(1280, 1024);
    let mut viewer = Command::new(fs::canonicalize("target/release/pointillist").expect("a release build"))
        .current_dir(folder)
        .env("DISPLAY", &desktop.display)
        .env_remove("WAYLAND_DISPLAY")
        .env("POINTILLIST_VALIDATION", "1")
        .arg("view")
        .arg(&scene)
        .args(["--size", &format!("{side}x{side}"), "-o", "last.png", "--json", "figures.json"])
        .spawn()
        .unwrap();
    let Some(window) = desktop.find("ointillist", Duration::from_secs(30)) else {
        let _ = viewer.kill().and_then(|()| viewer.wait());
        eprintln!("soak: no window within 30 s");
        return ExitCode::FAILURE;
    };
    std::thread::sleep(Duration::from_secs(2));
    let memory = torment(&desktop, window, &mut viewer, (seconds, side, &acts, folder));
    ask_to_end(&viewer);
    let end = Instant::now();
    let status = loop {
        match viewer.try_wait().unwrap() {
            Some(status) => break Some(status),
            None if end.elapsed() > Duration::from_secs(20) => {
                let _ = viewer.kill().and_then(|()| viewer.wait());
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    report(&memory, status.map(|s| s.success()), folder)
}

/// Does what users do until the time is over; returns resident memory in KiB for every second.
fn torment(
    desktop: &Desktop,
    window: u32,
    viewer: &mut Child,
    (seconds, side, acts, folder): (u64, u32, &str, &Path),
) -> Vec<u64> {
    let mut dice = Dice(1);
    let (start, mut memory, mut size) = (Instant::now(), Vec::new(), side as i32);
    let mut shot = 0;
    while start.elapsed().as_secs() < seconds && viewer.try_wait().unwrap().is_none() {
        let act = dice.below(12);
        let kind = ["resize", "resize", "camera", "camera", "camera", "camera"]
            .get(act as usize)
            .unwrap_or(&"control");
        if !acts.contains(kind) {
            continue;
        }
        match act {
            0 => {
                size = dice.between(side as i32 / 2, side as i32 * 5 / 4);
                desktop.resize(
                    window,
                    size as u32,
                    dice.between(side as i32 / 2, side as i32 * 5 / 4) as u32,
                );
            }
            1 => desktop.resize(window, side, side),
            2 | 3 => drag(desktop, &mut dice, (1, size), 0),
            4 => drag(desktop, &mut dice, (2, size), 0),
            5 => wheel(desktop, &mut dice, size),
            6 => drag(desktop, &mut dice, (1, 280), 8),
            7..=9 => click(desktop, &mut dice, 280),
            10 => click(desktop, &mut dice, size),
            _ => key(desktop, &mut dice),
        }
        std::thread::sleep(Duration::from_millis(50 + dice.below(200)));
        let second = start.elapsed().as_secs();
        while (memory.len() as u64) < second {
            memory.push(resident_kib(viewer.id()));
        }
        if second / 30 >= shot {
            save(desktop, window, &folder.join(format!("{shot:02}.png")));
            shot += 1;
        }
    }
    desktop.resize(window, side, side);
    std::thread::sleep(Duration::from_secs(2));
    save(desktop, window, &folder.join("end.png"));
    memory
}

/// Drags with a button somewhere within `reach` pixels of the left top; slowly where `steps` is not 0.
fn drag(desktop: &Desktop, dice: &mut Dice, (button, reach): (u8, i32), steps: i32) {
    let (mut x, mut y) = (dice.between(5, reach), dice.between(5, reach));
    desktop.pointer(x, y);
    desktop.button(button, true);
    for _ in 0..if steps > 0 { steps } else { 20 } {
        (x, y) = ((x + dice.between(-15, 16)).max(1), (y + dice.between(-8, 9)).max(1));
        desktop.pointer(x, y);
        std::thread::sleep(Duration::from_millis(16));
    }
    desktop.button(button, false);
}

fn click(desktop: &Desktop, dice: &mut Dice, reach: i32) {
    desktop.pointer(dice.between(5, reach), dice.between(5, 500));
    for down in [true, false] {
        desktop.button(1, down);
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn wheel(desktop: &Desktop, dice: &mut Dice, reach: i32) {
    desktop.pointer(dice.between(5, reach), dice.between(5, reach));
    let way = 4 + dice.below(2) as u8;
    for _ in 0..dice.between(1, 5) {
        desktop.button(way, true);
        desktop.button(way, false);
        std::thread::sleep(Duration::from_millis(30));
    }
}

/// Keys that neither end the program nor leave the picture: Tab, Home, F1, brackets.
fn key(desktop: &Desktop, dice: &mut Dice) {
    const TAB: u32 = 0xff09;
    const KEYS: [u32; 6] = [TAB, 0xff50, 0xffbe, 0xffbe, 0x5b, 0x5d];
    let key = KEYS[dice.below(KEYS.len() as u64) as usize];
    for down in [true, false] {
        desktop.key(key, down);
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn resident_kib(pid: u32) -> u64 {
    let text = fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix("VmRSS:"));
    line.and_then(|l| l.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(0)
}

fn save(desktop: &Desktop, window: u32, path: &Path) {
    let Some((width, height, bgrx)) = desktop.pixels(window) else {
        return;
    };
    let rgb: Vec<u8> = bgrx.chunks_exact(4).flat_map(|p| [p[2], p[1], p[0]]).collect();
    let mut encoder = png::Encoder::new(fs::File::create(path).unwrap(), width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header().unwrap().write_image_data(&rgb).unwrap();
}

/// As a session manager does.
fn ask_to_end(viewer: &Child) {
    let _ = Command::new("kill").args(["-TERM", &viewer.id().to_string()]).status();
}

fn report(memory: &[u64], success: Option<bool>, folder: &Path) -> ExitCode {
    let third = memory.len() / 3;
    let range = |part: &[u64]| {
        let known = || part.iter().copied().filter(|&m| m > 0);
        (known().min().unwrap_or(0), known().max().unwrap_or(0))
    };
    let [second, last] = [&memory[third..2 * third], &memory[2 * third..]].map(range);
    let growth = last.1 as f64 / second.1.max(1) as f64;
    println!(
        "memory in thirds of {third} s: second {} to {} MiB, last {} to {} MiB; growth of the most {growth:.3} (bound {MEMORY_GROWTH})",
        second.0 >> 10,
        second.1 >> 10,
        last.0 >> 10,
        last.1 >> 10
    );
    let figures = fs::read_to_string(folder.join("figures.json")).unwrap_or_default();
    let figures: serde_json::Value = serde_json::from_str(&figures).unwrap_or_default();
    println!("{figures:#}");
    let picture = folder.join("last.png").exists();
    println!("picture written at the end: {picture}");
    let clean = figures["stalls"] == 0 && figures["validation_messages"] == 0;
    if success == Some(true) && growth <= MEMORY_GROWTH && clean && picture {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
