//! The only place that knows stages, access masks and layouts.
//!
//! Every image remembers, level by level, how it was used last; saying how it is used next yields the barrier.

use std::ops::Range;

use ash::vk;

use crate::gpu::commands::cmd::Cmd;
use crate::gpu::resources::image::Image;

/// How a level of an image is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Never used; the contents are undefined.
    Undefined,
    /// Drawn into from scratch: what was there is discarded.
    ColorWrite,
    /// Drawn into on top of what is there.
    ColorBlend,
    /// Read by a fragment shader.
    Sampled,
    /// Read and written by a compute shader, texel by texel; only images made by
    /// [`Image::storage`](crate::gpu::Image::storage).
    Storage,
    /// Copied from.
    TransferRead,
    /// Copied to; what was there is discarded.
    TransferWrite,
    /// Just acquired from a swapchain: undefined contents, to be used after the acquisition's semaphore.
    Acquired,
    /// Handed to a window.
    Present,
}

/// Stage, access mask and layout of a use.
struct Use {
    stage: vk::PipelineStageFlags2,
    mask: vk::AccessFlags2,
    layout: vk::ImageLayout,
}

/// Stages that wait for the semaphore of an acquired image: all that may come first in using it.
pub(in crate::gpu) const ACQUIRED_AT: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    vk::PipelineStageFlags2::BLIT.as_raw() | vk::PipelineStageFlags2::CLEAR.as_raw(),
);

impl Access {
    fn describe(self) -> Use {
        use vk::{AccessFlags2 as A, ImageLayout as L, PipelineStageFlags2 as S};
        let (stage, mask, layout) = match self {
            Access::Undefined => (S::NONE, A::NONE, L::UNDEFINED),
            Access::ColorWrite | Access::ColorBlend => (
                S::COLOR_ATTACHMENT_OUTPUT,
                A::COLOR_ATTACHMENT_READ | A::COLOR_ATTACHMENT_WRITE,
                L::COLOR_ATTACHMENT_OPTIMAL,
            ),
            Access::Sampled => (S::FRAGMENT_SHADER, A::SHADER_SAMPLED_READ, L::SHADER_READ_ONLY_OPTIMAL),
            Access::TransferWrite => {
                (S::COPY | S::BLIT | S::CLEAR, A::TRANSFER_WRITE, L::TRANSFER_DST_OPTIMAL)
            }
            Access::TransferRead => (S::COPY | S::BLIT, A::TRANSFER_READ, L::TRANSFER_SRC_OPTIMAL),
            Access::Acquired => (ACQUIRED_AT, A::NONE, L::UNDEFINED),
            Access::Present => (S::NONE, A::NONE, L::PRESENT_SRC_KHR),
            Access::Storage => {
                (S::COMPUTE_SHADER, A::SHADER_STORAGE_READ | A::SHADER_STORAGE_WRITE, L::GENERAL)
            }
        };
        Use { stage, mask, layout }
    }

    fn reads_only(self) -> bool {
        matches!(self, Access::Sampled | Access::TransferRead | Access::Present)
    }

    /// The layout an image is in while used like this.
    pub(in crate::gpu) fn layout(self) -> vk::ImageLayout {
        self.describe().layout
    }
}

/// The barrier of one level between two uses; the contents are lost if `discard`.
fn transition(
    image: vk::Image,
    level: u32,
    (before, access): (Access, Access),
    discard: bool,
) -> vk::ImageMemoryBarrier2<'static> {
    let (old, new) = (before.describe(), access.describe());
    vk::ImageMemoryBarrier2::default()
        .image(image)
        .src_stage_mask(old.stage)
        .src_access_mask(if before.reads_only() { vk::AccessFlags2::NONE } else { old.mask })
        .dst_stage_mask(new.stage)
        .dst_access_mask(new.mask)
        .old_layout(if discard { vk::ImageLayout::UNDEFINED } else { old.layout })
        .new_layout(new.layout)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .subresource_range(vk::ImageSubresourceRange {
            aspect_mask: vk::ImageAspectFlags::COLOR,
            base_mip_level: level,
            level_count: 1,
            base_array_layer: 0,
            layer_count: 1,
        })
}

impl Cmd<'_> {
    /// Makes all levels of `image` ready for this use, after everything that used them before.
    pub fn access(&mut self, image: &mut Image, access: Access) {
        let levels = 0..image.levels();
        self.access_levels(image, levels, access);
    }

    /// Makes some levels of `image` ready for this use.
    pub fn access_levels(&mut self, image: &mut Image, levels: Range<u32>, access: Access) {
        let mut barriers = Vec::new();
        for level in levels {
            let before = std::mem::replace(&mut image.access[level as usize], access);
            if before == access && access.reads_only() {
                continue;
            }
            let discard = matches!(access, Access::ColorWrite | Access::TransferWrite);
            barriers.push(transition(image.raw, level, (before, access), discard));
        }
        if !barriers.is_empty() {
            self.barrier(&vk::DependencyInfo::default().image_memory_barriers(&barriers));
        }
    }

    /// Makes an image of a swapchain, used as `before` until now, ready for this use. Nothing is discarded but by
    /// [`Access::Acquired`] before.
    pub(in crate::gpu) fn access_shown(&mut self, image: vk::Image, before: &mut Access, access: Access) {
        let old = std::mem::replace(before, access);
        let barriers = [transition(image, 0, (old, access), false)];
        self.barrier(&vk::DependencyInfo::default().image_memory_barriers(&barriers));
    }

    /// Makes copies into buffers visible to the host once the frame has completed.
    pub(in crate::gpu) fn copies_to_host(&mut self) {
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        self.barrier(&vk::DependencyInfo::default().memory_barriers(&barriers));
    }

    /// Orders what compute shaders read and write in buffers after what they read and wrote before.
    pub fn storage_in_turn(&mut self) {
        let all = vk::AccessFlags2::SHADER_STORAGE_READ | vk::AccessFlags2::SHADER_STORAGE_WRITE;
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
            .src_access_mask(vk::AccessFlags2::SHADER_STORAGE_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
            .dst_access_mask(all)];
        self.barrier(&vk::DependencyInfo::default().memory_barriers(&barriers));
    }

    /// Orders a copy into a buffer after earlier copies into it.
    pub(in crate::gpu) fn copies_in_turn(&mut self) {
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::COPY)
            .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE)];
        self.barrier(&vk::DependencyInfo::default().memory_barriers(&barriers));
    }

    fn barrier(&mut self, info: &vk::DependencyInfo<'_>) {
        // SAFETY: the command buffer is recording outside of a rendering; images live at least as long as the frame.
        unsafe { self.gpu.device.cmd_pipeline_barrier2(self.raw, info) };
    }
}
