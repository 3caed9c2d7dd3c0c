//! What was measured, as a table and as JSON.

use serde::Serialize;
use serde_json::Value;

use super::model;
use super::run::{Measured, WARM_UP};
use crate::app::report::human;
use crate::app::run_spec::RunSpec;
use crate::app::timings::describe;
use crate::client::Settings;
use crate::gpu::Gpu;

/// The figures of a run. Field names are the JSON keys.
#[derive(Debug, Serialize)]
pub struct Figures {
    version: &'static str,
    /// The command line, word by word.
    command: Vec<String>,
    /// System, architecture, cores.
    host: String,
    /// Device, driver, Vulkan version, method of timing, what is not timed.
    gpu: Value,
    width: u32,
    height: u32,
    integrator: &'static str,
    reconstruction: String,
    vm: f32,
    tracer_threads: usize,
    frames: usize,
    /// Frames before, which are not counted.
    warm_up_frames: u32,
    frame_ms: Percentiles,
    /// Samples that reached the film per second of wall time, and camera paths.
    traced_samples_per_second: f64,
    traced_paths_per_second: f64,
    /// Samples per second of the device's time in splat, fold and variance.
    rasterised_samples_per_second: Option<f64>,
    samples_per_frame: f64,
    scopes_without_time: u64,
    /// What the bytes are.
    bytes_model: &'static str,
    copy: &'static str,
    passes: Vec<Pass>,
}

#[derive(Clone, Copy, Debug, Serialize)]
struct Percentiles {
    p50: f64,
    p95: f64,
}

impl Percentiles {
    /// Of an ascending list.
    fn of(sorted: &[f64]) -> Self {
        let at = |p: f64| sorted.get(((sorted.len() as f64 * p).ceil() as usize).saturating_sub(1));
        Self { p50: at(0.5).copied().unwrap_or(0.0), p95: at(0.95).copied().unwrap_or(0.0) }
    }
}

/// One pass; several runs in a frame (two streams) are added up.
#[derive(Debug, Serialize)]
struct Pass {
    name: &'static str,
    /// Frames in which it ran.
    frames: usize,
    milliseconds: Percentiles,
    /// Bytes moved per frame by the model; `None` where there is none for this pass.
    bytes: Option<f64>,
    /// By bytes and p50.
    gigabytes_per_second: Option<f64>,
    /// p50 over that of the copy.
    ratio_to_copy: Option<f64>,
}

impl Figures {
    pub fn new(measured: &Measured, gpu: &Gpu, (run, settings): (&RunSpec, &Settings)) -> Self {
        let find = |name: &str| measured.passes.iter().find(|(n, _)| *n == name);
        let copy = find("copy").map(|(_, t)| Percentiles::of(t).p50).filter(|t| *t > 0.0);
        let wall = measured.wall.as_secs_f64().max(1e-9);
        let frames = measured.frames.len();
        let per_frame = measured.samples as f64 / frames.max(1) as f64;
        let passes = measured.passes.iter().map(|(name, times)| {
            let milliseconds = Percentiles::of(times);
            let runs = *measured.runs.get(name).unwrap_or(&0) as f64 / times.len().max(1) as f64;
            // The samples of a frame are shared by its runs.
            let bytes =
                model::bytes(name, &run.film, per_frame / runs.max(1.0), settings.vm > 0.0).map(|b| b * runs);
            let seconds = milliseconds.p50 * 1e-3;
            Pass {
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
            integrator: run.integrator.name(),
            reconstruction: format!("{:?}", settings.reconstruction),
            vm: settings.vm,
            tracer_threads: measured.threads,
            frames,
            warm_up_frames: WARM_UP,
            frame_ms: Percentiles::of(&measured.frames),
            traced_samples_per_second: measured.samples as f64 / wall,
            traced_paths_per_second: measured.paths as f64 / wall,
            rasterised_samples_per_second: (raster > 0.0).then(|| measured.samples as f64 / raster),
            samples_per_frame: per_frame,
            scopes_without_time: measured.untimed,
            bytes_model: "every texel read and written once per pass, blended sprites read and write their footprint; \
                          none for mips unless noise is masked (then the whole chain), nor for passes without a model; \
                          `variance` includes `variance fold`",
            copy: "vkCmdCopyImage of the picture, RGBA 32-bit floats, in every frame",
            passes: passes.collect(),
        }
    }

    /// For people.
    pub fn table(&self) -> String {
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
            "frame p50 {:.2} ms, p95 {:.2} ms; {} samples/s traced, {} samples/s rasterised, {:.0} samples per frame\n",
            self.frame_ms.p50,
            self.frame_ms.p95,
            human(self.traced_samples_per_second),
            self.rasterised_samples_per_second.map_or("?".to_owned(), human),
            self.samples_per_frame
        );
        out += "pass             p50 ms   p95 ms       MB     GB/s   ×copy  (MB: modelled; copy: image to image, RGBA32F)\n";
        let number = |x: Option<f64>| x.map_or("—".to_owned(), |x| format!("{x:.2}"));
        for pass in &self.passes {
            let Percentiles { p50, p95 } = pass.milliseconds;
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
