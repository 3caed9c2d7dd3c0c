//! What a window is asked for, as plain data: the options of `pointillist view` of the same names explain each.

use std::path::PathBuf;

use crate::client::{Denoise, Settings};
use crate::gpu::CallFault;
use crate::render::options::SceneOptions;

/// The scene of a window that has none of its own: that of its first tracer.
pub const OF_TRACER: &str = "@tracer";

/// A window and what it shows.
#[derive(Clone, Debug)]
pub struct ViewOptions {
    /// What is traced; [`OF_TRACER`] for the scene of the first tracer.
    pub source: SceneOptions,
    /// Where it is traced.
    pub tracers: TracerOptions,
    /// How it is shown, without the noise filter.
    pub display: Settings,
    /// The exposure is that of `display`; otherwise it follows the light of the scene.
    pub fixed_exposure: bool,
    /// The noise filter; without it the usual one of the other options.
    pub denoise: Option<Denoise>,
    /// Every view begins with samples alone.
    pub no_reproject: bool,
    /// Frames per second that are aimed at; the display's rate without it.
    pub fps: Option<f32>,
    pub no_panel: bool,
    /// Camera paths after which tracing stops.
    pub samples: Option<u64>,
    /// Samples are rasterised in index order and in whole batches.
    pub deterministic: bool,
    /// Independent randomisations, 1 or 2.
    pub replicates: u8,
    /// Pictures that are written when the window closes.
    pub outputs: Vec<PathBuf>,
    /// `HOST:PORT` of the viewer tev.
    pub tev: Option<String>,
    pub json: Option<PathBuf>,
    pub gpu_timings: Option<PathBuf>,
    /// For tests: frames after which the device is lost.
    pub lose_device_after: Vec<u64>,
    /// For tests: calls that fail.
    pub fail_call: Vec<CallFault>,
    /// For tests: device memory for images and buffers, MiB.
    pub device_memory: Option<u64>,
}

/// Tracers on other machines; without an address the window traces by itself.
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
