//! A window's surface, its images, and how they are shown.

pub(in crate::gpu) mod acquire;
pub(in crate::gpu) mod chain;
pub(in crate::gpu) mod display_loss;
pub(in crate::gpu) mod overlay;
pub(in crate::gpu) mod painter;
pub(in crate::gpu) mod present;
pub(in crate::gpu) mod recreate;
pub(in crate::gpu) mod surface;
pub(in crate::gpu) mod swapchain;
