//! A window: its surface, its swapchain images, and their presentation. Nothing here exists without a window.
//!
//! - [`surface`]: which devices can present images in the window, and in which formats.
//! - [`swapchain`]: acquires, draws and presents images, and makes them anew. [`images`]: one generation of them. [`reduced`]:
//!   smaller copies of a picture that is larger than the window.
//! - [`offers`]: presentation times, and mastering metadata, if the device supports them.
//! - [`foreign`]: renderers of other crates that draw over the picture.
//! - [`display_loss`]: survives a broken connection to an X display.

pub(in crate::gpu) mod display_loss;
pub(in crate::gpu) mod foreign;
pub(in crate::gpu) mod images;
pub(in crate::gpu) mod offers;
pub(in crate::gpu) mod reduced;
pub(in crate::gpu) mod surface;
pub(in crate::gpu) mod swapchain;
