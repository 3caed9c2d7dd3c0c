//! THE CONTRACT between server and client (paper §3): samples, blocks, lanes, epochs.

pub mod sample;
pub mod sink;

pub use sample::Sample;
pub use sink::{PathCounts, SampleSink, UvWindow};
