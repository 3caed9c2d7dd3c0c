//! Recording and submitting commands.
//!
//! - [`cmd`]: [`Cmd`](cmd::Cmd) records barriers, draws, dispatches and timed scopes.
//! - [`copies`]: between images and buffers.
//! - [`frame`]: commands recorded and submitted together, with a few frames in flight.

pub(in crate::gpu) mod cmd;
pub(in crate::gpu) mod copies;
pub(in crate::gpu) mod frame;
