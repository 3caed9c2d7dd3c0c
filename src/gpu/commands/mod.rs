//! Recording and submitting commands, with the barriers between them.

pub(in crate::gpu) mod cmd;
pub(in crate::gpu) mod frame;
pub(in crate::gpu) mod readback;
pub(in crate::gpu) mod sync;
