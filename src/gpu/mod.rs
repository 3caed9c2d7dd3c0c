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

mod acquire;
mod buffer;
mod capability;
mod chain;
mod choice;
mod clock;
mod cmd;
mod compute;
mod device;
mod display_loss;
mod error;
mod frame;
mod image;
mod instance;
mod inventory;
mod loss;
mod memory;
mod opening;
mod overlay;
mod painter;
mod pipeline;
mod present;
mod readback;
mod recreate;
mod retire;
mod rows;
mod shader;
mod spare;
mod surface;
mod swapchain;
mod sync;
mod timing;

pub use buffer::{Buffer, BufferUse};
pub use choice::{DeviceChoice, DeviceInfo, DeviceKind, devices};
pub use cmd::{Cmd, Load, Sampler, Target, Texture};
pub use compute::{Binding, ComputeDesc, ComputePipeline};
pub use device::{Gpu, GpuOptions};
pub use display_loss::{display_lost, survive_display_loss};
pub use error::GpuError;
pub use frame::{Frame, FrameNumber};
pub use image::{Format, Image, ImageDesc};
pub use inventory::Inventory;
pub use overlay::Overlay;
pub use pipeline::{Blend, GraphicsDesc, Pipeline, Topology, VertexLayout};
pub use readback::{Region, read_image};
pub use rows::{FrameTimes, ScopeRow, TimingInfo, TimingRows};
pub use shader::{shader_code, shader_names};
pub use surface::ColorOutput;
pub use swapchain::{Readiness, Swapchain};
pub use sync::Access;
pub use timing::ScopeTime;
