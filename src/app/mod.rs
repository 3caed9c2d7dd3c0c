//! The program: the only module that knows both server and client.
//!
//! | files | what |
//! |---|---|
//! | `args/` | the command line; its comments are the `--help` |
//! | `render.rs`, `replay.rs`, `view/`, `bench.rs`, `explain.rs`, `compare.rs`, `mix.rs`, `study/`, `plugins.rs`, `device.rs` | the subcommands |
//! | `shard.rs`, `merge.rs`, `info.rs`, `state/` | renders in parts: their files, their sum |
//! | `serve.rs`, `remote_order.rs`, `edited_scene.rs` | the tracer of a window elsewhere; what that has it trace; a scene with changes |
//! | `load.rs`, `warnings.rs`, `run_spec.rs`, `method.rs` | scene and device; what is said of the scene; what a run is made of; its method of light transport |
//! | `drive.rs`, `film_writer.rs`, `observer.rs`, `predictions.rs`, `progress.rs` | from lanes to film; the error of the picture meanwhile |
//! | `plan.rs`, `outputs.rs`, `layers.rs`, `light_groups.rs`, `report.rs`, `rejected.rs` | the list of effects; pictures; layers beside them; pictures by groups of lights; figures; rejected values in words |
//! | `denoise.rs`, `filtered_picture.rs`, `noise_filter.rs`, `reprojection.rs` | the noise filter of a view, with its rays; what it makes of samples; its thread in the window; what another view has shown |
//! | `live_outputs.rs`, `tev.rs` | snapshots of a render on its way; the same picture in the viewer tev |
//! | `timings.rs`, `trace.rs`, `process.rs`, `pipelines.rs` | `--gpu-timings`; signals and standard error; the file of compiled pipelines |
//!
//! # Rendering from another program
//!
//! The program is made of public parts. This loads a scene, renders it with the CPU implementation of the passes, and reads
//! the error of the picture:
//!
//! ```
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use std::path::Path;
//! use std::sync::Arc;
//! use std::time::Duration;
//!
//! use pointillist::client::reference::ReferenceFilm;
//! use pointillist::client::{Film, FilmSpec, SplatFilter, develop};
//! use pointillist::color::Profile;
//! use pointillist::server::{RenderJob, Server};
//! use pointillist::stream::{DrainOrder, Epoch};
//! use pointillist::study::ErrorMonitor;
//! use pointillist::tracer::integrator::{RenderContext, Replicated};
//! use pointillist::tracer::{Camera, PathTracer, Scene};
//!
//! let desc = pointillist::scene::load(Path::new("scenes/cornell.xml"), &[])?.desc;
//! let filter = SplatFilter::Gaussian;
//! let spec = FilmSpec { width: 64, height: 64, filter, variance: None, sums: Default::default() };
//! let (scene, camera) = (Arc::new(Scene::prepare(&desc)?), Camera::of(&desc)?);
//! let context = RenderContext::new(scene, camera, &desc.integrator, 0, spec.window());
//! // Two independent randomisations, whose difference tells the error of their mean.
//! let tracer = Replicated::new(&context, true, PathTracer::from);
//! let [width, height] = spec.padded_extent().map(u64::from);
//! let mut job = RenderJob::new(Arc::new(tracer), 0..16 * width * height);
//! job.window = spec.window();
//!
//! let (mut film, mut monitor) = (ReferenceFilm::new(spec, 1)?, ErrorMonitor::new([64, 64], filter.energy(), None));
//! let (server, mut lanes) = Server::start(2)?;
//! lanes.follow(Epoch(1), DrainOrder::Arrival);
//! server.render(job, Epoch(1))?;
//! while !lanes.is_drained() {
//!     lanes.wait(Duration::from_millis(20));
//!     let mut added = Ok(());
//!     lanes.drain(65_536, |block| {
//!         film.count_paths(block.header.paths);
//!         monitor.add(block.header.first_index, block.header.paths, block.samples());
//!         added = std::mem::replace(&mut added, Ok(())).and_then(|()| film.add(block.samples()));
//!     });
//!     added?;
//! }
//! film.flush()?;
//! monitor.take_checkpoint(0.0);
//!
//! let picture = develop::linear_rgb(&film.develop()?, &Profile::srgb());
//! let [median, p95, _] = monitor.status().estimate.relative;
//! println!("95 % of the picture have an error below {:.1} % (90 %: {:.1}–{:.1})", 100.0 * p95.value, 100.0 * p95.low, 100.0 * p95.high);
//! assert!(picture.len() == 64 * 64 && 0.0 < median.value && median.value < p95.value);
//! # Ok(())
//! # }
//! ```

mod adaptive;
mod args;
mod bench;
mod compare;
mod denoise;
mod device;
mod drive;
mod edited_scene;
mod explain;
mod film_writer;
mod filtered_picture;
mod info;
mod layers;
mod light_groups;
mod live_outputs;
mod load;
mod merge;
mod method;
mod mix;
mod noise_filter;
mod observer;
mod outputs;
mod pipelines;
mod plan;
mod plugins;
mod predictions;
mod process;
mod progress;
mod rejected;
mod remote_order;
mod render;
mod replay;
mod report;
mod reprojection;
mod run_spec;
mod serve;
mod shard;
mod state;
mod study;
mod tev;
mod timings;
mod trace;
mod view;
mod warnings;

pub use args::{Cli, CliCommand};
pub use process::tell;

use miette::Result;

/// Runs what the command line asks for.
///
/// # Errors
///
/// Everything that stops the run, ready to be printed: with file, line and column where a scene is at fault.
pub fn run(cli: Cli) -> Result<()> {
    process::listen_for_snapshots();
    let outcome = match cli.command {
        CliCommand::Render(args) => render::render(*args),
        CliCommand::Shard(args) => shard::shard(*args),
        CliCommand::Merge(args) => merge::merge(&args),
        CliCommand::Info(args) => info::info(&args),
        CliCommand::Replay(args) => replay::replay(&args),
        CliCommand::View(args) => view::view(&args),
        CliCommand::Serve(args) => serve::serve(&args),
        CliCommand::Bench(args) => bench::bench(&args),
        CliCommand::Explain(args) => explain::explain(&args),
        CliCommand::Compare(args) => compare::compare(&args),
        CliCommand::Mix(args) => mix::mix(&args),
        CliCommand::Study(args) => study::study(&args),
        CliCommand::Plugins(args) => plugins::list(&args),
        CliCommand::Devices => device::list(),
    };
    pipelines::save_kept();
    outcome
}
