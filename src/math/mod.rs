//! Mathematics that knows nothing of rendering: frames, warps, distributions, the error function, float bounds, mixing of
//! bits, random numbers for tests.

pub mod bits;
pub mod distribution;
pub mod distribution_2d;
pub mod erf;
pub mod float;
pub mod frame;
pub mod pdf;
pub mod random;
pub mod warp;
