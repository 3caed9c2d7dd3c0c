//! How a device is to be opened.

/// Options of opening a [`Gpu`](crate::gpu::Gpu).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GpuOptions {
    /// Run the validation layer with synchronization validation; slow.
    pub validation: bool,
    /// Draw sprites as instanced quads even where large points exist (the fallback, for its tests).
    pub quads: bool,
    /// Whether a pass that has a compute shader beside its fragment shader runs that one; `None` leaves it to the kind of the device: GPUs
    /// run it.
    pub compute: Option<bool>,
    /// Treat a device that is the processor as a GPU, for tests: it sums, reconstructs in compute shaders and works beside the loop.
    pub as_gpu: bool,
}

impl GpuOptions {
    /// Validation when `POINTILLIST_VALIDATION` is set to anything but `0`, `as_gpu` by `POINTILLIST_AS_GPU` in the same way, and `compute` as
    /// `POINTILLIST_COMPUTE` says, `0` or not, to measure it.
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
