//! Mathematics that knows nothing of rendering: frames, warps, distributions, float bounds.

pub mod distribution;
pub mod distribution_2d;
pub mod float;
pub mod frame;
pub mod pdf;
pub mod warp;
