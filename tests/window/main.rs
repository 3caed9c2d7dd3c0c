//! The window: its panel without a display, and the real program on a display of its own.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/mod.rs"]
mod support;

mod elsewhere;
mod endings;
mod error;
mod faults;
mod first_second;
mod headless_panel;
mod input;
mod light_mix;
mod navigation;
mod panel;
mod panel_maps;
mod picture;
mod regions;
mod scenes;
mod stereo;
mod tools;
mod viewer;
