//! The subcommands and their arguments: the only module that knows the command line.
//!
//! `args/` reads the command line; its doc comments are the `--help`. Each subcommand has a file or a directory of its name, which converts
//! its arguments to plain options and calls the module that does the work: `render` for a picture, `viewer` for the window, `study` for the
//! analysis of measurements, `regress` for regression renders. Code used by only one subcommand is beside it.
//!
//! # Rendering from another program
//!
//! [`library`] has the subcommands `render` and `compare` as functions whose pictures are in memory, with the options of the command line by
//! name; `tools/python` is made of it. Below that,
//! the program is made of public parts. This loads a scene, renders it with the CPU implementation of the passes, and reads
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
//! use pointillist::study::{AccumulatedSamples, ErrorMonitor};
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
//! let mut film = ReferenceFilm::new(spec, 1)?;
//! let (mut accumulated, mut monitor) = (AccumulatedSamples::new([64, 64], filter.energy()), ErrorMonitor::new([64, 64], None));
//! let (server, mut lanes) = Server::start(2)?;
//! lanes.follow(Epoch(1), DrainOrder::Arrival);
//! server.render(job, Epoch(1))?;
//! while !lanes.is_drained() {
//!     lanes.wait(Duration::from_millis(20));
//!     let mut added = Ok(());
//!     lanes.drain(65_536, |block| {
//!         film.count_paths(block.header.paths);
//!         accumulated.add(block.header.first_index, block.header.paths, block.samples());
//!         added = std::mem::replace(&mut added, Ok(())).and_then(|()| film.add(block.samples()));
//!     });
//!     added?;
//! }
//! film.flush()?;
//! monitor.take_checkpoint(&accumulated, 0.0);
//!
//! let picture = develop::linear_rgb(&film.develop()?, &Profile::srgb());
//! let [median, p95, _] = monitor.status().estimate.relative;
//! println!("95 % of the picture have an error below {:.1} % (90 %: {:.1}–{:.1})", 100.0 * p95.value, 100.0 * p95.low, 100.0 * p95.high);
//! assert!(picture.len() == 64 * 64 && 0.0 < median.value && median.value < p95.value);
//! # Ok(())
//! # }
//! ```

mod args;
mod bench;
mod compare;
mod devices;
mod explain;
mod info;
pub mod library;
mod merge;
mod messages;
mod mix;
mod plugins;
mod regress;
mod render;
mod replay;
mod serve;
mod shard;
mod study;
mod view;

pub use crate::render::process::tell;
pub use args::{Cli, CliCommand};
pub use messages::print_messages;

use std::process::ExitCode;

use crate::render::{pipelines, process};
use miette::Result;

/// Runs the subcommand of the command line, and returns the exit code of one that did what it was asked for.
///
/// # Errors
///
/// Any error that stops the run, ready to be printed: with file, line and column if the scene is at fault.
pub fn run(cli: Cli) -> Result<ExitCode> {
    crate::memory::limit_free_memory();
    process::listen_for_snapshots();
    let outcome = match cli.command {
        CliCommand::Render(args) => render::render(*args),
        CliCommand::Shard(args) => shard::shard(*args),
        CliCommand::Merge(args) => merge::merge(&args),
        CliCommand::Info(args) => info::info(&args),
        CliCommand::Replay(args) => replay::replay(&args),
        CliCommand::View(args) => view::view(*args),
        CliCommand::Serve(args) => serve::serve(&args),
        CliCommand::Bench(args) => bench::bench(&args),
        CliCommand::Explain(args) => explain::explain(&args),
        CliCommand::Compare(args) => compare::compare(&args),
        CliCommand::Mix(args) => mix::mix(&args),
        CliCommand::Study(args) => study::study(&args),
        CliCommand::Regress(args) => return Ok(regress::regress(&args)),
        CliCommand::Plugins(args) => plugins::list(&args),
        CliCommand::Devices => devices::list(),
    };
    pipelines::save_kept();
    outcome.map(|()| ExitCode::SUCCESS)
}
