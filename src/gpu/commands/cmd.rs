//! Records commands: barriers, draws, dispatches and timed scopes.

use std::ops::{Deref, DerefMut, Range};
use std::sync::atomic::Ordering;

use ash::vk;

use crate::gpu::device::gpu::Gpu;
use crate::gpu::resources::buffer::Buffer;
use crate::gpu::resources::image::Image;
use crate::gpu::resources::pipeline::{ComputePipeline, PUSH_STAGES, Pipeline};
use crate::gpu::resources::sync::{Access, BufferBarrier, transition};
use crate::gpu::timing::queries::Timers;

/// Records the commands of one frame, in order.
pub struct Cmd<'f> {
    pub(in crate::gpu) gpu: &'f Gpu,
    pub(in crate::gpu) raw: vk::CommandBuffer,
    pub(in crate::gpu) timers: &'f mut Timers,
}

/// The contents of an attachment when a rendering begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoadOp {
    /// The earlier contents.
    Keep,
    /// Zero.
    Clear,
    /// Undefined: every texel will be written.
    Discard,
}

/// One level of an image to draw into, made ready by [`Cmd::access`].
#[derive(Clone, Copy)]
pub struct Attachment<'a> {
    /// The image.
    pub image: &'a Image,
    /// Mip level.
    pub level: u32,
    /// Its contents when the rendering begins.
    pub load: LoadOp,
}

impl<'a> Attachment<'a> {
    /// Level 0 of an image, of which every texel will be written.
    pub fn whole(image: &'a Image) -> Self {
        Self { image, level: 0, load: LoadOp::Discard }
    }

    /// Level 0 of an image, cleared to zero first.
    pub fn cleared(image: &'a Image) -> Self {
        Self { image, level: 0, load: LoadOp::Clear }
    }
}

/// An image to be read texel by texel, made ready by [`Cmd::access`]. Shaders interpolate arithmetically: texture units interpolate with
/// 8-bit fractions, and need not support filtering of 32-bit floats at all.
#[derive(Clone, Copy)]
pub struct Texture<'a> {
    /// The image.
    pub image: &'a Image,
    /// One level, or `None` for all of them.
    pub level: Option<u32>,
}

impl<'a> Texture<'a> {
    /// One level of an image.
    pub fn level(image: &'a Image, level: u32) -> Self {
        Self { image, level: Some(level) }
    }

    /// Level 0 of an image.
    pub fn texels(image: &'a Image) -> Self {
        Self::level(image, 0)
    }

    /// All levels of an image.
    pub fn all_levels(image: &'a Image) -> Self {
        Self { image, level: None }
    }
}

