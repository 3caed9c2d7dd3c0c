//! Options of `pointillist study`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};

use crate::client::SplatFilter;
use crate::cmd::args::display::DisplayArgs;
use crate::cmd::args::scene::SimdArg;
use crate::cmd::args::values::seconds;
use crate::scene::desc::IntegratorKind;

/// Options of `pointillist study`.
#[derive(Args, Debug)]
pub struct StudyArgs {
    /// The scene, a Mitsuba XML file of version 0.4 to 3.
    #[arg(required_unless_present_any = ["predictions", "collect"])]
    pub scene: Option<PathBuf>,

    /// Methods to compare [default: all that can show the picture].
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub methods: Vec<IntegratorKind>,

    /// Parts to measure [default: all].
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub knobs: Vec<StudySection>,

    /// The reference, an EXR of the same size [default: made of all pictures of the study, each judged by the others].
    #[arg(long, value_name = "REF.exr")]
    pub against: Option<PathBuf>,

    /// Seconds that the study may take, loading the scene included. A further run adds to its measurements.
    ///
    /// 20 s give a recommendation with wide intervals. Parts that do not fit are named.
    #[arg(long, value_name = "SECONDS", default_value = "120", value_parser = seconds)]
    pub budget: Duration,

    /// Folder for the page, the tables and all measurements [default: study-SCENE].
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// A picture of another program to show beside ours: name, wall-clock seconds, file; may be given several times.
    #[arg(long, value_name = "NAME=SECONDS:FILE.exr", value_parser = peer)]
    pub peer: Vec<Peer>,

    /// Print how often the intervals of predicted times held on this machine, and end.
    ///
    /// Renders log every prediction with its outcome in ~/.local/state/pointillist/predictions.jsonl, or in the folder
    /// $POINTILLIST_STATE.
    #[arg(long)]
    pub predictions: bool,

    /// Collect the studies in the folders below DIR into one page in the folder of -o, and end.
    #[arg(long, value_name = "DIR", requires = "output")]
    pub collect: Option<PathBuf>,

    /// Value for a $NAME in the scene; may be given several times.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = crate::cmd::args::values::define, help_heading = "Scene")]
    pub defines: Vec<(String, String)>,

    /// Study a scene although it holds plugins that are not supported, see `render --help`.
    #[arg(long, help_heading = "Scene")]
    pub lenient: bool,

    /// Show every warning about the scene with its source line, see `render --help`.
    #[arg(long, help_heading = "Scene")]
    pub verbose: bool,

    /// Picture size in pixels, instead of the film's size and crop.
    #[arg(long, value_name = "WxH", value_parser = crate::cmd::args::values::size, help_heading = "Scene")]
    pub size: Option<(u32, u32)>,

    /// Splat filter [default: as `render`, the scene's or a Gaussian]. Box makes pixels comparable with those of other programs.
    #[arg(long, value_name = "KIND", help_heading = "Scene")]
    pub filter: Option<SplatFilter>,

    /// Number of tracer threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = "Scene")]
    pub threads: Option<u16>,

    /// Processor instructions that trace rays; all give the same samples, bit for bit.
    #[arg(long, value_name = "KIND", default_value = "auto", help_heading = "Scene")]
    pub simd: SimdArg,

    /// Vulkan device by index or part of its name, or `cpu` for the same passes in Rust [default: the best device].
    #[arg(long, value_name = "NAME|INDEX|cpu", help_heading = "Scene")]
    pub device: Option<String>,

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Show no progress and no summary, only errors.
    #[arg(long, short)]
    pub quiet: bool,
}

/// A part of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum StudySection {
    /// Error against time of each method, time to an error, predictions, rejected samples
    Methods,
    /// The cost of each effect in time and noise, and what the picture loses without it (FLIP)
    Effects,
    /// --adaptive, --denoise, --reweight-fireflies and --light-groups against a render without, in the same time
    Options,
    /// Cost and error of reconstruction, its kernel, masking, glare, splat filter, variance and sums
    Display,
    /// The cost of more exact arithmetic
    Numeric,
    /// The cost of knowing the error
    Replicates,
}

/// `--peer`.
#[derive(Clone, Debug)]
pub struct Peer {
    /// The program's name.
    pub name: String,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// The picture.
    pub file: PathBuf,
}

fn peer(text: &str) -> Result<Peer, &'static str> {
    let parse = || {
        let (name, rest) = text.split_once('=')?;
        let (time, file) = rest.split_once(':')?;
        let (name, seconds) = (name.trim().to_string(), seconds(time).ok()?.as_secs_f64());
        (!name.is_empty() && !file.is_empty()).then(|| Peer { name, seconds, file: file.into() })
    };
    parse().ok_or("expected NAME=SECONDS:FILE.exr, such as \"Mitsuba path=3.1:path.exr\"")
}
