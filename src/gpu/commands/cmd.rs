//! Recording: draws into images, with what they read. Barriers are in `sync.rs`, scopes in `timing.rs`.

use std::ffi::CString;

use ash::vk;

use crate::gpu::commands::sync::Access;
use crate::gpu::device::Gpu;
use crate::gpu::resources::buffer::Buffer;
use crate::gpu::resources::image::Image;
use crate::gpu::resources::pipeline::{PUSH_STAGES, Pipeline};
use crate::gpu::timing::queries::Timers;

/// Records the commands of one frame, in order.
pub struct Cmd<'f> {
    pub(in crate::gpu) gpu: &'f Gpu,
    pub(in crate::gpu) raw: vk::CommandBuffer,
    pub(in crate::gpu) timers: &'f mut Timers,
}

/// What a target holds when drawing begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    /// What it held.
    Keep,
    /// Zero.
    Clear,
    /// Anything: every texel will be written.
    Discard,
}

/// One level of an image to draw into, made ready by [`Cmd::access`].
#[derive(Clone, Copy)]
pub struct Target<'a> {
    /// The image.
    pub image: &'a Image,
    /// Mip level.
    pub level: u32,
    /// What it holds at first.
    pub load: Load,
}

/// How a texture is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampler {
    /// The texel that holds the position.
    Nearest = 0,
    /// Interpolated between texels and levels, clamped to the edge.
    Trilinear = 1,
}

/// One image to read, made ready by [`Cmd::access`].
#[derive(Clone, Copy)]
pub struct Texture<'a> {
    /// The image.
    pub image: &'a Image,
    /// One level, or `None` for all of them.
    pub level: Option<u32>,
    /// How it is read.
    pub sampler: Sampler,
}

impl Cmd<'_> {
    /// Draws into `targets`, all of one extent: `draw` records the draws.
    pub fn rendering(&mut self, targets: &[Target<'_>], draw: impl FnOnce(&mut Self)) {
        let views: Vec<_> = targets.iter().map(|t| (t.image.view_of(Some(t.level)), t.load)).collect();
        self.render_into(&views, targets.first().map_or([1, 1], |t| t.image.extent(t.level)), draw);
    }

    /// Draws into views of this extent, whose images were made ready.
    pub(in crate::gpu) fn render_into(
        &mut self,
        views: &[(vk::ImageView, Load)],
        [width, height]: [u32; 2],
        draw: impl FnOnce(&mut Self),
    ) {
        let attachments: Vec<_> = views
            .iter()
            .map(|(view, load)| {
                vk::RenderingAttachmentInfo::default()
                    .image_view(*view)
                    .image_layout(Access::ColorBlend.layout())
                    .load_op(match load {
                        Load::Keep => vk::AttachmentLoadOp::LOAD,
                        Load::Clear => vk::AttachmentLoadOp::CLEAR,
                        Load::Discard => vk::AttachmentLoadOp::DONT_CARE,
                    })
                    .store_op(vk::AttachmentStoreOp::STORE)
            })
            .collect();
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let viewport = vk::Viewport {
            x: 0.0,
            y: 0.0,
            width: width as f32,
            height: height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        let info =
            vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&attachments);
        // SAFETY: the frame is recording, the views belong to live images in the layout that `access` gave them.
        unsafe {
            self.gpu.device.cmd_begin_rendering(self.raw, &info);
            self.gpu.device.cmd_set_viewport(self.raw, 0, &[viewport]);
            self.gpu.device.cmd_set_scissor(self.raw, 0, &[area]);
        }
        draw(self);
        // SAFETY: begun above.
        unsafe { self.gpu.device.cmd_end_rendering(self.raw) };
    }

    /// Selects a pipeline with its push constants and its textures, bindings 0, 1, … in one call (lavapipe's push
    /// descriptors ignore array elements, so every texture is a binding of its own).
    pub fn bind(&mut self, pipeline: &Pipeline, push: &[u8], textures: &[Texture<'_>]) {
        assert_eq!(push.len(), pipeline.push_bytes, "push constants are not those of the pipeline");
        assert_eq!(textures.len(), pipeline.textures as usize, "textures are not those of the pipeline");
        let images: Vec<_> = textures
            .iter()
            .map(|texture| {
                [vk::DescriptorImageInfo::default()
                    .sampler(self.gpu.sampler(texture.sampler))
                    .image_view(texture.image.view_of(texture.level))
                    .image_layout(Access::Sampled.layout())]
            })
            .collect();
        let writes: Vec<_> = (0..)
            .zip(&images)
            .map(|(binding, image)| {
                vk::WriteDescriptorSet::default()
                    .dst_binding(binding)
                    .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
                    .image_info(image)
            })
            .collect();
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: sizes were checked above; all objects are kept by `retire` until the frame has completed.
        unsafe {
            self.gpu.device.cmd_bind_pipeline(self.raw, graphics, pipeline.raw);
            if !push.is_empty() {
                self.gpu.device.cmd_push_constants(self.raw, pipeline.layout, PUSH_STAGES, 0, push);
            }
            if !writes.is_empty() {
                let layout = pipeline.layout;
                self.gpu.push_descriptor.cmd_push_descriptor_set(self.raw, graphics, layout, 0, &writes);
            }
        }
    }

    /// Draws one triangle that covers the target.
    pub fn draw_fullscreen(&mut self) {
        // SAFETY: the pipeline reads no vertices.
        unsafe { self.gpu.device.cmd_draw(self.raw, 3, 1, 0, 0) };
    }

    /// Draws the sprites `first .. first + count` of a vertex buffer whose vertices take `stride` bytes, as points or
    /// as the pipeline was made, as quads.
    pub fn draw_sprites(&mut self, vertices: &Buffer, stride: usize, first: u32, count: u32) {
        let end = (first as usize + count as usize) * stride;
        assert!(end <= vertices.bytes(), "sprites beyond the end of the vertex buffer");
        // SAFETY: the range lies within the buffer, whose writes precede the submission.
        unsafe {
            self.gpu.device.cmd_bind_vertex_buffers(self.raw, 0, &[vertices.raw], &[0]);
            if self.gpu.large_points() {
                self.gpu.device.cmd_draw(self.raw, count, 1, first, 0);
            } else {
                self.gpu.device.cmd_draw(self.raw, 4, count, 0, first);
            }
        }
    }

    pub(in crate::gpu) fn begin_label(&mut self, name: &str) {
        if let (Some(names), Ok(name)) = (&self.gpu.names, CString::new(name)) {
            let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
            // SAFETY: the frame is recording.
            unsafe { names.cmd_begin_debug_utils_label(self.raw, &label) };
        }
    }

    pub(in crate::gpu) fn end_label(&mut self) {
        if let Some(names) = &self.gpu.names {
            // SAFETY: every label was begun by `begin_label`.
            unsafe { names.cmd_end_debug_utils_label(self.raw) };
        }
    }
}
