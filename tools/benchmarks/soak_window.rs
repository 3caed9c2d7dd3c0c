//! The viewer under a user who never rests: camera moves, resizes, controls, for minutes, on a display of its own.
//!
//! Memory is read from outside, second by second. It follows the size of the picture and the effects that are on; once a minute the user
//! starts over at the first size and rests, so that memory is compared in the same state. Stalls, latencies and validation
//! messages are the viewer's own figures (`--json`). Screenshots go to `target/soak`.

use std::fmt;
use std::fs;
use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};

use clap::ValueEnum;
use pointillist::client::window::panel::WIDTH;
use pointillist::math::random::Random;

use super::common::Outcome;
use super::support::desktop::Desktop;
use super::viewer::{Viewer, figures};

/// What the user does, and for how long.
#[derive(clap::Args)]
pub struct Arguments {
    /// Seconds in all
    #[arg(default_value_t = 300)]
    seconds: u64,
    /// Pixels along a side of the picture
    #[arg(default_value_t = 512)]
    side: u32,
    /// The scene file
    #[arg(default_value = "scenes/cornell.xml")]
    scene: String,
    /// What the user does, separated by commas
    #[arg(value_enum, value_delimiter = ',', default_values_t = [Act::Camera, Act::Resize, Act::Control, Act::Tool])]
    acts: Vec<Act>,
}

/// A kind of thing that a user does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Act {
    Camera,
    Resize,
    Control,
    Tool,
}

/// Width of the dock at the right of the picture, pixels.
const DOCK: i32 = WIDTH as i32;

/// Largest ratios of memory in the last third of the time to that in the second: of the most at any time, and of the mean at rest.
const MOST_GROWTH: f64 = 1.05;
const REST_GROWTH: f64 = 1.03;

/// Seconds from one rest to the next.
const REST_EVERY: u64 = 60;

/// Length of a rest: until memory is read, and while it is, of which the least counts. The noise filter, when it works, holds more.
const REST: Duration = Duration::from_secs(7);
const REST_READ: Duration = Duration::from_secs(5);

/// Snapshots that are kept at the start. Later the key is not pressed: each of them keeps a picture until the user removes it, which is no leak.
const SNAPSHOTS: usize = 8;

/// The same user every time.
struct Dice(Random);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0.below(n)
    }

    fn between(&mut self, low: i32, high: i32) -> i32 {
        low + self.below((high - low).max(1) as usize) as i32
    }
}

