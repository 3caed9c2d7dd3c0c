//! The display on the CPU: film, development, reconstruction and glare.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/mod.rs"]
mod support;

mod adaptive_filter;
mod develop;
mod film;
mod glare;
mod look_around;
mod oidn;
mod reconstruct;
mod wavelet;
