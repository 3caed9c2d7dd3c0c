//! Into how many branches a path splits, and how long they live.
//!
//! On the Cornell box the camera ray and the light seen from its first hit take 40 % of a path's time and make 1 % of
//! its noise: what is left of the noise comes from the one direction in which the path goes on. So it goes on in four, at
//! its first vertex that is no delta. With four wavelengths, 256² pixels, 16 paths per pixel, relMSE times processor time
//! relative to that of one branch:
//!
//! | branches | 1 | 2 | 4 | 8 | 16 |
//! |---|---|---|---|---|---|
//! | roulette as without branches | 1 | 0.84 | 0.79 | 0.73 | 0.79 |
//! | roulette from the second segment on | | | 0.69–0.72 | 0.66–0.70 | 0.74 |
//!
//! (After Arvo and Kirk 1990, *Particle Transport and Image Synthesis*, and the efficiency of Bolin and Meyer 1997, *An
//! Error Metric for Monte Carlo Ray Tracing*.) More than four gain little and would make single samples slow.
//!
//! The first pictures consist of single samples: there, many places seen once are worth more than few seen well. So the first
//! paths do not split.

/// Binary logarithm of the number of branches.
pub(super) const BITS: u32 = 2;

/// So many paths from the beginning of the sequence stay whole: about a hundredth of a second on one core.
pub(super) const WHOLE: u64 = 8192;
