//! Deferred destruction of objects that a frame in flight may still use.

use ash::vk;
use gpu_allocator::vulkan::Allocation;

use crate::gpu::device::memory::Memory;

/// A pipeline's handles.
#[derive(Clone, Copy, Default)]
pub(in crate::gpu) struct PipelineHandles {
    pub pipeline: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
}

impl PipelineHandles {
    /// # Safety
    ///
    /// No command that uses them is pending or will be submitted.
    pub unsafe fn destroy(self, device: &ash::Device) {
        // SAFETY: the caller promises that the GPU is done with them; null handles are allowed here.
        unsafe {
            device.destroy_pipeline(self.pipeline, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// The handles of a dropped object.
pub(in crate::gpu) enum Retired {
    Buffer(vk::Buffer, Option<Allocation>),
    Image(vk::Image, Vec<vk::ImageView>, Option<Allocation>),
    Pipeline(PipelineHandles),
    /// The command pool and the renderer of a [`ForeignRenderer`](crate::gpu::ForeignRenderer), which destroys its own objects.
    Foreign(vk::CommandPool, Option<Box<dyn Send>>),
}

impl Retired {
    /// Destroys the handles.
    ///
    /// # Safety
    ///
    /// No command that uses them is pending or will be submitted.
    unsafe fn destroy(self, device: &ash::Device, memory: &Memory) {
        // SAFETY: the caller promises that the GPU is done with them; null handles are allowed here.
        unsafe {
            match self {
                Retired::Buffer(buffer, allocation) => {
                    device.destroy_buffer(buffer, None);
                    allocation.into_iter().for_each(|a| memory.free(a));
                }
                Retired::Image(image, views, allocation) => {
                    views.into_iter().for_each(|v| device.destroy_image_view(v, None));
                    device.destroy_image(image, None);
                    allocation.into_iter().for_each(|a| memory.free(a));
                }
                Retired::Pipeline(handles) => handles.destroy(device),
                Retired::Foreign(pool, renderer) => {
                    device.destroy_command_pool(pool, None);
                    drop(renderer);
                }
            }
        }
    }
}

/// Dropped objects waiting for a frame to complete, in order of dropping.
#[derive(Default)]
pub(in crate::gpu) struct RetireQueue {
    waiting: Vec<(u64, Retired)>,
}

impl RetireQueue {
    /// Keeps `object` until this frame, the last that may use it, has completed.
    pub fn push(&mut self, frame: u64, object: Retired) {
        self.waiting.push((frame, object));
    }

    /// Destroys everything whose frame has completed.
    ///
    /// # Safety
    ///
    /// All frames up to `completed` have completed on the GPU.
    pub unsafe fn collect(&mut self, completed: u64, device: &ash::Device, memory: &Memory) {
        for (_, object) in self.waiting.extract_if(.., |(frame, _)| *frame <= completed) {
            // SAFETY: its last frame has completed.
            unsafe { object.destroy(device, memory) };
        }
    }
}
