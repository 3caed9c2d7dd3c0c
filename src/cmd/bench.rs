//! `pointillist bench`: the time of every pass, as the viewer runs them, without a window.
//!
//! The tracer runs throughout. A frame takes the waiting samples (a batch at most), rasterises them, paints the picture, and copies as many
//! `Rgba32F` texels as the picture has between two images, as a yardstick for all passes. Two frames are in flight. The first
//! [`run::WARM_UP`] frames, which compile pipelines and touch memory, are not counted.

mod bytes;
mod run;

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::Result;
use serde::Serialize;
use serde_json::Value;

use crate::client::Settings;
use crate::client::compiled_effects::Effects;
use crate::client::traffic::{MODEL, PassTraffic};
use crate::cmd::args::BenchArgs;
use crate::gpu::Gpu;
use crate::render::device::Device;
use crate::render::figures::{Percentiles, Seconds, check_json, human, publish};
use crate::render::load::{self, Opened};
use crate::render::options::StereoOptions;
use crate::render::run_spec::RunSpec;
use crate::render::timings::{self, TimingCapture, describe};
use crate::render::{method, process, stereo};
use bytes::BytesReport;
use run::WARM_UP;
pub use run::{BenchJob, PassTimes, measure};

/// Runs the subcommand.
///
/// # Errors
///
/// Any error of the run; `--device cpu` and machines without Vulkan have no passes to time.
pub fn bench(args: &BenchArgs) -> Result<()> {
    if let Some(path) = &args.gpu_timings {
        timings::check(path, args.json.iter().chain([&args.source.scene]))?;
    }
    check_json(args.json.as_deref(), &args.source.scene)?;
    if args.bytes {
        let filter = args.source.filter.unwrap_or_default();
        let report = BytesReport::new(filter, &args.display.settings());
        return publish(&report.table(), "the report", &report, args.json.as_deref());
    }
    process::listen_for_interrupt();
    let started = Instant::now();
    let Opened { input, scene, camera, device } = load::open(&args.source, &mut Seconds::default())?;
    let Device::Vulkan(gpu) = &device else {
        return Err(miette::miette!(
            "bench times the passes of a Vulkan device, and there is none here (--device cpu has none); \
             `pointillist devices` lists what there is"
        ));
    };
    let mut run = input.run(&args.source, device.name());
    let (mut camera, mut right_eye) = (camera, None);
    let mut settings = args.display.settings();
    if let Some(layout) = args.stereo {
        let eyes = StereoOptions { layout: Some(layout), interocular: None, convergence: Default::default() };
        let (rig, [left, right], about) = stereo::set_up(&eyes, &input.loaded.desc, &scene, &camera)?;
        tracing::info!("{about}");
        (camera, right_eye, run.stereo, settings.stereo) = (left, Some(right), Some(rig), layout);
        run.film.variance = None;
    }
    let (scene, threads) = (Arc::new(scene), args.source.threads());
    method::choose(&mut run, &scene, &camera, threads);
    method::tell_choice(&run);
    let capture = args.gpu_timings.as_deref().map(|path| TimingCapture::new(path, Some(gpu))).transpose()?;
    tracing::info!("ready after {:.2} s", started.elapsed().as_secs_f64());
    let (frames, at_most) = (args.frames, Duration::MAX);
    let job =
        BenchJob { gpu, run: &run, scene, camera, right_eye, threads, settings: &settings, frames, at_most };
    let report = BenchReport::new(&measure(job, capture)?, gpu, &run, &settings);
    publish(&report.table(), "the report", &report, args.json.as_deref())
}

/// Contents of the `--json` file. Field names are the JSON keys.
#[derive(Debug, Serialize)]
struct BenchReport {
    version: &'static str,
    /// The command line, word by word.
    command: Vec<String>,
    /// System, architecture, cores.
    host: String,
    /// Device, driver, Vulkan version, timing method, and what is not timed.
    gpu: Value,
    width: u32,
    height: u32,
    /// How the pictures of two eyes become one; `None` for one eye.
    stereo: Option<&'static str>,
    integrator: &'static str,
    reconstruction: String,
    vm: f32,
    tracer_threads: usize,
    frames: usize,
    /// Number of uncounted warm-up frames.
    warm_up_frames: u32,
    frame_ms: Percentiles,
    /// Device memory of all images and buffers, the yardstick of image copies included.
    device_bytes: u64,
    /// Messages of the validation layer, which is enabled by `POINTILLIST_VALIDATION=1`.
    validation_messages: Vec<String>,
    /// Samples added to the film, and camera paths, per second of wall time.
    traced_samples_per_second: f64,
    traced_paths_per_second: f64,
    /// Samples per second of GPU time in splat, fold and variance.
    rasterised_samples_per_second: Option<f64>,
    samples_per_frame: f64,
    scopes_without_time: u64,
    bytes_model: &'static str,
    copy: &'static str,
    passes: Vec<PassReport>,
}

/// Timings of one pass. Several runs per frame (two streams) are summed.
#[derive(Debug, Serialize)]
struct PassReport {
    name: &'static str,
    /// Number of frames in which it ran.
    frames: usize,
    milliseconds: Percentiles,
    /// Bytes moved per frame; `None` if the traffic model lacks the pass.
    bytes: Option<f64>,
    /// `bytes` over p50.
    gigabytes_per_second: Option<f64>,
    /// p50 relative to that of the copy.
    ratio_to_copy: Option<f64>,
}

