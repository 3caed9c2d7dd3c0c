//! Options of `pointillist study`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};

use super::display::DisplayArgs;
use super::scene::SimdArg;
use super::values::seconds;
use crate::client::SplatFilter;
use crate::scene::desc::IntegratorKind;

/// Options of `pointillist study`.
#[derive(Args, Debug)]
pub struct StudyArgs {
    /// The scene, a Mitsuba 3 XML file.
    #[arg(required_unless_present_any = ["predictions", "collect"])]
    pub scene: Option<PathBuf>,

    /// Methods that are compared [default: path, light, bidirectional, photon].
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub methods: Vec<IntegratorKind>,

    /// Parts that are measured [default: all].
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub knobs: Vec<Knob>,

    /// The reference, an EXR of the same size [default: a long render, kept in the folder].
    #[arg(long, value_name = "REF.exr")]
    pub against: Option<PathBuf>,

    /// Seconds that it may take; what does not fit is left to the next run, which adds to this one.
    #[arg(long, value_name = "SECONDS", default_value = "120", value_parser = seconds)]
    pub budget: Duration,

    /// Folder for the page, the tables and all that is measured [default: study-SCENE].
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// A picture of another program, its name and the wall-clock seconds that it took; may be given several times.
    #[arg(long, value_name = "NAME=SECONDS:FILE.exr", value_parser = peer)]
    pub peer: Vec<Peer>,

    /// Print how often the predictions of renders on this machine held, and end.
    #[arg(long)]
    pub predictions: bool,

    /// Make one page of the studies in the folders below DIR, in the folder of -o, and end.
    #[arg(long, value_name = "DIR", requires = "output")]
    pub collect: Option<PathBuf>,

    /// Give a value to a $name in the scene; may be given several times.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = super::values::define)]
    pub defines: Vec<(String, String)>,

    /// Picture size in pixels; replaces the film's size and crop.
    #[arg(long, value_name = "WxH", value_parser = super::values::size)]
    pub size: Option<(u32, u32)>,

    /// Splat filter [default: box, so that pixels compare with those of other programs].
    #[arg(long, value_name = "KIND", default_value = "box")]
    pub filter: SplatFilter,

    /// Tracer threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// Instructions that walk the rays.
    #[arg(long, value_name = "KIND", default_value = "auto")]
    pub simd: SimdArg,

    /// Vulkan device by index or part of its name, or `cpu` for none [default: the best there is].
    #[arg(long, value_name = "NAME|INDEX|cpu")]
    pub device: Option<String>,

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// No progress, no summary; errors only.
    #[arg(long, short)]
    pub quiet: bool,
}

/// A part of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Knob {
    /// Convergence and prices, predictions, stability: all that curves tell.
    Methods,
    /// What each effect costs, and what the picture loses without it.
    Effects,
    /// Reconstruction and its kernel, filter, sums, variance, glare: milliseconds against error.
    Display,
    /// Cheap arithmetic against more exact arithmetic.
    Numeric,
    /// What it costs to know the error.
    Replicates,
}

/// `--peer`.
#[derive(Clone, Debug)]
pub struct Peer {
    /// What it is called.
    pub name: String,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// The picture.
    pub file: PathBuf,
}

fn peer(text: &str) -> Result<Peer, String> {
    let parse = || {
        let (name, rest) = text.split_once('=')?;
        let (time, file) = rest.split_once(':')?;
        let seconds = seconds(time).ok()?.as_secs_f64();
        (!name.trim().is_empty() && !file.is_empty()).then(|| Peer {
            name: name.trim().to_string(),
            seconds,
            file: file.into(),
        })
    };
    parse().ok_or_else(|| "expected NAME=SECONDS:FILE.exr, such as \"Mitsuba path=3.1:path.exr\"".to_string())
}
