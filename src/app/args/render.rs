//! Options of `pointillist render`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{ArgGroup, Args, ValueEnum};

use super::display::DisplayArgs;
use super::scene::SceneArgs;
use super::values::{count, error, seconds, share};
use crate::study::ErrorQuantile;

/// `--error-at`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum QuantityArg {
    /// Half of the picture is better.
    Median,
    /// 95 % of it are.
    P95,
    /// 99 % are.
    P99,
}

impl From<QuantityArg> for ErrorQuantile {
    fn from(at: QuantityArg) -> Self {
        match at {
            QuantityArg::Median => ErrorQuantile::Median,
            QuantityArg::P95 => ErrorQuantile::P95,
            QuantityArg::P99 => ErrorQuantile::P99,
        }
    }
}

/// Options of `pointillist render`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("amount").args(["samples", "spp", "time"])))]
pub struct RenderArgs {
    /// What is traced.
    #[command(flatten)]
    pub source: SceneArgs,

    /// Output file, .exr or .png; may be given several times [default: the scene's name as .png].
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    pub outputs: Vec<PathBuf>,

    /// Camera paths in all, over the picture and its overscan; k, M, G are accepted.
    #[arg(long, value_name = "N", value_parser = count)]
    pub samples: Option<u64>,

    /// Samples per pixel [default: what the scene asks for, else 16].
    #[arg(long, value_name = "N", value_parser = count)]
    pub spp: Option<u64>,

    /// Stop after this many seconds of rendering.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    pub time: Option<Duration>,

    /// Stop when 95 % of the picture has this relative error or less, as 1% or 0.01; with --time, --spp or --samples whichever is
    /// first.
    #[arg(long, value_name = "E", value_parser = error)]
    pub error: Option<f64>,

    /// The part of the picture that --error is about.
    #[arg(long, value_name = "SHARE", default_value = "p95", requires = "error")]
    pub error_at: QuantityArg,

    /// Randomisations side by side, whose difference tells the error: 2, or 1 for a picture that does not know its own.
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2))]
    pub replicates: u8,

    /// First index of the sequence; the picture holds the paths from there on (for replaying one, with --samples 1).
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub first_index: u64,

    /// Rasterise samples in index order: the same bytes for any number of threads.
    #[arg(long)]
    pub deterministic: bool,

    /// Trace this share of the paths (0 to 1) by the fully general code too, and end with an error if the samples differ.
    #[arg(long, value_name = "F", default_value_t = 0.0, value_parser = share)]
    pub check_plan: f64,

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Write figures of the run as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE|-")]
    pub json: Option<PathBuf>,

    /// No progress bar, no summary; warnings and errors only.
    #[arg(long, short)]
    pub quiet: bool,

    /// Time every pass on the device and write one row per frame and scope: FILE as CSV, FILE.json as a Chrome trace.
    #[arg(long, value_name = "FILE")]
    pub gpu_timings: Option<PathBuf>,
}
