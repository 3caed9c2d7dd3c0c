//! Options of `pointillist view`.

use std::path::PathBuf;

use clap::Args;

use super::display::DisplayArgs;
use super::scene::SceneArgs;
use super::values::{count, positive};
use crate::client::ColorOutput;

/// Options of `pointillist view`.
#[derive(Args, Debug)]
pub struct ViewArgs {
    /// What is traced.
    #[command(flatten)]
    pub source: SceneArgs,

    /// Pictures per second aimed at [default: the display's rate].
    #[arg(long, value_name = "N", value_parser = positive)]
    pub fps: Option<f32>,

    /// Write the picture here when the window closes, .exr or .png; may be given several times.
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    pub outputs: Vec<PathBuf>,

    /// Stop tracing after this many camera paths; the window stays open.
    #[arg(long, value_name = "N", value_parser = count)]
    pub samples: Option<u64>,

    /// Rasterise in index order and whole batches: with --samples the same bytes as `render --deterministic`.
    #[arg(long)]
    pub deterministic: bool,

    /// Randomisations side by side, whose difference tells the error: 2, or 1 for a picture that does not know its own.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2))]
    pub replicates: u8,

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Begin without the panel.
    #[arg(long)]
    pub no_panel: bool,

    /// Colours of the window, where the display offers them.
    #[arg(long, value_name = "KIND", default_value = "sdr")]
    pub hdr: ColorOutput,

    /// For tests: the device is lost after this many frames; given again, the one after it, too.
    #[arg(long, value_name = "N", hide = true)]
    pub lose_device_after: Vec<u64>,

    /// For tests: the surface is lost once after this many frames.
    #[arg(long, value_name = "N", hide = true)]
    pub lose_surface_after: Option<u64>,

    /// Time every pass on the device and write one row per frame and scope: FILE as CSV, FILE.json as a Chrome trace.
    #[arg(long, value_name = "FILE")]
    pub gpu_timings: Option<PathBuf>,

    /// Write figures of the session as JSON when the window closes; `-` is standard output.
    #[arg(long, value_name = "FILE|-")]
    pub json: Option<PathBuf>,
}
