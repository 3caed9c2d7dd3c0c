//! Tracers elsewhere: samples over the network, several tracers, and everything that can go wrong between them and a viewer.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/held_memory.rs"]
mod held_memory;
#[path = "../support/mod.rs"]
mod support;

mod failures;
mod fuzz;
mod host;
mod refusals;
mod streams;
