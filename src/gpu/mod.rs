//! Vulkan without meaning: a device, its memory, and commands recorded in frames. Knows nothing of samples or pictures.
//!
//! - [`Gpu`] owns instance, device, queue and allocator; everything else holds an `Arc<Gpu>`.
//! - [`Buffer`], [`Image`] and [`Pipeline`] free themselves: dropping one *retires* it until the frame that may still
//!   use it has completed (`retire.rs`). `Gpu::drop` is the only idle wait.
//! - [`Gpu::begin`] lends the [`Frame`] that records next; two frames are in flight, ordered by one timeline semaphore.
//! - `sync.rs` is the only place that knows stages, access masks and layouts: a pass says
//!   [`Cmd::access`]`(&mut image, `[`Access::Sampled`]`)`.
//! - [`Cmd::scope`] labels a pass for the debugger and, when timing is on, measures it.
//!
//! With `POINTILLIST_VALIDATION=1` (or [`GpuOptions::validation`]) the Khronos validation layer runs with synchronization
//! validation, and every message is kept ([`Gpu::validation_messages`]) and logged.
//!
//! `unsafe` stands here because Vulkan's handles are raw; what each call relies on is said beside it.

mod buffer;
mod capability;
mod choice;
mod cmd;
mod compute;
mod device;
mod error;
mod frame;
mod image;
mod instance;
mod memory;
mod opening;
mod overlay;
mod pipeline;
mod readback;
mod retire;
mod shader;
mod swapchain;
mod sync;
mod timing;

pub use buffer::{Buffer, BufferUse};
pub use choice::{DeviceChoice, DeviceInfo, DeviceKind, devices};
pub use cmd::{Cmd, Load, Sampler, Target, Texture};
pub use compute::{Binding, ComputeDesc, ComputePipeline};
pub use device::{Gpu, GpuOptions};
pub use error::GpuError;
pub use frame::{Frame, FrameNumber};
pub use image::{Format, Image, ImageDesc};
pub use overlay::Overlay;
pub use pipeline::{Blend, GraphicsDesc, Pipeline, Topology, VertexLayout};
pub use readback::{Region, read_image};
pub use shader::{shader_code, shader_names};
pub use swapchain::{ColorOutput, Readiness, Swapchain};
pub use sync::Access;
pub use timing::ScopeTime;
