//! Options of `pointillist shard`, `merge` and `info`: renders in pieces.

use std::path::PathBuf;
use std::time::Duration;

use clap::{ArgGroup, Args};

use crate::client::Denoise;
use crate::cmd::args::display::DisplayArgs;
use crate::cmd::args::values::{AovArg, aov, count, error, seconds};
use crate::render::options::SceneOptions;
use crate::study::ErrorQuantile;

/// Options of `pointillist shard`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("amount").args(["samples", "spp"])))]
pub struct ShardArgs {
    /// What is traced. The same for all parts.
    #[command(flatten)]
    pub source: SceneOptions,

    /// Number of parts that the picture is divided into.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub of: u64,

    /// The part to render, from 1 on. A number above N goes on beyond the picture with more parts of the same size.
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u64).range(1..))]
    pub number: u64,

    /// Camera paths of the whole picture, over all parts; k, M, G are accepted.
    #[arg(long, value_name = "N", value_parser = count, help_heading = "Sampling")]
    pub samples: Option<u64>,

    /// Samples per pixel of the whole picture [default: what the scene asks for, else 16].
    #[arg(long, value_name = "N", value_parser = count, help_heading = "Sampling")]
    pub spp: Option<u64>,

    /// Layers that EXR files of the picture will have beside it, as for `render`.
    #[arg(long, value_name = "LIST", value_parser = aov, help_heading = "Output")]
    pub aov: Option<AovArg>,

    /// The state of the part. If it is there already, the part is gone on with, or left alone if it is complete.
    #[arg(short = 'o', long = "output", value_name = "FILE", help_heading = "Output")]
    pub output: PathBuf,

    /// Seconds between two states: as much is lost at most when the program is killed.
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = seconds, help_heading = "Output")]
    pub state_every: Duration,

    /// Write a report of the run as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE|-", help_heading = "Output")]
    pub json: Option<PathBuf>,

    /// Show no progress bar and no summary, only warnings and errors.
    #[arg(long, short, help_heading = "Output")]
    pub quiet: bool,
}

/// Options of `pointillist merge`.
#[derive(Args, Debug)]
pub struct MergeArgs {
    /// States of parts of one picture, in any order; a folder stands for all files in it whose names end in .state.
    #[arg(required = true)]
    pub states: Vec<PathBuf>,

    /// How the picture is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Filter noise out of the displayed picture, as for `render`; it needs the scene.
    #[arg(long, value_name = "KIND", default_value = "off", help_heading = "Output")]
    pub denoise: Denoise,

    /// Write the picture to this .exr or .png file, or the sum of the states to this .state file; may be given several times.
    #[arg(short = 'o', long = "output", value_name = "FILE", help_heading = "Output")]
    pub outputs: Vec<PathBuf>,

    /// Leave out states that are damaged, of another picture or there twice, and make the picture of what is there.
    #[arg(long)]
    pub allow_missing: bool,

    /// Say which further parts would bring the error down to this, as 1% or 0.01.
    #[arg(long, value_name = "E", value_parser = error)]
    pub error: Option<f64>,

    /// Quantile of the picture that --error is about.
    #[arg(long, value_name = "SHARE", default_value = "p95", requires = "error")]
    pub error_at: ErrorQuantile,

    /// Number of threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// Write what was merged as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE|-", help_heading = "Output")]
    pub json: Option<PathBuf>,

    /// Say nothing but warnings and errors.
    #[arg(long, short, help_heading = "Output")]
    pub quiet: bool,
}

/// Options of `pointillist info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// A state, or a picture in EXR or PNG.
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
}
