//! Options of `pointillist bench` and `pointillist explain`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use crate::cmd::args::display::DisplayArgs;
use crate::cmd::args::values::{composed_layout, error, seconds};
use crate::image::stereo::StereoLayout;
use crate::render::options::SceneOptions;
use crate::study::ErrorQuantile;

/// Options of `pointillist bench`.
#[derive(Args, Debug)]
pub struct BenchArgs {
    /// What is traced.
    #[command(flatten)]
    pub source: SceneOptions,

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Time nothing: print the bytes that every pass moves by design at 512×512, 1920×1080 and 3840×2160.
    #[arg(long)]
    pub bytes: bool,

    /// Time the passes of two eyes, which see what `view --stereo` shows in this layout.
    #[arg(
        long,
        value_name = "LAYOUT",
        num_args = 0..=1,
        default_missing_value = StereoLayout::SideBySide.name(),
        value_parser = composed_layout
    )]
    pub stereo: Option<StereoLayout>,

    /// Number of frames to measure, after a warm-up.
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub frames: u32,

    /// Write when every pass, worker and client step ran: FILE as CSV, FILE.json as a Chrome trace (see `render --help`).
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub gpu_timings: Option<PathBuf>,

    /// Write the report as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE|-", help_heading = "Output")]
    pub json: Option<PathBuf>,
}

/// Options of `pointillist explain`.
#[derive(Args, Debug)]
pub struct ExplainArgs {
    /// What is traced.
    #[command(flatten)]
    pub source: SceneOptions,

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Measure what each effect costs, after the list: a line for each as soon as it is known. Ctrl-C ends it.
    ///
    /// Paths with an effect of the tracer and without it are timed in turn, and on a Vulkan device frames with an effect of the client and
    /// without it. That takes some seconds, for large pictures on a slow device minutes. Without it the JSON has no costs (share,
    /// milliseconds, if_on, once, if_on_share, bytes), and neither memory nor pipelines.
    #[arg(long)]
    pub prices: bool,

    /// Say how many machines reach this relative error in what time, from a trial on this one; `1%` or `0.01`.
    #[arg(long, value_name = "ERROR", value_parser = error, help_heading = "Machines and time")]
    pub error: Option<f64>,

    /// Quantile of the picture that --error is about.
    #[arg(long, value_name = "SHARE", default_value = "p95", help_heading = "Machines and time")]
    pub error_at: ErrorQuantile,

    /// Longest time of the trial, seconds.
    #[arg(long, value_name = "SECONDS", default_value = "10", value_parser = seconds, help_heading = "Machines and time")]
    pub trial: Duration,

    /// Write the list as JSON, to standard output or to FILE: `--json=FILE`.
    #[arg(
        long,
        value_name = "FILE|-",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "-",
        help_heading = "Output"
    )]
    pub json: Option<PathBuf>,
}
