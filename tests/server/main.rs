//! The server and its stream of samples: commands, events, threads and lanes.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/mod.rs"]
mod support;

mod control;
mod cost;
mod determinism;
mod lanes;
mod light_groups;
mod ring;
