//! Vulkan abstraction: a device, its memory, and commands recorded in frames. Knows nothing of samples or pictures.
//!
//! | folder | what |
//! |---|---|
//! | `device` | [`Gpu`] owns instance, device, queue and allocator; everything else holds an `Arc<Gpu>` |
//! | `resources` | [`Buffer`], [`Image`], [`Pipeline`]; dropping one *retires* it until no frame can use it |
//! | `commands` | [`Gpu::begin`] lends the [`GpuFrame`] that records next; [`Cmd`] records draws, dispatches and copies |
//! | `timing` | [`Cmd::scope`] labels a pass for the debugger and, when timing is on, measures it |
//! | `window` | [`Swapchain`] holds a window's images, [`ForeignRenderer`] draws the panel over them |
//!
//! Modules use those above them in the order `error`, `timing`, `device`, `resources`, `commands`, `window`.
//!
//! - A few frames are in flight, ordered by one timeline semaphore. Only `Gpu::drop` and the end of a window wait for an idle
//!   queue.
//! - `resources/sync.rs` is the only place that knows stages, access masks and layouts: a pass says
//!   [`Cmd::access`]`(&mut image, `[`Access::Sampled`]`)`.
//! - Compiled pipelines can be taken as bytes ([`Gpu::take_pipelines`]) and loaded by a later run ([`Gpu::load_pipelines`]);
//!   `render/pipelines.rs` keeps them in a file.
//! - With `POINTILLIST_VALIDATION=1` (or [`GpuOptions::validation`]) the Khronos validation layer runs with
//!   synchronization validation; every message is logged and collected ([`Gpu::validation_messages`]).
//! - With `POINTILLIST_COMPUTE=1` or `0` (or [`GpuOptions::compute`]) passes with both a compute and a fragment shader use the one or the
//!   other, to measure both; otherwise the kind of device decides ([`Gpu::prefers_compute`]).
//! - With `POINTILLIST_AS_GPU=1` (or [`GpuOptions::as_gpu`]) a CPU device is treated as a GPU, to test on lavapipe what otherwise only GPUs
//!   do: it computes the sums of a window, whose loop is one frame ahead.
//!
//! `unsafe` is confined to this module because Vulkan's handles are raw; a comment beside each call states what it relies on.

mod commands;
mod device;
mod error;
mod resources;
mod timing;
mod window;

pub use commands::cmd::{Attachment, Cmd, LoadOp, Scope, StorageBinding, Texture};
pub use commands::copies::{Region, read_image};
pub use commands::frame::GpuFrame;
pub use device::cache::CompilingPipeline;
#[cfg(feature = "faults")]
pub use device::faults::CallFault;
pub use device::faults::{CallFaults, DeviceCall, DeviceFaults};
pub use device::gpu::{FrameNumber, Gpu, Inventory};
pub use device::heaps::{LocalMemory, MemoryBudget};
pub use device::options::GpuOptions;
pub use device::physical::{DeviceChoice, DeviceInfo, DeviceKind, devices, devices_with_memory};
pub use error::GpuError;
pub use resources::buffer::{Buffer, BufferUse};
pub use resources::image::{Image, ImageDesc, TexelFormat};
pub use resources::pipeline::{
    Blend, ComputeDesc, ComputePipeline, GraphicsDesc, Pipeline, Topology, VertexLayout,
};
pub use resources::shader::{shader_code, shader_names};
pub use resources::sync::Access;
pub use timing::rows::{FrameTimes, ScopeRow, ScopeTime, TimingInfo, TimingRows};
pub use window::display_loss::{display_lost, survive_display_loss};
pub use window::foreign::{ForeignRenderer, RendererParts};
pub use window::images::{CopyFilter, CopyRegion};
pub use window::surface::ColorOutput;
pub use window::swapchain::{Readiness, Swapchain};
