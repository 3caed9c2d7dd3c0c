//! Options of `pointillist compare`.

use std::path::PathBuf;

use clap::builder::PossibleValue;
use clap::{Args, ValueEnum};

use crate::client::Settings;
use crate::cmd::args::values::positive;

/// Options of `pointillist compare`.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// The picture, an OpenEXR file of any program; linear Rec.709 is assumed.
    pub picture: PathBuf,

    /// The reference, another file of the same size.
    pub reference: PathBuf,

    /// Metrics to print, in this order [default: all that the files allow].
    ///
    /// rse and z need the channel variance.Y, which `pointillist render -o FILE.exr` writes.
    #[arg(long = "metric", value_name = "LIST", value_delimiter = ',')]
    pub metrics: Vec<Metric>,

    /// Layer to compare: one name for both files, or one for each; an empty name is the layer without a name. The views of a stereo file are its
    /// layers left and right.
    #[arg(long = "layer", value_name = "NAME", value_delimiter = ',')]
    pub layers: Vec<String>,

    /// Write the first metric of --metric, or flip, pixel by pixel: .png in false colours, .exr as numbers.
    #[arg(long, value_name = "FILE")]
    pub map: Option<PathBuf>,

    /// Write the metrics as JSON, to standard output or to FILE: `--json=FILE`.
    #[arg(long, value_name = "FILE|-", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    pub json: Option<PathBuf>,

    /// Brightness B of the tone curve, which flip and delta-e see the pictures through.
    #[arg(long, value_name = "B", default_value_t = Settings::default().exposure, value_parser = positive)]
    pub exposure: f32,
}

/// `--metric`. The comments are its help, and the last column of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Metric {
    /// mean of the squared error by the reference's luminance² + 0.01; 0 is equal, less is better
    Relmse,
    /// relmse without the worst 0.1 % of pixels; less is better
    Trimmed,
    /// mean of the absolute error by the sum of both; 0 equal … 1 all wrong, less is better
    Smape,
    /// FLIP: seen when the two alternate on a screen 0.7 m wide, 0.7 m away; 0 equal … 1, less is better
    Flip,
    /// distance of displayed colours in OKLab; 0.02 just seen, 1 black from white, less is better
    DeltaE,
    /// median standard error of the picture by its brightness, from its variance; less is better
    Rse,
    /// share of pixels that may be equal, by the variances of both, at 1 % for all; mean z² is 1 where noise explains all
    Z,
}

impl Metric {
    /// The metric's name on the command line and in JSON.
    pub fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// The meaning of the value, in one line.
    pub fn meaning(self) -> String {
        let help = |value: PossibleValue| value.get_help().map(ToString::to_string);
        self.to_possible_value().and_then(help).unwrap_or_default()
    }
}
