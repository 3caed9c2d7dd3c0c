//! What the device can do, and what suits it: the differences between devices that passes must know.

use std::sync::atomic::Ordering;

use crate::gpu::device::gpu::Gpu;
use crate::gpu::device::physical::DeviceKind;

impl Gpu {
    /// Whether points of at least 8 pixels can be drawn; sprites are instanced quads otherwise.
    pub fn large_points(&self) -> bool {
        self.large_points
    }

    /// Whether one draw covers several layers of an image (`shaderOutputLayer`), which the pictures of two eyes need. Multiview would do as
    /// well, but lavapipe of Mesa 22.3 draws all views to the first layer.
    pub fn draws_layers(&self) -> bool {
        self.draws_layers
    }

    /// Whether a pass with both a compute and a fragment shader should use the former, with up to 256 threads per workgroup: on GPUs,
    /// sharing the texels read by a workgroup is fast.
    pub fn prefers_compute(&self) -> bool {
        self.prefers_compute
    }

    /// Whether the device is the CPU (and not to be treated as a GPU), so that it competes with the loop and the tracer.
    pub fn is_processor(&self) -> bool {
        self.is_processor
    }

    /// Whether the pixels of a quad can fetch from different mip levels: lavapipe uses the first pixel's level for all.
    pub fn fetches_any_level(&self) -> bool {
        self.info.kind != DeviceKind::Cpu
    }

    /// Bytes of shared memory per workgroup.
    pub fn shared_bytes(&self) -> usize {
        self.max_shared.load(Ordering::Relaxed) as usize
    }

    /// Bytes of a buffer that a shader can access.
    pub fn storage_bytes(&self) -> usize {
        self.max_storage as usize
    }
}
