//! Options of `pointillist serve`, and of `view --connect`: tracers on other machines.

use std::path::PathBuf;

use clap::Args;

use crate::cmd::args::scene::SimdArg;
use crate::cmd::args::values::define;
use crate::render::options::SceneOptions;
use crate::viewer::options::{Compression, TracerOptions};

/// Options of `pointillist serve`.
#[derive(Args, Debug)]
pub struct ServeArgs {
    /// The scene, as for `render`.
    pub scene: PathBuf,

    /// Value for a $NAME in the scene; may be given several times.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    pub defines: Vec<(String, String)>,

    /// Trace a scene although it holds plugins that are not supported, as for `render`.
    #[arg(long)]
    pub lenient: bool,

    /// Show every warning about the scene with its source line, as for `render`.
    #[arg(long)]
    pub verbose: bool,

    /// Where viewers are expected. An address that other machines can reach needs --token-file; port 0 takes any that is free.
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:7070")]
    pub listen: String,

    /// File with a secret of 16 characters or more, which viewers must have, too; all that is said is encrypted then.
    ///
    /// `openssl rand -hex 32` makes a good one.
    #[arg(long, value_name = "FILE")]
    pub token_file: Option<PathBuf>,

    /// Number of tracer threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// Processor instructions that trace rays; all give the same samples, bit for bit.
    #[arg(long, value_name = "KIND", default_value = "auto")]
    pub simd: SimdArg,
}

impl ServeArgs {
    /// The scene with the options that all commands have. What a viewer decides is left open.
    pub fn source(&self) -> SceneOptions {
        SceneOptions {
            defines: self.defines.clone(),
            lenient: self.lenient,
            verbose: self.verbose,
            threads: self.threads,
            simd: self.simd.into(),
            ..SceneOptions::of(self.scene.clone())
        }
    }
}

/// Tracers of a viewer.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Tracers on other machines")]
pub struct ConnectArgs {
    /// Trace there, by `pointillist serve`, and not here; given several times, several tracers add to the picture.
    ///
    /// Camera and edits go to all of them. SCENE must be the same as theirs; without it, that of the first one is fetched.
    #[arg(long, value_name = "HOST:PORT")]
    pub connect: Vec<String>,

    /// File with the secret of the tracers.
    #[arg(long, value_name = "FILE", requires = "connect")]
    pub token_file: Option<PathBuf>,

    /// Whether samples come in 12 bytes instead of 24, and as sums on a grid, coarse at first, where the link is slower than they are made.
    ///
    /// Rounding shifts the mean of no pixel. Sums on a coarse grid are a blur that later ones outweigh.
    #[arg(long, value_name = "WHEN", default_value = "auto")]
    pub compress: Compression,
}

impl From<ConnectArgs> for TracerOptions {
    fn from(args: ConnectArgs) -> Self {
        let ConnectArgs { connect, token_file, compress } = args;
        Self { connect, token_file, compress }
    }
}
