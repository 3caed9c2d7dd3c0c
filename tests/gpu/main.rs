//! The display on the Vulkan device, with the validation layer, against its reference on the CPU.

#![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

#[path = "../support/mod.rs"]
mod support;

use support::device as common;

mod device;
mod effects;
mod faults;
mod film;
mod glare;
mod overlay;
mod plan;
mod reference;
mod shaders;
mod swapchain;
mod timing;
mod x11_window;
