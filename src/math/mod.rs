//! Mathematics that knows nothing of rendering: frames, warps of the unit square with their densities, discrete distributions,
//! probability densities with their measures, least squares without negative factors, the error function, scores of the normal distribution, sums in any order, bounds on rounding errors, bit mixing, quantiles, lines cut by boxes, and
//! random numbers for tests.

pub mod bits;
pub mod distribution;
pub mod distribution_2d;
pub mod erf;
pub mod exact_sum;
pub mod float;
pub mod frame;
pub mod nnls;
pub mod normal;
pub mod pdf;
pub mod quantile;
pub mod random;
pub mod slab;
pub mod trigonometry;
pub mod warp;
