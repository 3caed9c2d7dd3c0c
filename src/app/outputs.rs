//! The files a run leaves behind, checked before the run and replaced only when complete.

use std::path::{Path, PathBuf};
use std::time::Instant;

use miette::{IntoDiagnostic, Result, miette};

use super::args::RenderArgs;
use super::report::Seconds;
use crate::client::{Client, FilmSpec, Settings};
use crate::scene::desc::IntegratorKind;

/// What a run is made of: with these a picture can be made again, so they stand in its file.
#[derive(Clone, Debug)]
pub struct RunFacts {
    /// The scene file.
    pub scene: PathBuf,
    /// `-D` values.
    pub defines: Vec<(String, String)>,
    /// Size, filter, variance form.
    pub spec: FilmSpec,
    /// Longest path.
    pub max_depth: Option<u32>,
    /// Where roulette begins.
    pub rr_depth: u32,
    /// Lights are not seen directly.
    pub hide_emitters: bool,
    /// Light transport method.
    pub integrator: IntegratorKind,
    /// Samples per pixel where neither a count nor a time is given.
    pub spp: u64,
    /// Seed.
    pub seed: u32,
    /// In index order.
    pub deterministic: bool,
    /// Where it was rasterised.
    pub device: String,
}
