//! The display on the Vulkan device, with the validation layer, against its reference on the CPU.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/mod.rs"]
mod support;
#[path = "../support/soak/mod.rs"]
#[allow(dead_code, reason = "the tool tells more of it")]
mod unrest;

use support::device as common;

mod adaptive_filter;
mod batches;
mod compose;
mod device;
mod effects;
mod faults;
mod film;
mod glare;
mod overlay;
mod plan;
mod post_process;
mod reference;
mod shaders;
mod soak;
mod stereo;
mod swapchain;
mod tiles;
mod timing;
mod wavelet;
mod x11_window;