impl BenchReport {
    fn new(measured: &PassTimes, gpu: &Gpu, run: &RunSpec, settings: &Settings) -> Self {
        let find = |name: &str| measured.passes.iter().find(|(n, _)| *n == name);
        let copy = find("copy").map(|(_, t)| Percentiles::of(t).p50).filter(|t| *t > 0.0);
        let wall = measured.wall.as_secs_f64().max(1e-9);
        let frames = measured.frames.len();
        // Where there are both streams the model is that of the camera's, which is not filtered adaptively.
        let has_light_only = !run.integrator.streams()[0];
        let is_adaptive = has_light_only && Effects::new(settings, 1).adapts(&run.film, true);
        let per_frame = measured.samples as f64 / frames.max(1) as f64;
        let passes = measured.passes.iter().map(|(name, times)| {
            let milliseconds = Percentiles::of(times);
            let runs = *measured.runs.get(name).unwrap_or(&0) as f64 / times.len().max(1) as f64;
            // The samples of a frame are divided between its runs.
            let traffic = PassTraffic {
                samples: per_frame / runs.max(1.0),
                on_film: measured.samples,
                is_masked: settings.vm > 0.0,
                is_adaptive,
                ..PassTraffic::still(run.film)
            };
            let bytes = traffic.bytes(name).map(|b| b * runs);
            let seconds = milliseconds.p50 * 1e-3;
            PassReport {
                name,
                frames: times.len(),
                milliseconds,
                bytes,
                gigabytes_per_second: bytes.filter(|_| seconds > 0.0).map(|b| b / seconds * 1e-9),
                ratio_to_copy: copy.map(|copy| milliseconds.p50 / copy),
            }
        });
        let raster: f64 =
            ["splat", "fold", "variance"].iter().filter_map(|n| find(n)).flat_map(|(_, t)| t).sum::<f64>()
                * 1e-3;
        let cores = std::thread::available_parallelism().map_or(0, usize::from);
        Self {
            version: env!("CARGO_PKG_VERSION"),
            command: std::env::args().collect(),
            host: format!("{} {}, {cores} cores", std::env::consts::OS, std::env::consts::ARCH),
            gpu: describe(gpu),
            width: run.film.width,
            height: run.film.height,
            stereo: run.stereo.map(|_| settings.stereo.name()),
            integrator: run.integrator.name(),
            reconstruction: format!("{:?}", settings.reconstruction),
            vm: settings.vm,
            tracer_threads: measured.threads,
            frames,
            warm_up_frames: WARM_UP,
            frame_ms: Percentiles::of(&measured.frames),
            device_bytes: measured.inventory.memory.iter().map(|(_, bytes)| bytes).sum(),
            validation_messages: gpu.validation_messages(),
            traced_samples_per_second: measured.samples as f64 / wall,
            traced_paths_per_second: measured.paths as f64 / wall,
            rasterised_samples_per_second: (raster > 0.0).then(|| measured.samples as f64 / raster),
            samples_per_frame: per_frame,
            scopes_without_time: measured.untimed,
            bytes_model: MODEL,
            copy: "vkCmdCopyImage of the picture, RGBA 32-bit floats, in every frame",
            passes: passes.collect(),
        }
    }

    /// Formats the report as a table.
    fn table(&self) -> String {
        let text = |key: &str| self.gpu[key].as_str().unwrap_or("").to_owned();
        let mut out = format!(
            "{} ({}, {}, Vulkan {})\n{}×{}, {} frames after {} of warm-up, {} tracer threads, {}\n",
            text("device"),
            text("kind"),
            text("driver"),
            text("vulkan"),
            self.width,
            self.height,
            self.frames,
            self.warm_up_frames,
            self.tracer_threads,
            self.host
        );
        out += &format!(
            "frame p50 {:.2} ms, p95 {:.2} ms, p99 {:.2} ms; {:.1} MiB on the device; {} samples/s traced, {} samples/s rasterised, {:.0} samples per frame\n",
            self.frame_ms.p50,
            self.frame_ms.p95,
            self.frame_ms.p99,
            self.device_bytes as f64 / (1 << 20) as f64,
            human(self.traced_samples_per_second),
            self.rasterised_samples_per_second.map_or("?".to_owned(), human),
            self.samples_per_frame
        );
        out += "pass             p50 ms   p95 ms       MB     GB/s   ×copy  (MB: modelled; copy: image to image, RGBA32F)\n";
        let number = |x: Option<f64>| x.map_or("—".to_owned(), |x| format!("{x:.2}"));
        for pass in &self.passes {
            let Percentiles { p50, p95, .. } = pass.milliseconds;
            let (mb, gb) = (number(pass.bytes.map(|b| b * 1e-6)), number(pass.gigabytes_per_second));
            let ratio = number(pass.ratio_to_copy);
            out += &format!("{:<14} {p50:>8.3} {p95:>8.3} {mb:>8} {gb:>8} {ratio:>7}\n", pass.name);
        }
        out += &format!("timing: {}\n", text("method"));
        for what in self.gpu["not_timed"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            out += &format!("not timed: {what}\n");
        }
        out
    }
}
