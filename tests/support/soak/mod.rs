//! A renderer that never rests: server, stream and film under edits, aborts, resizes, reloads, lost devices, exhausted memory, bad samples,
//! slow clients, full disks and workers that panic, by dice of a given seed.
//!
//! Nothing here is a stand-in but the faults: the server and its threads, the lanes, the store of retained samples and the film on a Vulkan
//! device are those of the program. After each render the counts of every stage must add up; now and then a render that must
//! not notice any of it (bad samples, a slow client, lost devices) is compared with the picture of an undisturbed one, bit for bit. A thread
//! ends the process with a message when nothing happens for a minute.

mod client;
mod faults;
mod render;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use pointillist::math::random::Random;

pub use render::Renderer;

/// What the soak does, and for how long.
#[derive(Clone, Debug)]
pub struct SoakPlan {
    /// Time in all.
    pub time: Duration,
    /// Every choice follows from it.
    pub seed: u64,
    /// Tracing threads.
    pub threads: usize,
    /// Scene files.
    pub scenes: Vec<PathBuf>,
    /// A folder on a disk that is full, if there is one.
    pub full_disk: Option<PathBuf>,
    /// Whether Vulkan's validation layer listens.
    pub validation: bool,
}

/// Samples by what became of them, over all renders that were followed to their end.
#[derive(Clone, Copy, Debug, Default)]
pub struct Conservation {
    /// Made by integrators, the bad ones included.
    pub made: u64,
    /// Rejected by the sinks.
    pub rejected: u64,
    /// Discarded by the sinks: the lane was full when the render was stopped, or the path panicked.
    pub discarded: u64,
    /// Sent over the lanes.
    pub sent: u64,
    /// Dropped from the lanes when a newer render was followed.
    pub stale: u64,
    /// Handed over to the film, as the film counts them.
    pub accepted: u64,
}

/// What a soak has done and found.
#[derive(Clone, Debug, Default)]
pub struct SoakReport {
    /// How often each thing was done.
    pub acts: BTreeMap<&'static str, u64>,
    pub conservation: Conservation,
    /// Renders whose counts were checked.
    pub renders: u64,
    /// Pictures compared with undisturbed ones.
    pub pictures: u64,
    /// What went wrong, the first hundred.
    pub faults: Vec<String>,
    /// Seconds since the start, and resident memory in KiB.
    pub memory: Vec<(f64, u64)>,
    /// Messages of the validation layer.
    pub validation_messages: usize,
    /// Longest time without any progress, seconds.
    pub longest_pause: f64,
}

impl SoakReport {
    pub fn did(&mut self, act: &'static str) {
        *self.acts.entry(act).or_default() += 1;
    }

    pub fn fault(&mut self, what: String) {
        if self.faults.len() < 100 {
            eprintln!("soak: {what}");
            self.faults.push(what);
        }
    }

    /// Least resident memory of each of `windows` equal parts of the time, MiB; NaN where nothing was measured.
    pub fn memory_minima(&self, windows: usize) -> Vec<f64> {
        let end = self.memory.last().map_or(0.0, |(at, _)| *at) + 1e-9;
        let least = |w: usize| {
            let inside = |at: f64| (at / end * windows as f64) as usize == w;
            let of_window = self.memory.iter().filter(|(at, _)| inside(*at)).map(|(_, kib)| *kib);
            of_window.min().map_or(f64::NAN, |kib| kib as f64 / 1024.0)
        };
        (0..windows).map(least).collect()
    }

    /// Growth of the least memory of a window: the mean of the last third over that of the middle third. What comes before is warm-up.
    pub fn memory_growth(&self) -> f64 {
        let minima = self.memory_minima(12);
        let mean = |part: &[f64]| {
            let known = part.iter().filter(|mib| !mib.is_nan());
            known.clone().sum::<f64>() / known.count() as f64
        };
        mean(&minima[8..]) / mean(&minima[4..8])
    }
}

/// Tells that the soak goes on, and what it is doing.
#[derive(Clone)]
pub struct Heart {
    start: Instant,
    /// Milliseconds since the start at the last beat, and the longest time between two.
    beat: Arc<[AtomicU64; 2]>,
}

/// A time that passes only when something hangs.
const HANG: Duration = Duration::from_secs(60);

impl Heart {
    fn new() -> Self {
        let heart = Self { start: Instant::now(), beat: Arc::default() };
        let watched = heart.clone();
        std::thread::spawn(move || {
            // Ends with its last other owner.
            while Arc::strong_count(&watched.beat) > 1 {
                std::thread::sleep(Duration::from_millis(500));
                if watched.pause() > HANG {
                    eprintln!("soak: nothing has happened for {} s: it hangs", HANG.as_secs());
                    std::process::exit(3);
                }
            }
        });
        heart
    }

    fn pause(&self) -> Duration {
        let beat = Duration::from_millis(self.beat[0].load(Ordering::Relaxed));
        self.start.elapsed().saturating_sub(beat)
    }

    pub fn beats(&self) {
        let pause = self.pause().as_millis() as u64;
        self.beat[1].fetch_max(pause, Ordering::Relaxed);
        self.beat[0].store(self.start.elapsed().as_millis() as u64, Ordering::Relaxed);
    }
}

/// Resident memory of this process, KiB.
fn resident_kib() -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(0)
}

/// Soaks, and reports; `tell` gets the seconds and the report so far about twice a second.
pub fn soak(plan: &SoakPlan, mut tell: impl FnMut(f64, &SoakReport)) -> SoakReport {
    // Panics of workers are wanted here.
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(|panic| {
        if panic.payload().downcast_ref::<&str>().is_none_or(|text| *text != faults::PANIC) {
            eprintln!("soak: {panic}");
        }
    }));
    let (mut report, mut dice) = (SoakReport::default(), Random(plan.seed));
    let heart = Heart::new();
    let mut renderer = Renderer::new(plan, heart.clone());
    let mut told = 0.0;
    while heart.start.elapsed() < plan.time {
        renderer.round(&mut dice, &mut report);
        let seconds = heart.start.elapsed().as_secs_f64();
        if seconds >= told + 0.5 {
            report.memory.push((seconds, resident_kib()));
            tell(seconds, &report);
            told = seconds;
        }
    }
    // The last picture of each scene and method, after all that has happened.
    renderer.all_pictures(&mut dice, &mut report);
    report.validation_messages = renderer.validation_messages();
    report.longest_pause = heart.beat[1].load(Ordering::Relaxed) as f64 * 1e-3;
    drop(renderer);
    std::panic::set_hook(before);
    report
}
