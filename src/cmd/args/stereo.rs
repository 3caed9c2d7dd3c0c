//! Options that say where the eyes are.

use clap::Args;

use crate::cmd::args::values::positive_length;
use crate::image::stereo::StereoLayout;
use crate::render::options::StereoOptions;
use crate::scene::desc::ConvergenceChoice;

/// The places of the eyes, for subcommands whose option `--stereo` asks for two.
#[derive(Args, Clone, Copy, Debug)]
pub struct EyesArgs {
    /// Distance between the eyes, in units of the scene [default: a thirtieth of the distance of what is in focus, or in the middle].
    #[arg(long, value_name = "D", value_parser = positive_length, requires = "stereo", help_heading = "Stereo")]
    pub interocular: Option<f64>,

    /// What is in the plane of the screen: what is at this distance, `subject` (in focus, or in the middle), or with `parallel` eyes infinity.
    #[arg(long, value_name = "D", value_parser = ConvergenceChoice::parse, requires = "stereo", help_heading = "Stereo")]
    pub convergence: Option<ConvergenceChoice>,
}

impl EyesArgs {
    /// Two eyes at these places, whose pictures are shown in this layout; `None` for a file of each.
    pub fn options(self, layout: Option<StereoLayout>) -> StereoOptions {
        let Self { interocular, convergence } = self;
        StereoOptions { layout, interocular, convergence: convergence.unwrap_or_default() }
    }
}
