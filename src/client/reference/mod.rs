//! The passes in plain Rust, under the names of the Vulkan passes.
//!
//! They define what the shaders compute and are what these are tested against; with `--device cpu`, where there is no Vulkan
//! driver, they are the whole client.
//!
//! | file | pass | paper |
//! |---|---|---|
//! | [`splat`] | samples → batch image, filter-shaped sprites, additive | §4.2 steps 1, 2 |
//! | [`fold`] | batch image → two-float sums | (answers the stagnation of step 2) |
//! | [`variance`] | samples again → batch of squared deviations | §4.2 step 5 |
//! | [`mips`] | averages down to 1×1, bilinear and trilinear reads | §4.2 steps 3, 6 |
//! | [`bilateral`] | noise masking that keeps features | §4.2 |
//! | [`adaptive_filter`] | the light of every sample spread by the density around it | §6, \[21\] |
//! | [`error_view`] | the variance images | §5 |
//! | [`reconstruct`], [`kernel`] | blur by count and variance, normalise, sum the streams | §4.2, §4.3 |
//! | [`glare`] | scatter of the eye: convolution by FFT | §4.2 step 5 |
//! | [`post_process`](crate::client::post_process) | what changes the picture; each stands beside its parameters | |
//! | [`tonemap`], [`curves`] | tone curve, matrix, desaturation, transfer, dither, 8 bits | §4.2 |
//!
//! [`exact`] is a film of its own, whose sums are the same in any order.
//!
//! [`accumulator`] holds the images of a stream, [`sums`] those of both with their batches, [`film`] the order of the passes.
//! All sums run in `f32` in sample order, as additive blending does; threads only split rows.

pub mod accumulator;
pub mod adaptive_filter;
pub mod bilateral;
pub mod curves;
pub mod error_view;
pub mod exact;
pub mod film;
pub mod fold;
pub mod glare;
pub mod kernel;
pub mod mips;
pub mod reconstruct;
pub mod splat;
pub mod sums;
pub mod tonemap;
pub mod variance;

pub use accumulator::ExactTexel;
pub use exact::ExactFilm;
pub use film::ReferenceFilm;
