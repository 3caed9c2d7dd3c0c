//! What draws egui's triangles: the renderer of another crate, so that it can be retired as our own objects are.

use ash::vk;
use egui_ash_renderer::allocator::GpuAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer, RendererError};

use crate::gpu::commands::frame::IN_FLIGHT;
use crate::gpu::device::Gpu;
use crate::gpu::error::{GpuError, Named};

/// The renderer's objects, all of one target format.
pub(in crate::gpu) struct Painter {
    pub renderer: Renderer<GpuAllocator>,
    /// Where it records uploads.
    pub pool: vk::CommandPool,
}

impl Painter {
    pub fn new(gpu: &Gpu, format: vk::Format) -> Result<Self, GpuError> {
        let mode = RenderMode::DynamicRendering(DynamicRendering {
            color_attachment_format: format,
            depth_attachment_format: None,
            stencil_attachment_format: None,
        });
        let options = Options { in_flight_frames: IN_FLIGHT, ..Options::default() };
        let renderer = Renderer::with_gpu_allocator(gpu.memory.shared(), gpu.device.clone(), mode, options)
            .map_err(panel_error)?;
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(gpu.queue_family);
        // SAFETY: the family exists.
        let pool = unsafe { gpu.device.create_command_pool(&info, None) }.named("vkCreateCommandPool")?;
        gpu.name(pool, "panel uploads");
        Ok(Self { renderer, pool })
    }

    /// Destroys everything.
    ///
    /// # Safety
    ///
    /// No frame that it has drawn in is pending.
    pub unsafe fn destroy(self: Box<Self>, device: &ash::Device) {
        // SAFETY: its uploads were waited for.
        unsafe { device.destroy_command_pool(self.pool, None) };
        // The renderer destroys its own objects.
        drop(self.renderer);
    }
}

/// What the renderer's errors mean here.
pub(in crate::gpu) fn panel_error(error: RendererError) -> GpuError {
    match error {
        RendererError::Vulkan(result) => GpuError::Call { call: "drawing the panel".into(), result },
        RendererError::GpuAllocator(source) => GpuError::Memory { name: "the panel".into(), source },
        other => GpuError::Panel(other.to_string()),
    }
}
