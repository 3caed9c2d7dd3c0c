//! Options for opening a device.

/// Options of opening a [`Gpu`](crate::gpu::Gpu).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GpuOptions {
    /// Run the validation layer with synchronization validation; slow.
    pub validation: bool,
    /// Draw sprites as instanced quads even if large points are supported (to test the fallback).
    pub quads: bool,
    /// Whether passes with both a compute and a fragment shader use the former; `None`: depends on the kind of device, and GPUs do.
    pub compute: Option<bool>,
    /// Treat a CPU device as a GPU, for tests: it computes the sums, reconstructs in compute shaders and is double-buffered.
    pub as_gpu: bool,
}

impl GpuOptions {
    /// Validation if `POINTILLIST_VALIDATION` is set to anything but `0`, `as_gpu` by `POINTILLIST_AS_GPU` likewise, and `compute` by
    /// `POINTILLIST_COMPUTE` (`0` or not), for measurements.
    pub fn from_env() -> Self {
        let switch = |name| std::env::var(name).ok().filter(|v| !v.is_empty()).map(|v| v != "0");
        Self {
            validation: switch("POINTILLIST_VALIDATION").unwrap_or(false),
            quads: false,
            compute: switch("POINTILLIST_COMPUTE"),
            as_gpu: switch("POINTILLIST_AS_GPU").unwrap_or(false),
        }
    }
}
