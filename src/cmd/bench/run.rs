//! The measured frames of a benchmark.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::client::film::VulkanFilm;
use crate::client::{CHUNK_SAMPLES, Film, Settings};
use crate::gpu::{Access, Attachment, Gpu, Image, Inventory, TexelFormat, TimingRows};
use crate::render::drive::note;
use crate::render::film_writer::FilmWriter;
use crate::render::method::{self, RenderOrder};
use crate::render::process;
use crate::render::run_spec::RunSpec;
use crate::render::timings::TimingCapture;
use crate::server::{Priority, Server};
use crate::stream::{BlockEyes, DrainOrder, Epoch, Lanes};
use crate::tracer::{Camera, Scene};

/// Number of uncounted frames at the start, while pipelines are compiled, memory is touched and the lanes fill.
pub const WARM_UP: u32 = 8;

/// Least number of uncounted frames, and of counted frames, however slow the device is.
const FEWEST: u32 = 3;

/// Longest wait of a frame for samples.
const PATIENCE: Duration = Duration::from_millis(16);

/// Measurements of every pass.
#[derive(Debug, Default)]
pub struct PassTimes {
    /// Milliseconds of each pass, one entry per frame in which it ran; in order of first use.
    pub passes: Vec<(&'static str, Vec<f64>)>,
    /// Milliseconds between beginnings of consecutive frames, by the host's clock.
    pub frames: Vec<f64>,
    pub runs: BTreeMap<&'static str, u64>,
    /// Samples added to the film during the measured frames.
    pub samples: u64,
    /// Paths traced for these samples.
    pub paths: u64,
    pub wall: Duration,
    pub threads: usize,
    /// Scopes without timestamps, and lost rows.
    pub untimed: u64,
    /// Resources on the device at the end.
    pub inventory: Inventory,
}

/// State of the frame loop.
struct Loop<'a> {
    gpu: &'a Arc<Gpu>,
    film: VulkanFilm,
    eyes: BlockEyes,
    lanes: Lanes,
    settings: &'a Settings,
    /// Two images of the picture's size, copied as the yardstick.
    copy: [Image; 2],
    capture: Option<TimingCapture>,
    measured: PassTimes,
    /// Index of the first counted frame, once known.
    first: u32,
    /// Last frame number of the device, for each frame of the loop that has not been read yet.
    ends: BTreeMap<u64, u32>,
    /// Milliseconds by frame of the loop and pass.
    sums: BTreeMap<(u32, &'static str), f64>,
}

const EPOCH: Epoch = Epoch(1);

/// Parameters of a measurement.
pub struct BenchJob<'a> {
    pub gpu: &'a Arc<Gpu>,
    pub run: &'a RunSpec,
    pub scene: Arc<Scene>,
    pub camera: Camera,
    /// The right one of two eyes; `camera` is the left one then.
    pub right_eye: Option<Camera>,
    pub threads: usize,
    /// Display settings.
    pub settings: &'a Settings,
    /// Number of frames after the warm-up.
    pub frames: u32,
    /// Time limit, after which fewer frames suffice.
    pub at_most: Duration,
}

