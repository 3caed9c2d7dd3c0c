//! The device and what belongs to it alone.
//!
//! - [`gpu`]: [`Gpu`](gpu::Gpu), the root that every other object holds by `Arc`, and how it is opened. [`options`]: as what.
//! - [`instance`]: the Vulkan instance, the validation layer and its messages.
//! - [`physical`]: the devices of the machine, what each lacks, and which one is taken.
//! - [`cache`]: compiled pipelines, as bytes for later runs.
//! - [`memory`]: the allocator. [`heaps`]: how much memory there is.
//!   [`retire`]: dropped objects that a frame in flight may still use. `spares`: pipelines without an owner, for reuse.
//! - [`ring`]: command pools, command buffers and timestamps of the frames in flight.
//! - [`loss`] and [`faults`]: lose the device and let calls fail on purpose, for tests with the feature `faults`.

pub(in crate::gpu) mod cache;
pub(in crate::gpu) mod faults;
pub(in crate::gpu) mod gpu;
pub(in crate::gpu) mod heaps;
pub(in crate::gpu) mod instance;
#[cfg(feature = "faults")]
pub(in crate::gpu) mod loss;
pub(in crate::gpu) mod memory;
pub(in crate::gpu) mod options;
pub(in crate::gpu) mod physical;
pub(in crate::gpu) mod retire;
pub(in crate::gpu) mod ring;
mod spares;
