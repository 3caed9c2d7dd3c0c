//! Options of `pointillist bench`.

use std::path::PathBuf;

use clap::Args;

use super::display::DisplayArgs;
use super::scene::SceneArgs;

/// Options of `pointillist bench`.
#[derive(Args, Debug)]
pub struct BenchArgs {
    /// What is traced.
    #[command(flatten)]
    pub source: SceneArgs,

    /// Frames to measure.
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub frames: u32,

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Time every pass on the device and write one row per frame and scope: FILE as CSV, FILE.json as a Chrome trace.
    #[arg(long, value_name = "FILE")]
    pub gpu_timings: Option<PathBuf>,

    /// Write the figures as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE|-")]
    pub json: Option<PathBuf>,
}
