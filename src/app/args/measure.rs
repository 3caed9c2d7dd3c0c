//! Options of `pointillist bench` and `pointillist explain`.

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

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

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
    pub source: SceneArgs,

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// List effects and reasons only; measure no costs.
    #[arg(long)]
    pub no_costs: bool,

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
