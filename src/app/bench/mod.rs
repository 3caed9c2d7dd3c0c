//! `pointillist bench`: the time of every pass, as the viewer runs them, without a window.
//!
//! The tracer runs all the while. A frame takes what is in the lanes (a batch at most), rasterises it, paints the picture, and
//! copies the scene-linear picture's worth of `Rgba32F` texels from image to image: the yardstick of all passes. Two frames are
//! in flight. The first [`run::WARM_UP`] frames compile pipelines and touch memory; they are not counted.

mod figures;
mod model;
mod run;

use std::sync::Arc;
use std::time::Instant;

use miette::{IntoDiagnostic, Result};

use super::args::BenchArgs;
use super::device::Device;
use super::load::{self, Opened};
use super::report::{Seconds, check_json, print, write_json};
use super::run_spec::RunSpec;
use super::timings::{self, TimingCapture};
use super::{method, process};
use crate::client::Settings;
use crate::client::film::VulkanFilm;
use crate::gpu::Gpu;
use crate::tracer::{Camera, Scene};
use figures::Figures;
pub use run::Measured;

/// Runs the subcommand.
///
/// # Errors
///
/// Whatever stops the run; `--device cpu` and machines without Vulkan have no passes to time.
pub fn bench(args: &BenchArgs) -> Result<()> {
    if let Some(path) = &args.gpu_timings {
        timings::check(path, args.json.iter().chain([&args.source.scene]))?;
    }
    check_json(args.json.as_deref(), &args.source.scene)?;
    process::listen_for_interrupt();
    let started = Instant::now();
    let Opened { input, scene, camera, device } = load::open(&args.source, &mut Seconds::default())?;
    let Device::Vulkan(gpu) = &device else {
        return Err(miette::miette!(
            "bench times the passes of a Vulkan device, and there is none here (--device cpu has none); \
             `pointillist devices` lists what there is"
        ));
    };
    let mut run = RunSpec::of(&args.source, &input, device.name());
    let (scene, threads) = (Arc::new(scene), args.source.threads());
    method::choose(&mut run, &scene, &camera, threads);
    method::tell_choice(&run);
    let film = VulkanFilm::new(gpu.clone(), run.film).into_diagnostic()?;
    let job = (&run, (scene, camera), threads);
    let capture = args.gpu_timings.as_deref().map(|path| TimingCapture::new(path, Some(gpu))).transpose()?;
    tracing::info!("ready after {:.2} s", started.elapsed().as_secs_f64());
    let settings = args.display.settings();
    let measured = run::run(gpu, film, job, (&settings, args.frames), capture)?;
    let figures = Figures::new(&measured, gpu, (&run, &settings));
    if args.json.as_deref() != Some("-".as_ref()) {
        print(&figures.table(), "the figures");
    }
    if let Some(path) = &args.json {
        write_json(&figures, path)?;
    }
    Ok(())
}

/// Runs `frames` frames as [`bench`] does.
///
/// # Errors
///
/// As [`bench`].
pub fn measure(
    gpu: &Arc<Gpu>,
    job: (&RunSpec, (Arc<Scene>, Camera), usize),
    shown: (&Settings, u32),
) -> Result<Measured> {
    let film = VulkanFilm::new(gpu.clone(), job.0.film).into_diagnostic()?;
    run::run(gpu, film, job, shown, None)
}
