//! Options of `pointillist mix`.

use std::path::PathBuf;

use clap::Args;

use crate::client::Settings;
use crate::cmd::args::values::positive;
use crate::image::mix::MixRgb;

/// Options of `pointillist mix`.
#[derive(Args, Debug)]
pub struct MixArgs {
    /// An EXR file with layers of groups of lights, as `pointillist render --light-groups -o FILE.exr` writes it.
    pub picture: PathBuf,

    /// Multiply a group by a factor, or its red, green and blue by one each; 0 switches it off. May be given for each group.
    #[arg(long = "set", value_name = "GROUP=F|R,G,B", value_parser = factor)]
    pub set: Vec<(String, MixRgb)>,

    /// Find the factors of all groups that are not set, so that the mix looks like this picture of the same size: EXR, HDR, PNG, JPEG and others.
    ///
    /// The squared error of linear colour is made as small as it can be, relative to the brightness of each pixel. Files of 8 or 16 bits are
    /// decoded as sRGB, and pixels that are clipped in them do not count.
    #[arg(long, value_name = "FILE")]
    pub like: Option<PathBuf>,

    /// With --like, find one factor for each group instead of one for each of its channels: the lights keep their colours.
    #[arg(long, requires = "like")]
    pub keep_colors: bool,

    /// Write the mix to this .exr or .png file; may be given several times. Without it only the factors are printed.
    #[arg(short = 'o', long = "output", value_name = "FILE")]
    pub outputs: Vec<PathBuf>,

    /// Brightness B of the tone curve of PNG files.
    #[arg(long, value_name = "B", default_value_t = Settings::default().exposure, value_parser = positive)]
    pub exposure: f32,
}

/// Reads `GROUP=F` or `GROUP=R,G,B`.
fn factor(text: &str) -> Result<(String, MixRgb), &'static str> {
    const EXPECTED: &str =
        "expected GROUP=F or GROUP=R,G,B with factors from 0 on, such as key=2 or sky=0.5,0.6,1";
    let (name, factors) = text.rsplit_once('=').ok_or(EXPECTED)?;
    let factors: Option<Vec<f32>> = factors
        .split(',')
        .map(|factor| factor.trim().parse::<f32>().ok().filter(|factor| (0.0..=1e6).contains(factor)))
        .collect();
    match factors.as_deref() {
        Some([all]) => Ok((name.trim().to_owned(), [*all; 3])),
        Some([r, g, b]) => Ok((name.trim().to_owned(), [*r, *g, *b])),
        _ => Err(EXPECTED),
    }
}
