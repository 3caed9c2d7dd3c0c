//! The tracer: one path at a time, a pure function of (scene, integrator, seed, index).
//!
//! Knows no thread, no clock, no file and no resolution.

pub mod integrator;
pub mod sampler;

pub use integrator::Integrator;
pub use sampler::Sampler;