/// A resource bound to a compute shader.
#[derive(Clone, Copy)]
pub enum StorageBinding<'a> {
    /// All of a buffer.
    Buffer(&'a Buffer),
    /// Level 0 of an image that [`Cmd::access`] has made ready for [`Access::Storage`].
    Image(&'a Image),
    /// The same of one of its layers, as an image by itself.
    Layer(&'a Image, u32),
    /// An image that [`Cmd::access`] has made ready for [`Access::Sampled`].
    Texture(Texture<'a>),
}

impl Cmd<'_> {
    /// Makes all levels of `image` ready for this use, ordered after all earlier uses.
    pub fn access(&mut self, image: &mut Image, access: Access) {
        let levels = 0..image.levels();
        self.access_levels(image, levels, access);
    }

    /// Makes some levels of `image` ready for this use.
    pub fn access_levels(&mut self, image: &mut Image, levels: Range<u32>, access: Access) {
        let mut barriers = Vec::new();
        for level in levels {
            let before = std::mem::replace(&mut image.access[level as usize], access);
            if before != access || !access.reads_only() {
                barriers.push(transition(image.raw, level, before, access, access.discards()));
            }
        }
        if !barriers.is_empty() {
            self.barrier(&vk::DependencyInfo::default().image_memory_barriers(&barriers));
        }
    }

    /// Transitions a swapchain image from its last use `before`. Its contents are discarded only after [`Access::Acquired`].
    pub(in crate::gpu) fn access_shown(&mut self, image: vk::Image, before: &mut Access, access: Access) {
        let barriers = [transition(image, 0, std::mem::replace(before, access), access, false)];
        self.barrier(&vk::DependencyInfo::default().image_memory_barriers(&barriers));
    }

    /// Barrier between accesses of compute shaders to buffers before and after this call.
    pub fn storage_in_turn(&mut self) {
        self.buffer_barrier(BufferBarrier::StorageInTurn);
    }

    pub(in crate::gpu) fn buffer_barrier(&mut self, barrier: BufferBarrier) {
        self.barrier(&vk::DependencyInfo::default().memory_barriers(&[barrier.barrier()]));
    }

    fn barrier(&mut self, info: &vk::DependencyInfo<'_>) {
        // SAFETY: the command buffer is recording outside of a rendering; images live at least as long as the frame.
        unsafe { self.gpu.device.cmd_pipeline_barrier2(self.raw, info) };
    }

    /// Renders to all layers of `attachments`, which have one extent and as many layers; `draw` records the draws.
    pub fn rendering(&mut self, attachments: &[Attachment<'_>], draw: impl FnOnce(&mut Self)) {
        let views: Vec<_> = attachments.iter().map(|a| (a.image.view_of(Some(a.level)), a.load)).collect();
        let (extent, layers) =
            attachments.first().map_or(([1, 1], 1), |a| (a.image.extent(a.level), a.image.layers()));
        self.render_into(&views, extent, layers, draw);
    }

    /// Runs the fragment shader of `pipeline` once for every texel of `attachments`.
    pub fn draw_fullscreen(
        &mut self,
        pipeline: &Pipeline,
        push: &[u8],
        textures: &[Texture<'_>],
        attachments: &[Attachment<'_>],
    ) {
        self.rendering(attachments, |cmd| {
            cmd.bind(pipeline, push, textures);
            cmd.draw_triangle(pipeline);
        });
    }

    /// Renders to views of this extent and of so many layers, whose images are ready.
    pub(in crate::gpu) fn render_into(
        &mut self,
        views: &[(vk::ImageView, LoadOp)],
        [width, height]: [u32; 2],
        layers: u32,
        draw: impl FnOnce(&mut Self),
    ) {
        let attachments: Vec<_> = views
            .iter()
            .map(|(view, load)| {
                vk::RenderingAttachmentInfo::default()
                    .image_view(*view)
                    .image_layout(Access::ColorBlend.layout())
                    .load_op(match load {
                        LoadOp::Keep => vk::AttachmentLoadOp::LOAD,
                        LoadOp::Clear => vk::AttachmentLoadOp::CLEAR,
                        LoadOp::Discard => vk::AttachmentLoadOp::DONT_CARE,
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
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(layers)
            .color_attachments(&attachments);
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

    /// Binds a pipeline with its push constants and its textures, at bindings 0, 1, … (lavapipe's push descriptors ignore
    /// array elements, so every texture is a binding of its own).
    pub fn bind(&mut self, pipeline: &Pipeline, push: &[u8], textures: &[Texture<'_>]) {
        assert_eq!(push.len(), pipeline.push_bytes, "push constants are not those of the pipeline");
        assert_eq!(textures.len(), pipeline.textures as usize, "textures are not those of the pipeline");
        let images: Vec<_> = textures.iter().map(|texture| [self.sampled(texture)]).collect();
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
            self.gpu.device.cmd_bind_pipeline(self.raw, graphics, pipeline.handles.pipeline);
            if !push.is_empty() {
                self.gpu.device.cmd_push_constants(self.raw, pipeline.handles.layout, PUSH_STAGES, 0, push);
            }
            if !writes.is_empty() {
                let layout = pipeline.handles.layout;
                self.gpu.push_descriptor.cmd_push_descriptor_set(self.raw, graphics, layout, 0, &writes);
            }
        }
    }

    /// Descriptor of a texture.
    fn sampled(&self, texture: &Texture<'_>) -> vk::DescriptorImageInfo {
        vk::DescriptorImageInfo::default()
            .sampler(self.gpu.sampler)
            .image_view(texture.image.view_of(texture.level))
            .image_layout(Access::Sampled.layout())
    }

    /// Draws one triangle that covers the attachments, or each of the layers that this pipeline draws to.
    pub fn draw_triangle(&mut self, pipeline: &Pipeline) {
        // SAFETY: the pipeline reads no vertices.
        unsafe { self.gpu.device.cmd_draw(self.raw, 3, pipeline.layers, 0, 0) };
    }

    /// Draws the sprites `first .. first + count` of a vertex buffer with `stride` bytes per vertex, as points or quads depending on the
    /// pipeline.
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

    /// Runs `across` × `down` workgroups of a compute shader for each layer, with these push constants and bindings 0, 1, ….
    pub fn dispatch(
        &mut self,
        pipeline: &ComputePipeline,
        push: &[u8],
        bindings: &[StorageBinding<'_>],
        [across, down]: [u32; 2],
    ) {
        assert_eq!(push.len(), pipeline.push_bytes, "push constants are not those of the pipeline");
        assert_eq!(bindings.len(), pipeline.bindings(), "bindings are not those of the pipeline");
        let buffers = bindings.iter().map(|binding| match binding {
            StorageBinding::Buffer(buffer) => {
                [vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(vk::WHOLE_SIZE)]
            }
            StorageBinding::Image(_) | StorageBinding::Layer(..) | StorageBinding::Texture(_) => {
                Default::default()
            }
        });
        let stored = |view| {
            [vk::DescriptorImageInfo::default().image_view(view).image_layout(Access::Storage.layout())]
        };
        let images = bindings.iter().map(|binding| match binding {
            StorageBinding::Image(image) => stored(image.view_of(Some(0))),
            StorageBinding::Layer(image, layer) => stored(image.layer_view(*layer)),
            StorageBinding::Texture(texture) => [self.sampled(texture)],
            StorageBinding::Buffer(_) => Default::default(),
        });
        let infos: Vec<_> = buffers.zip(images).collect();
        let writes: Vec<_> = (0..)
            .zip(bindings.iter().zip(&infos))
            .map(|(i, (binding, (buffer, image)))| {
                let write = vk::WriteDescriptorSet::default().dst_binding(i);
                match binding {
                    StorageBinding::Buffer(_) => {
                        write.descriptor_type(vk::DescriptorType::STORAGE_BUFFER).buffer_info(buffer)
                    }
                    StorageBinding::Image(_) | StorageBinding::Layer(..) => {
                        write.descriptor_type(vk::DescriptorType::STORAGE_IMAGE).image_info(image)
                    }
                    StorageBinding::Texture(_) => {
                        write.descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER).image_info(image)
                    }
                }
            })
            .collect();
        let (compute, layout) = (vk::PipelineBindPoint::COMPUTE, pipeline.handles.layout);
        // SAFETY: the frame is recording outside of a rendering, sizes were checked above; all objects are kept by
        // `retire` until the frame has completed.
        unsafe {
            self.gpu.device.cmd_bind_pipeline(self.raw, compute, pipeline.handles.pipeline);
            if !push.is_empty() {
                let stage = vk::ShaderStageFlags::COMPUTE;
                self.gpu.device.cmd_push_constants(self.raw, layout, stage, 0, push);
            }
            self.gpu.push_descriptor.cmd_push_descriptor_set(self.raw, compute, layout, 0, &writes);
            self.gpu.device.cmd_dispatch(self.raw, across, down, pipeline.layers);
        }
    }
}

/// Names the GPU work recorded during its lifetime; dropping it closes the scope. Dereferences to the borrowed [`Cmd`].
pub struct Scope<'c, 'f> {
    cmd: &'c mut Cmd<'f>,
    end: Option<u32>,
}

impl<'f> Cmd<'f> {
    /// Opens a label and, when timing is on, a pair of timestamps. Scopes may nest.
    #[must_use = "the scope ends when the guard is dropped"]
    pub fn scope<'c>(&'c mut self, name: &'static str) -> Scope<'c, 'f> {
        self.gpu.debug.begin_label(self.raw, name);
        let begin = self.timers.open(name);
        if let Some(query) = begin {
            self.timestamp(query);
        }
        Scope { cmd: self, end: begin.map(|query| query + 1) }
    }

    fn timestamp(&mut self, query: u32) {
        self.gpu.queries.fetch_add(1, Ordering::Relaxed);
        let (all, pool) = (vk::PipelineStageFlags2::ALL_COMMANDS, self.timers.pool);
        // SAFETY: the query was reset when the frame began and is written once.
        unsafe { self.gpu.device.cmd_write_timestamp2(self.raw, all, pool, query) };
    }
}

impl Drop for Scope<'_, '_> {
    fn drop(&mut self) {
        if let Some(query) = self.end {
            self.cmd.timestamp(query);
        }
        self.cmd.timers.close();
        self.cmd.gpu.debug.end_label(self.cmd.raw);
    }
}

impl<'f> Deref for Scope<'_, 'f> {
    type Target = Cmd<'f>;

    fn deref(&self) -> &Cmd<'f> {
        self.cmd
    }
}

impl<'f> DerefMut for Scope<'_, 'f> {
    fn deref_mut(&mut self) -> &mut Cmd<'f> {
        self.cmd
    }
}
