//! The program on the command line: files in, files out, messages, exit codes.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

mod compare;
mod effects;
mod layers;
mod oidn;
mod plugins;
mod program;
mod render_error;
mod simd;
mod state;
mod study;
