//! The ray accelerator: its answers against brute force, in every kernel, for meshes, instances and degenerate input.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/mod.rs"]
mod support;

mod brute;
mod degenerate;
mod instances;
mod kernels;
mod watertight;
