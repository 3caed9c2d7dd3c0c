//! Defines pipeline stages, access masks and image layouts; no other module uses them.
//!
//! Every image tracks the last use of each level; [`Cmd::access`](crate::gpu::Cmd::access) names the next use, and the barrier follows from
//! the two.

use std::ops::Range;

use ash::vk;

/// A use of a level of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Never used; the contents are undefined.
    Undefined,
    /// Render target; the earlier contents are discarded.
    ColorWrite,
    /// Render target on top of the earlier contents.
    ColorBlend,
    /// Read by a fragment or a compute shader.
    Sampled,
    /// Read and written by a compute shader, texel by texel; only images made by
    /// [for storage](crate::gpu::ImageDesc::storage).
    Storage,
    /// Copied from.
    TransferRead,
    /// Copied to; the earlier contents are discarded.
    TransferWrite,
    /// Just acquired from a swapchain: undefined contents, to be used after the acquisition's semaphore.
    Acquired,
    /// Presented in a window.
    Present,
}

/// Stage, access mask and layout of a use.
struct AccessScope {
    stage: vk::PipelineStageFlags2,
    mask: vk::AccessFlags2,
    layout: vk::ImageLayout,
}

/// Stages that wait for the semaphore of an acquired image: all that may be the first to use it.
pub(in crate::gpu) const ACQUIRED_AT: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::from_raw(
    vk::PipelineStageFlags2::BLIT.as_raw() | vk::PipelineStageFlags2::CLEAR.as_raw(),
);

impl Access {
    fn describe(self) -> AccessScope {
        use vk::{AccessFlags2 as A, ImageLayout as L, PipelineStageFlags2 as S};
        let (stage, mask, layout) = match self {
            Access::Undefined => (S::NONE, A::NONE, L::UNDEFINED),
            Access::ColorWrite | Access::ColorBlend => (
                S::COLOR_ATTACHMENT_OUTPUT,
                A::COLOR_ATTACHMENT_READ | A::COLOR_ATTACHMENT_WRITE,
                L::COLOR_ATTACHMENT_OPTIMAL,
            ),
            Access::Sampled => {
                (S::FRAGMENT_SHADER | S::COMPUTE_SHADER, A::SHADER_SAMPLED_READ, L::SHADER_READ_ONLY_OPTIMAL)
            }
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
        AccessScope { stage, mask, layout }
    }

    /// Whether the use leaves the contents unchanged.
    pub(in crate::gpu) fn reads_only(self) -> bool {
        matches!(self, Access::Sampled | Access::TransferRead | Access::Present)
    }

    /// Whether the use discards the earlier contents.
    pub(in crate::gpu) fn discards(self) -> bool {
        matches!(self, Access::ColorWrite | Access::TransferWrite)
    }

    /// The layout of an image during this use.
    pub(in crate::gpu) fn layout(self) -> vk::ImageLayout {
        self.describe().layout
    }
}

/// `count` levels of an image from `first` on, of all its layers.
pub(in crate::gpu) fn levels(first: u32, count: u32) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        base_mip_level: first,
        level_count: count,
        base_array_layer: 0,
        layer_count: vk::REMAINING_ARRAY_LAYERS,
    }
}

/// One level of some layers of an image, as copies name it.
pub(in crate::gpu) fn level(mip_level: u32, layers: Range<u32>) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        mip_level,
        base_array_layer: layers.start,
        layer_count: layers.end - layers.start,
    }
}

/// The barrier of one level of an image between two uses; the contents are lost if `discard`.
pub(in crate::gpu) fn transition(
    image: vk::Image,
    level: u32,
    before: Access,
    after: Access,
    discard: bool,
) -> vk::ImageMemoryBarrier2<'static> {
    let (old, new) = (before.describe(), after.describe());
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
        .subresource_range(levels(level, 1))
}

/// A barrier for buffers.
#[derive(Clone, Copy)]
pub(in crate::gpu) enum BufferBarrier {
    /// Makes copies into buffers visible to the host once the frame has completed.
    CopiesToHost,
    /// Orders a copy into a buffer after earlier copies into it.
    CopiesInTurn,
    /// Orders accesses of compute shaders to buffers after earlier ones.
    StorageInTurn,
}

impl BufferBarrier {
    pub fn barrier(self) -> vk::MemoryBarrier2<'static> {
        use vk::{AccessFlags2 as A, PipelineStageFlags2 as S};
        let (copied, stored) = (A::TRANSFER_WRITE, A::SHADER_STORAGE_WRITE);
        let (from, written, to, used) = match self {
            Self::CopiesToHost => (S::COPY, copied, S::HOST, A::HOST_READ),
            Self::CopiesInTurn => (S::COPY, copied, S::COPY, copied),
            Self::StorageInTurn => {
                (S::COMPUTE_SHADER, stored, S::COMPUTE_SHADER, A::SHADER_STORAGE_READ | stored)
            }
        };
        vk::MemoryBarrier2::default()
            .src_stage_mask(from)
            .src_access_mask(written)
            .dst_stage_mask(to)
            .dst_access_mask(used)
    }
}
