//! Options of `pointillist replay`.

use clap::Args;

use crate::render::options::SceneOptions;

/// Options of `pointillist replay`.
#[derive(Args, Debug)]
pub struct ReplayArgs {
    /// What is traced.
    #[command(flatten)]
    pub source: SceneOptions,

    /// Index of the path in the sample sequence.
    #[arg(long, value_name = "N", help_heading = "Sampling")]
    pub index: u64,

    /// Number of independent randomisations that the render was made of.
    #[arg(long, value_name = "1|2", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2), help_heading = "Sampling")]
    pub replicates: u8,

    /// Generations of photons that the path has seen; `photon` and `vcm` only [default: those that its index demands].
    #[arg(long, value_name = "N", help_heading = "Sampling")]
    pub generations: Option<u64>,

    /// Trace the light path of this number, of the photons that the path of the index sees; `photon` and `vcm` only.
    #[arg(long, value_name = "N", help_heading = "Sampling")]
    pub light_path: Option<u64>,
}
