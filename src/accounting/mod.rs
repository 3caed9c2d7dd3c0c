//! The accounts of a render: every sample that goes to a film is also accumulated here, once, and the stated error, the noise filter and the
//! predictions read from there.
//!
//! ```text
//! FilmWriter ─▶ SampleAccumulator: bounded queue ─▶ thread "accounting" ─▶ AccumulatedSamples
//!                                                                      │ snapshots
//!                               Observer: thread "observer" ◀──────────┴─────────▶ noise filter
//!                               checkpoints, error, predictions                    halves, held-out samples
//! ```
//!
//! - [`accumulator`]: the queue and the sums. Adding is cheap, so its thread keeps up; if the queue is full, the caller waits. A
//!   snapshot shares the sums, which are copied only if samples are added while it is still there.
//! - [`observer`]: the error at checkpoints, which takes as long as thousands of paths and has a thread of its own for that reason.

pub mod accumulator;
pub mod observer;
