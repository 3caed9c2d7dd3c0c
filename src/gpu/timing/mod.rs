//! Timestamps by named scope, and their times on the host's clock.
//!
//! - [`queries`]: one pool of timestamp queries per frame in flight; [`Cmd::scope`](crate::gpu::Cmd::scope) writes a pair
//!   for each scope. They are read after the frame has completed, never waited for.
//! - [`rows`]: a row for each run of a scope, sums by name, and what is known of the frames.
//! - [`clock`]: from device ticks to moments on the host's clock.
//!
//! # From device ticks to the host's clock
//!
//! Where the device's clock can be read (`VK_KHR_calibrated_timestamps`, `VK_EXT_calibrated_timestamps`), a reading lies
//! between two readings of the host's monotonic clock, and half their distance bounds the error. The calibration is renewed
//! every 100 ms, so that drift stays below the error. Elsewhere every frame bounds the offset: its first timestamp lies
//! after its submission, and its last one before the host saw the frame complete. Rows of consecutive frames never overlap:
//! a new calibration may shift them against each other by its correction, and they are moved back by at most that.
//!
//! # Limits
//!
//! A frame has timestamps for 128 scopes; further scopes are counted as untimed. Software rasterisers such as lavapipe take
//! timestamps in the rasteriser: clears of attachments and compute dispatches may lie outside of their scopes, and
//! [`TimingInfo::untimed`](rows::TimingInfo::untimed) says so.

pub(in crate::gpu) mod clock;
pub(in crate::gpu) mod queries;
pub(in crate::gpu) mod rows;
