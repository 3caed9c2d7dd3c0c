//! Accuracy: the error of a picture, its interval, the time to a smaller error, and the study of a scene. Analysis only; `cmd/study` runs
//! the renders.
//!
//! # How the error is estimated
//!
//! 1. [`replicates`]: every render is two. Chunks of the sample sequence belong in turn to one of two independent
//!    randomisations, and [`Replicates`] keeps the sums of both, pixel by pixel. Their mean is the picture, so nothing is
//!    wasted.
//! 2. [`error`]: half the difference of the replicates, squared, is in expectation exactly the variance of their mean,
//!    whatever the sequence does within each. No reference is needed. [`ErrorField`] collects these squares in tiles of 8×8
//!    pixels. The **relative error** of a tile is the root mean square of its luminance error over its mean luminance plus 1 %
//!    of the picture's. The mean luminance of a tile is noisy, too, most of all where few samples bring much light: a tile
//!    that one of them has hit would seem bright, its error small. So the light of the largest samples of each tile is spread
//!    over its neighbourhood first ([`largest`]).
//! 3. [`error`], [`interval`]: [`ErrorEstimate`] states the relative errors that 50 %, 95 % and 99 % of the tiles stay below,
//!    each with an [`Interval`] that contains the true error of this very picture with a probability of 90 %, but less often where
//!    light is found late ([`late`]). Of that light, [`witness`] tells what other methods find: it counts as error where the picture lacks it.
//! 4. [`curve`] and [`prediction`]: [`ErrorMonitor`] (`monitor.rs`, run by `accounting/observer.rs` on a thread) takes checkpoints of
//!    the error during a render, fits a power law through them and predicts the time to the target. It is silent before 4
//!    samples per pixel and predicts nothing before 8. Every prediction is scored afterwards.
//!
//! A render that stops at a target (`--error 1%`) decides by one half of the tiles and states the error of the other, the
//! **held-out** half. Otherwise the stop would select a checkpoint whose error was small by luck.
//!
//! The error of the pictures of two eyes together (`joint.rs`) follows from the error of each.
//!
//! `--adaptive` distributes camera paths by what a pilot has found ([`Replicates::region_errors`]). Its samples have weights, one over the
//! density of paths, and the difference of the replicates knows the error of their weighted means as well.
//!
//! # What the error does not contain
//!
//! It is neither the standard error that the display steers its blur by (`client/pass/variance.rs`) nor a difference to
//! another picture ([`image::compare`](crate::image::compare)).
//!
//! It is the error of the picture without reconstruction blur, as in the EXR. Both replicates share the bias of photon mapping, which their
//! difference does not show; it is estimated from how it shrinks as the number of photons grows ([`blur`]). The error excludes light that
//! neither samples nor witnesses have found. If much light is probably still being found, [`late`] reports it.
//!
//! # Example
//!
//! ```
//! use pointillist::color::Xyz;
//! use pointillist::math::bits::mix;
//! use pointillist::stream::{CHUNK, PathCounts, Sample};
//! use pointillist::study::{ErrorField, Replicates, TileSubset};
//!
//! // A grey picture of 64×64 pixels with 16 samples per pixel, each off by up to 50 %.
//! let mut sums = Replicates::new([64, 64], 1.0);
//! for chunk in 0..64 {
//!     let sample = |i: u64| {
//!         let uniform = |k: u64| (mix(3 * (chunk * CHUNK + i) + k) >> 40) as f32 / (1 << 24) as f32;
//!         let y = 0.5 + uniform(2);
//!         Sample { uv: [uniform(0), uniform(1)], xyz: Xyz::new(0.95 * y, y, 1.09 * y), w: 1.0 }
//!     };
//!     let samples: Vec<Sample> = (0..CHUNK).map(sample).collect();
//!     sums.add(chunk * CHUNK, PathCounts { camera: CHUNK, light: 0 }, &samples);
//! }
//! let pixels = sums.pixels().expect("both replicates have traced paths");
//! let field = ErrorField::new(&pixels, sums.size()).expect("both replicates have reached every pixel");
//! let median = field.estimate(TileSubset::All).relative[0];
//! // A uniform deviation of ±50 % has the standard deviation 0.289; 16 samples divide it by 4.
//! assert!((0.06..0.09).contains(&median.value), "{median:?}");
//! assert!(median.low < 0.289 / 4.0 && 0.289 / 4.0 < median.high);
//! ```
//!
//! # The study of a scene
//!
//! `pointillist study` keeps what it measures in a folder, line by line ([`measurement`]). [`analysis`] makes a
//! [`data::Study`] from the lines: the curve of each method and its times to an error, the cost of effects and settings.
//! [`pages`] shows it to people; [`mod@format`] writes numbers with the digits that their intervals support.
//!
//! - [`pool`]: the reference is made of all pictures by unbiased methods. Each is judged by the others, whose known variance is
//!   subtracted.
//! - [`time_model`]: the time to an error follows from small pictures of the same view, which have many samples per pixel early, and
//!   from pictures of full size, which tell by how much the errors of both differ.
//! - [`brightness`]: the audit of mean luminance, from sums of samples, with an alarm that clean studies do not raise.

mod accumulated;
pub mod analysis;
mod apart;
pub mod blur;
pub mod brightness;
pub mod curve;
pub mod data;
pub mod denoised;
pub mod error;
pub mod error_tile;
pub mod exact_replicates;
pub mod format;
pub mod highlights;
pub mod interval;
mod joint;
pub mod largest;
pub mod late;
pub mod measurement;
pub mod method_curve;
mod monitor;
mod noisy;
pub mod pages;
mod picture_tile;
pub mod pool;
pub mod prediction;
mod regions;
pub mod replicates;
mod smooth;
mod summed_areas;
pub mod time_model;
pub mod unfound;
pub mod witness;
mod witness_comparison;

pub use accumulated::AccumulatedSamples;
pub use apart::SamplesApart;
pub use error::{ErrorEstimate, ErrorField, TileSubset};
pub use exact_replicates::{ExactPixel, ExactReplicates};
pub use interval::Interval;
pub use joint::joint_estimate;
pub use late::{LateLight, MissingLight};
pub use monitor::{ErrorMonitor, ErrorQuantile, ErrorStatus, ErrorTarget, MonitorProgress};
pub use replicates::Replicates;
pub use smooth::SmoothingKernel;
