//! Options of the window as plain data; the options of `pointillist view` of the same names explain each.

use std::path::PathBuf;

use crate::client::{Denoise, Settings};
use crate::gpu::DeviceFaults;
use crate::render::options::{SceneOptions, StereoOptions};

/// Scene name for a window without a scene of its own: it takes that of its first tracer.
pub const OF_TRACER: &str = "@tracer";

/// A window and what it shows.
#[derive(Clone, Debug)]
pub struct ViewOptions {
    /// Scene and method; [`OF_TRACER`] for the scene of the first tracer.
    pub source: SceneOptions,
    /// Remote tracers.
    pub tracers: TracerOptions,
    /// Display settings, without the noise filter.
    pub display: Settings,
    /// Use the exposure of `display`; otherwise auto-exposure.
    pub fixed_exposure: bool,
    /// The noise filter; `None` for the default under the other options.
    pub denoise: Option<Denoise>,
    /// Begin every view without a reprojection of the last one.
    pub no_reproject: bool,
    /// Trace the first samples of a view where the reprojection shows least.
    pub steer: bool,
    /// Target frame rate in frames per second; `None` for the display's refresh rate.
    pub fps: Option<f32>,
    pub no_panel: bool,
    /// Pictures of two eyes.
    pub stereo: Option<StereoOptions>,
    /// Camera paths after which tracing stops.
    pub samples: Option<u64>,
    /// Rasterise samples in index order and in whole batches.
    pub deterministic: bool,
    /// Number of independent randomisations, 1 or 2.
    pub replicates: u8,
    /// Pictures to write when the window closes.
    pub outputs: Vec<PathBuf>,
    /// `HOST:PORT` of the viewer tev.
    pub tev: Option<String>,
    pub json: Option<PathBuf>,
    pub gpu_timings: Option<PathBuf>,
    /// Faults planned by a test.
    pub faults: DeviceFaults,
}

/// Remote tracers; without an address the process traces by itself.
#[derive(Clone, Debug)]
pub struct TracerOptions {
    /// `HOST:PORT` of each.
    pub connect: Vec<String>,
    /// File with their secret.
    pub token_file: Option<PathBuf>,
    pub compress: Compression,
}

/// Whether samples come in 12 bytes instead of 24.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Compression {
    /// From other machines, and not from this one
    Auto,
    /// Always: through a tunnel every address looks like this machine's
    On,
    /// Never
    Off,
}