/// Runs the warm-up and the frames of a job; Ctrl-C ends it early.
pub fn measure(job: BenchJob<'_>, capture: Option<TimingCapture>) -> Result<PassTimes> {
    let BenchJob { gpu, run, scene, camera, right_eye, threads, settings, frames, at_most } = job;
    let film = VulkanFilm::new(gpu.clone(), run.film).into_diagnostic()?;
    let film = if right_eye.is_some() { film.with_right_eye().into_diagnostic()? } else { film };
    let (server, mut lanes) = Server::start_with(threads, Priority::Background).into_diagnostic()?;
    lanes.follow(EPOCH, DrainOrder::Arrival);
    server.set_tracing(capture.is_some());
    let window = film.spec().window();
    let extent = [film.spec().width, film.spec().height];
    let make = |name| Image::new(gpu, name, TexelFormat::Rgba32F, extent);
    let copy = [make("copy source").into_diagnostic()?, make("copy target").into_diagnostic()?];
    let measured = PassTimes { threads, ..PassTimes::default() };
    let (ends, sums) = Default::default();
    let first = u32::MAX;
    let eyes = run.eyes();
    let mut this = Loop { gpu, film, eyes, lanes, settings, copy, capture, measured, first, ends, sums };
    let order = RenderOrder {
        scene,
        camera,
        range: 0..u64::MAX,
        window,
        epoch: EPOCH,
        sampling: Default::default(),
        check: None,
        right_eye,
    };
    method::start(&server, run, order, &mut None)?;
    gpu.take_rows();
    gpu.set_timing(true);
    let (mut start, mut before) = (Instant::now(), this.film.counts());
    let began = Instant::now();
    for number in 0.. {
        let is_late = |share: u32| began.elapsed() > at_most / share;
        if this.first == u32::MAX && (number == WARM_UP || number == FEWEST && is_late(4)) {
            this.first = number;
            (start, before) = (Instant::now(), this.film.counts());
        }
        let counted = number.saturating_sub(this.first);
        if counted == frames || counted >= FEWEST && is_late(1) {
            break;
        }
        let begin = Instant::now();
        this.frame(number)?;
        if let Some(capture) = &mut this.capture {
            capture.frame_of_cpu(Some(&server))?;
        }
        this.read()?;
        if number >= this.first {
            this.measured.frames.push(begin.elapsed().as_secs_f64() * 1e3);
        }
        if process::is_interrupted() {
            break;
        }
    }
    let after = this.film.counts();
    this.measured.inventory = gpu.inventory();
    this.measured.wall = start.elapsed();
    this.measured.samples =
        after.camera_samples + after.light_samples - before.camera_samples - before.light_samples;
    this.measured.paths = after.paths() - before.paths();
    server.term();
    // When an empty frame has completed, so have all earlier ones.
    gpu.wait(gpu.begin().into_diagnostic()?.submit().into_diagnostic()?).into_diagnostic()?;
    this.read()?;
    if let Some(capture) = this.capture.take() {
        capture.finish(Some(&server))?;
    }
    gpu.set_timing(false);
    Ok(this.sorted())
}

impl Loop<'_> {
    fn frame(&mut self, number: u32) -> Result<()> {
        let start = Instant::now();
        self.lanes.wait(PATIENCE);
        note(&mut self.capture, "wait for samples", start)?;
        let (start, mut writer) =
            (Instant::now(), FilmWriter::new(&mut self.film, None).with_eyes(self.eyes));
        self.lanes.drain(CHUNK_SAMPLES, |block| writer.block(block));
        writer.finish().into_diagnostic()?;
        note(&mut self.capture, "drain", start)?;
        let start = Instant::now();
        self.film.flush().into_diagnostic()?;
        note(&mut self.capture, "flush", start)?;
        let start = Instant::now();
        let mut frame = self.gpu.begin().into_diagnostic()?;
        let cmd = &mut frame.cmd();
        self.film.paint(cmd, self.settings, 1, &mut []).into_diagnostic()?;
        let [source, target] = &mut self.copy;
        if number == 0 {
            // Memory that was never written might not be backed by physical pages.
            cmd.access(source, Access::ColorWrite);
            cmd.rendering(&[Attachment::cleared(source)], |_| ());
        }
        cmd.scope("copy").copy_levels(source, target, &[[0, 0]]);
        let end = frame.submit().into_diagnostic()?;
        self.ends.insert(end.get(), number);
        note(&mut self.capture, "paint", start)
    }

    /// Takes the rows of completed frames and sums them by frame and pass.
    fn read(&mut self) -> Result<()> {
        let taken = self.gpu.take_rows();
        if let Some(capture) = &mut self.capture {
            capture.rows(&taken)?;
        }
        let TimingRows { rows, frames, dropped } = taken;
        self.measured.untimed += dropped + frames.iter().map(|f| u64::from(f.untimed)).sum::<u64>();
        for row in rows {
            let Some((_, &number)) = self.ends.range(row.frame..).next() else { continue };
            if number >= self.first {
                let time = (row.end - row.start).as_secs_f64() * 1e3;
                *self.sums.entry((number, row.name)).or_default() += time;
                *self.measured.runs.entry(row.name).or_default() += 1;
                if !self.measured.passes.iter().any(|(name, _)| *name == row.name) {
                    self.measured.passes.push((row.name, Vec::new()));
                }
            }
        }
        // Frames complete in order, so all before the last one read are complete.
        if let Some(last) = frames.last() {
            self.ends = self.ends.split_off(&last.frame);
        }
        Ok(())
    }

    /// Moves the sums to the lists of their passes, sorted.
    fn sorted(mut self) -> PassTimes {
        for (name, times) in &mut self.measured.passes {
            times.extend(self.sums.iter().filter(|((_, n), _)| n == name).map(|(_, t)| *t));
            times.sort_by(f64::total_cmp);
        }
        self.measured.frames.sort_by(f64::total_cmp);
        self.measured
    }
}
