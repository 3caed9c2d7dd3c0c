//! Options of `pointillist compare`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::values::positive;
use crate::client::Settings;

/// Options of `pointillist compare`.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// The picture, an OpenEXR file of any program; linear Rec.709 is assumed.
    pub picture: PathBuf,

    /// The reference, another of the same size.
    pub reference: PathBuf,

    /// Figures wanted, in this order [default: all that the files allow].
    #[arg(long = "metric", value_name = "LIST", value_delimiter = ',')]
    pub metrics: Vec<MetricArg>,

    /// Layer to compare, of both files, or of each: `PICTURE,REFERENCE`; an empty name is the layer without one.
    #[arg(long = "layer", value_name = "NAME", value_delimiter = ',')]
    pub layers: Vec<String>,

    /// Write the first figure asked for, or flip, pixel by pixel: .png in false colours, .exr as numbers.
    #[arg(long, value_name = "FILE")]
    pub map: Option<PathBuf>,

    /// Write the figures as JSON, to standard output or to FILE: `--json=FILE`.
    #[arg(long, value_name = "FILE|-", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    pub json: Option<PathBuf>,

    /// Brightness B of the tone curve before flip and delta-e.
    #[arg(long, value_name = "B", default_value_t = Settings::default().exposure, value_parser = positive)]
    pub exposure: f32,
}

/// `--metric`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MetricArg {
    /// Mean squared error relative to the reference's luminance.
    Relmse,
    /// The same without the worst 0.1 % of pixels.
    Trimmed,
    /// Mean absolute error relative to both.
    Smape,
    /// What a person sees when the displayed pictures alternate.
    Flip,
    /// Distance of displayed colours in OKLab.
    DeltaE,
    /// Relative standard error of the picture, by its variance.
    Rse,
    /// Test of equal expectations, by the variances of both.
    Z,
}

impl MetricArg {
    /// As on the command line and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Relmse => "relmse",
            Self::Trimmed => "trimmed",
            Self::Smape => "smape",
            Self::Flip => "flip",
            Self::DeltaE => "delta-e",
            Self::Rse => "rse",
            Self::Z => "z",
        }
    }

    /// What the figure means, for people.
    pub const fn meaning(self) -> &'static str {
        match self {
            Self::Relmse => "squared error by the reference's luminance²; 0 is equal, less is better",
            Self::Trimmed => "relmse without the worst 0.1 % of pixels; less is better",
            Self::Smape => "absolute error by the sum of both; 0 equal … 1 all wrong, less is better",
            Self::Flip => "seen when the two alternate; 0 equal … 1, less is better",
            Self::DeltaE => {
                "distance of displayed colours; 0.02 just seen, 1 black from white, less is better"
            }
            Self::Rse => "median standard error of the picture by its brightness; less is better",
            Self::Z => {
                "share of pixels that may be equal, at 1 % for all; mean z² is 1 where noise explains all"
            }
        }
    }
}
