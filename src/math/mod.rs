//! Mathematics that knows nothing of rendering: frames, warps, distributions, float bounds.

pub mod distribution;
