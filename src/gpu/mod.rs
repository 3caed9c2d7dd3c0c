//! Vulkan without meaning: a device, its memory, and commands recorded in frames. Knows nothing of samples or pictures.
//!
//! - [`Gpu`] owns instance, device, queue and allocator; everything else holds an `Arc<Gpu>`.
//! - [`Buffer`], [`Image`] and [`Pipeline`] free themselves: dropping one *retires* it until the frame that may still
//!   use it has completed (`retire.rs`). Only `Gpu::drop` and the end of a window wait for an idle queue.
//! - [`Gpu::begin`] lends the [`Frame`] that records next; two frames are in flight, ordered by one timeline semaphore.
//! - `sync.rs` is the only place that knows stages, access masks and layouts: a pass says
//!   [`Cmd::access`]`(&mut image, `[`Access::Sampled`]`)`.
//! - A window: `surface.rs` finds who can show pictures in it, [`Swapchain`] holds its images (`chain.rs`: one generation;
//!   `recreate.rs`: from one to the next; `acquire.rs`: frame by frame; `present.rs`: what is recorded), [`Overlay`] draws
//!   the panel over them. Nothing of it is there without a window. `loss.rs` loses a device on purpose.
//! - [`Cmd::scope`] labels a pass for the debugger and, when timing is on, measures it.
//!
//! With `POINTILLIST_VALIDATION=1` (or [`GpuOptions::validation`]) the Khronos validation layer runs with synchronization
//! validation, and every message is kept ([`Gpu::validation_messages`]) and logged.
//!
//! `unsafe` stands here because Vulkan's handles are raw; what each call relies on is said beside it.

mod commands;
mod device;
mod error;
mod resources;
mod timing;
mod window;

pub use commands::cmd::{Cmd, Load, Sampler, Target, Texture};
pub use commands::frame::{Frame, FrameNumber};
pub use commands::readback::{Region, read_image};
pub use commands::sync::Access;
pub use device::choice::{DeviceChoice, DeviceInfo, DeviceKind, devices};
pub use device::inventory::Inventory;
pub use device::{Gpu, GpuOptions};
pub use error::GpuError;
pub use resources::buffer::{Buffer, BufferUse};
pub use resources::compute::{Binding, ComputeDesc, ComputePipeline};
pub use resources::image::{Format, Image, ImageDesc};
pub use resources::pipeline::{Blend, GraphicsDesc, Pipeline, Topology, VertexLayout};
pub use resources::shader::{shader_code, shader_names};
pub use timing::queries::ScopeTime;
pub use timing::rows::{FrameTimes, ScopeRow, TimingInfo, TimingRows};
pub use window::display_loss::{display_lost, survive_display_loss};
pub use window::overlay::Overlay;
pub use window::surface::ColorOutput;
pub use window::swapchain::{Readiness, Swapchain};
