//! Timestamps by named scope, and their times on the host's clock.

pub(in crate::gpu) mod clock;
pub(in crate::gpu) mod queries;
pub(in crate::gpu) mod rows;
