//! What a study measures, piece by piece: lines of `measurements.jsonl`. Each is written when it is known, so that a run that is
//! interrupted keeps what it has, and a second run adds to it.

use serde::{Deserialize, Serialize};

use crate::study::data::{DisplayPrice, EffectPrice, NumericPrice, Reference, SchemePrice};
use crate::study::interval::Interval;
use crate::study::prediction::Kept;

/// One line.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "measured")]
pub enum Measured {
    /// What errors are measured against.
    Reference(Reference),
    /// The command of a run that added what stands before it.
    Command {
        /// As it was given.
        command: String,
    },
    /// One picture.
    Run(Box<Run>),
    /// An effect of the scene.
    Effect(EffectPrice),
    /// What leaving out unused effects saves.
    Unused {
        /// Speed as planned over that of the code for everything.
        ratio: f64,
    },
    /// A setting of the display.
    Display(DisplayPrice),
    /// A choice of arithmetic.
    Numeric(NumericPrice),
    /// A way to divide a run.
    Scheme(SchemePrice),
}

/// One picture: how it was made, and how wrong it is.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Run {
    /// Method or peer.
    pub method: String,
    /// Another program's.
    pub peer: bool,
    /// Seconds that it was given.
    pub budget: f64,
    /// Its seed; a second one of the same method, budget and seed is no other measurement.
    pub seed: u32,
    /// Wall-clock seconds of rendering.
    pub seconds: f64,
    /// Seconds of processor time spent tracing.
    pub trace_seconds: f64,
    /// Seconds of the client spent splatting.
    pub splat_seconds: f64,
    /// Seconds from sums to picture.
    pub display_seconds: f64,
    /// Paths per pixel.
    pub samples_per_pixel: f64,
    /// Paths.
    pub paths: u64,
    /// relMSE against the reference, the reference's own taken off.
    pub rel_mse: Interval,
    /// The same without the worst 0.1 % of pixels.
    pub trimmed: f64,
    /// Relative error against the reference at median, p95 and p99 of the picture.
    pub relative: [Interval; 3],
    /// relMSE as the replicates state it.
    pub noise: Option<Interval>,
    /// Relative errors as the replicates state them.
    pub stated: Option<[Interval; 3]>,
    /// SMAPE.
    pub smape: f64,
    /// FLIP of the displayed picture.
    pub flip: f64,
    /// Mean luminance over the reference's.
    pub energy: f64,
    /// Mean square error on the grid of [`REGIONS`], row by row, relative to the squared mean luminance.
    pub regions: Vec<f32>,
    /// As displayed, `data:` URI.
    pub picture: Option<String>,
    /// FLIP map, `data:` URI.
    pub error_map: Option<String>,
    /// Samples that were not finite: cause, count, command.
    pub rejected: Vec<(String, u64, String)>,
    /// Predictions of this run.
    pub kept: Vec<Kept>,
}

/// Seconds of the paper's Figures 3 and 4, whose pictures the page shows side by side.
pub const FIGURES: [f64; 4] = [1.0 / 30.0, 1.0 / 3.0, 3.0, 30.0];

/// Columns and rows of the regions whose winners are shown.
pub const REGIONS: [usize; 2] = [12, 12];