/// Uses the viewer until the time is over, and checks its figures.
///
/// # Errors
///
/// A bound is broken.
pub fn run(arguments: &Arguments) -> Outcome {
    let side = arguments.side;
    let folder = Path::new("target/soak");
    let _ = fs::remove_dir_all(folder);
    fs::create_dir_all(folder)?;
    let scene = fs::canonicalize(&arguments.scene)?.display().to_string();
    let mut viewer = Viewer::open([1280, 1024], &scene, |command| {
        command.current_dir(folder).env("POINTILLIST_VALIDATION", "1").env("POINTILLIST_STATE", "state");
        command.args(["--size", &format!("{side}x{side}"), "-o", "last.png", "--json", "figures.json"]);
    })?;
    std::thread::sleep(Duration::from_secs(2));
    let memory = torment(&mut viewer, arguments, folder);
    viewer.ask_to_end();
    let end = Instant::now();
    let status = loop {
        match viewer.process.try_wait()? {
            Some(status) => break Some(status),
            None if end.elapsed() > Duration::from_secs(20) => {
                let _ = viewer.process.kill().and_then(|()| viewer.process.wait());
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    report(&memory, status.map(|s| s.success()), folder)
}

/// Resident memory, KiB.
struct Memory {
    /// For every second.
    always: Vec<u64>,
    /// At the end of every rest.
    at_rest: Vec<u64>,
}

/// Does what users do until the time is over.
fn torment(viewer: &mut Viewer, arguments: &Arguments, folder: &Path) -> Memory {
    let Arguments { seconds, side, ref acts, .. } = *arguments;
    let (desktop, window) = (&viewer.desktop, viewer.window);
    let mut dice = Dice(Random(1));
    let (start, mut size) = (Instant::now(), side as i32);
    let mut memory = Memory { always: Vec::new(), at_rest: Vec::new() };
    let mut shot = 0;
    // Without it a window has no keys.
    assert!(desktop.focus(window, Duration::from_secs(60)), "the window does not get the keyboard");
    desktop.pointer(size / 2, size / 2);
    for _ in 0..SNAPSHOTS {
        [true, false].into_iter().for_each(|down| desktop.key(SNAPSHOT, down));
        std::thread::sleep(Duration::from_millis(500));
    }
    while start.elapsed().as_secs() < seconds && viewer.process.try_wait().unwrap().is_none() {
        if dice.below(24) == 0 {
            // A user who has lost his scene goes back to it.
            [true, false].into_iter().for_each(|down| desktop.key(HOME, down));
        }
        let act = dice.below(16);
        let kind = match act {
            0 | 1 => Act::Resize,
            2..=5 => Act::Camera,
            6..=11 => Act::Control,
            _ => Act::Tool,
        };
        if !acts.contains(&kind) {
            continue;
        }
        match act {
            0 => {
                size = dice.between(side as i32 / 2, side as i32 * 5 / 4);
                desktop.resize(
                    window,
                    (size + DOCK) as u32,
                    dice.between(side as i32 / 2, side as i32 * 5 / 4) as u32,
                );
            }
            1 => {
                size = side as i32;
                desktop.resize(window, side + DOCK as u32, side);
            }
            2 | 3 => drag(desktop, &mut dice, 1, 5..size, 0),
            4 => drag(desktop, &mut dice, 2, 5..size, 0),
            5 => wheel(desktop, &mut dice, 5..size, None),
            6 => drag(desktop, &mut dice, 1, size..size + DOCK, 8),
            7..=9 => click(desktop, &mut dice, size..size + DOCK),
            10 => click(desktop, &mut dice, 5..size),
            11 => key(desktop, &mut dice, &KEYS, None),
            12 => wheel(desktop, &mut dice, 5..size, Some(CTRL)),
            13 => key(desktop, &mut dice, &CTRL_KEYS, Some(CTRL)),
            14 => region(desktop, &mut dice, size),
            _ => {
                desktop.pointer(dice.between(5, size), dice.between(5, size));
                key(desktop, &mut dice, &TOOL_KEYS, None);
            }
        }
        std::thread::sleep(Duration::from_millis(50 + dice.below(200) as u64));
        let second = start.elapsed().as_secs();
        while (memory.always.len() as u64) < second {
            memory.always.push(resident_kib(viewer.process.id()));
        }
        if second / REST_EVERY > memory.at_rest.len() as u64 {
            size = side as i32;
            memory.at_rest.push(rest(viewer, side));
        }
        if second / 30 >= shot {
            save(desktop, window, &folder.join(format!("{shot:02}.png")));
            shot += 1;
        }
    }
    desktop.resize(window, side + DOCK as u32, side);
    std::thread::sleep(Duration::from_secs(2));
    save(desktop, window, &folder.join("end.png"));
    memory
}

/// Leaves whatever is open, starts over, and waits; returns the least resident memory in KiB.
fn rest(Viewer { desktop, window, process }: &Viewer, side: u32) -> u64 {
    for _ in 0..3 {
        [true, false].into_iter().for_each(|down| desktop.key(ESCAPE, down));
    }
    for down in [true, false] {
        [CTRL, SHIFT, START_OVER].into_iter().for_each(|key| desktop.key(key, down));
    }
    std::thread::sleep(Duration::from_millis(500));
    desktop.resize(*window, side + DOCK as u32, side);
    desktop.pointer(side as i32 / 2, side as i32 / 2);
    std::thread::sleep(REST);
    let begun = Instant::now();
    let mut least = u64::MAX;
    while begun.elapsed() < REST_READ {
        least = least.min(resident_kib(process.id()));
        std::thread::sleep(Duration::from_millis(100));
    }
    least
}

/// Drags with a button somewhere within these columns; slowly where `steps` is not 0.
fn drag(desktop: &Desktop, dice: &mut Dice, button: u8, columns: Range<i32>, steps: i32) {
    let (mut x, mut y) = (dice.between(columns.start, columns.end), dice.between(5, 500));
    desktop.pointer(x, y);
    desktop.button(button, true);
    for _ in 0..if steps > 0 { steps } else { 20 } {
        (x, y) = ((x + dice.between(-15, 16)).max(1), (y + dice.between(-8, 9)).max(1));
        desktop.pointer(x, y);
        std::thread::sleep(Duration::from_millis(16));
    }
    desktop.button(button, false);
}

/// Drags a region, which is traced alone for a while, and now and then releases it.
fn region(desktop: &Desktop, dice: &mut Dice, size: i32) {
    for down in [true, false] {
        [CTRL, SHIFT].into_iter().for_each(|key| desktop.key(key, down));
        if down {
            let corner = |dice: &mut Dice| (dice.between(5, size), dice.between(5, 500));
            let (from, to) = (corner(dice), corner(dice));
            desktop.pointer(from.0, from.1);
            desktop.button(1, true);
            for step in 1..=5 {
                desktop.pointer(from.0 + (to.0 - from.0) * step / 5, from.1 + (to.1 - from.1) * step / 5);
                std::thread::sleep(Duration::from_millis(16));
            }
            desktop.button(1, false);
        }
    }
    std::thread::sleep(Duration::from_millis(500 + dice.below(1000) as u64));
    if dice.below(2) == 0 {
        [true, false].into_iter().for_each(|down| desktop.key(ESCAPE, down));
    }
}

fn click(desktop: &Desktop, dice: &mut Dice, columns: Range<i32>) {
    desktop.pointer(dice.between(columns.start, columns.end), dice.between(5, 500));
    for down in [true, false] {
        desktop.button(1, down);
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Turns the wheel, while a key is held where there is one.
fn wheel(desktop: &Desktop, dice: &mut Dice, columns: Range<i32>, held: Option<u32>) {
    desktop.pointer(dice.between(columns.start, columns.end), dice.between(5, 500));
    held.into_iter().for_each(|key| desktop.key(key, true));
    let way = 4 + dice.below(2) as u8;
    for _ in 0..dice.between(1, 5) {
        desktop.button(way, true);
        desktop.button(way, false);
        std::thread::sleep(Duration::from_millis(30));
    }
    held.into_iter().for_each(|key| desktop.key(key, false));
}

const TAB: u32 = 0xff09;
const ESCAPE: u32 = 0xff1b;
const HOME: u32 = 0xff50;
const CTRL: u32 = 0xffe3;
const SHIFT: u32 = 0xffe1;
const SNAPSHOT: u32 = b'k' as u32;
const START_OVER: u32 = b'r' as u32;

/// Keys that do not end the program: Tab, Home, F1, brackets.
const KEYS: [u32; 6] = [TAB, HOME, 0xffbe, 0xffbe, 0x5b, 0x5d];

/// Keys of tools: inspect, compare, pause, zoom in and out, pixels, the whole picture, one as large as the window, meter, brightness,
/// F6, F11, Escape.
const TOOL_KEYS: [u32; 13] = [
    b'i' as u32,
    b't' as u32,
    b' ' as u32,
    b'+' as u32,
    b'-' as u32,
    b'z' as u32,
    b'0' as u32,
    b'n' as u32,
    b'm' as u32,
    b'b' as u32,
    0xffc3,
    0xffc8,
    ESCAPE,
];

/// Keys that do something with Ctrl: undo, redo, the palette, the dialog, larger and smaller text, a region, the light mix.
const CTRL_KEYS: [u32; 8] =
    [b'z' as u32, b'y' as u32, b'k' as u32, b'o' as u32, b'=' as u32, b'-' as u32, b'b' as u32, b'l' as u32];

/// Presses one of these keys, while another one is held where there is one; Escape then closes what has opened.
fn key(desktop: &Desktop, dice: &mut Dice, keys: &[u32], held: Option<u32>) {
    let key = keys[dice.below(keys.len())];
    held.into_iter().for_each(|key| desktop.key(key, true));
    for down in [true, false] {
        desktop.key(key, down);
        std::thread::sleep(Duration::from_millis(20));
    }
    held.into_iter().for_each(|key| desktop.key(key, false));
    if held.is_some() {
        std::thread::sleep(Duration::from_millis(200));
        [true, false].into_iter().for_each(|down| desktop.key(ESCAPE, down));
    }
}

/// Resident memory of a process.
pub fn resident_kib(pid: u32) -> u64 {
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

/// Resident memory over a while, KiB.
struct MemoryRange {
    least: u64,
    median: u64,
    most: u64,
}

impl MemoryRange {
    /// Of what was read in each second; 0 where it could not be read.
    fn of(seconds: &[u64]) -> Self {
        let mut known: Vec<u64> = seconds.iter().copied().filter(|&kib| kib > 0).collect();
        known.sort_unstable();
        let at = |i: usize| known.get(i).copied().unwrap_or(0);
        Self { least: at(0), median: at(known.len() / 2), most: at(known.len().saturating_sub(1)) }
    }
}

impl fmt::Display for MemoryRange {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} to {} MiB, median {}", self.least >> 10, self.most >> 10, self.median >> 10)
    }
}

/// The last two thirds of a series.
fn thirds(series: &[u64]) -> [&[u64]; 2] {
    let third = series.len() / 3;
    [&series[third..2 * third], &series[2 * third..]]
}

fn report(Memory { always, at_rest }: &Memory, success: Option<bool>, folder: &Path) -> Outcome {
    let [second, last] = thirds(always).map(MemoryRange::of);
    let growth = |of: fn(&MemoryRange) -> u64| of(&last) as f64 / of(&second).max(1) as f64;
    let most = growth(|range| range.most);
    println!("memory in thirds of {} s: second {second}, last {last}", always.len() / 3);
    println!(
        "growth of the least {:.3}, of the median {:.3}, of the most {most:.3} (bound {MOST_GROWTH})",
        growth(|range| range.least),
        growth(|range| range.median)
    );
    let [before, after] = thirds(at_rest).map(|kib| kib.iter().sum::<u64>() as f64 / kib.len() as f64);
    let rest = after / before;
    println!("at rest: MiB {:?}", at_rest.iter().map(|kib| kib >> 10).collect::<Vec<_>>());
    println!("growth of the mean at rest {rest:.3} (bound {REST_GROWTH})");
    fs::write(folder.join("memory.json"), serde_json::to_string(&[always, at_rest])?)?;
    let figures = figures(&folder.join("figures.json"));
    println!("{figures:#}");
    let picture = folder.join("last.png").exists();
    println!("picture written at the end: {picture}");
    let clean = figures["stalls"] == 0 && figures["validation_messages"] == 0;
    // No number where there were fewer than three rests: that is no pass.
    if success == Some(true) && most <= MOST_GROWTH && rest <= REST_GROWTH && clean && picture {
        Ok(())
    } else {
        Err("soak: the viewer failed, or a bound is broken".into())
    }
}
