//! The panel's triangles over the picture.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use egui::epaint::{ImageData, ImageDelta, Primitive};
use egui::{ClippedPrimitive, ColorImage, TextureId, TexturesDelta};
use egui_ash_renderer::allocator::GpuAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer, RendererError};

use super::cmd::{Cmd, Load, Sampler, Texture};
use super::device::Gpu;
use super::error::{GpuError, Named};
use super::frame::{Frame, IN_FLIGHT};
use super::image::{Format, Image, ImageDesc};
use super::pipeline::{Blend, GraphicsDesc, Pipeline, Topology, VertexLayout};
use super::retire::Retired;
use super::surface::ColorOutput;
use super::swapchain::{Acquired, Swapchain};
use super::sync::Access;

/// The renderer's objects, all of one target format.
pub(in crate::gpu) struct Painter {
    renderer: Renderer<GpuAllocator>,
    /// Where it records uploads.
    pool: vk::CommandPool,
}

impl Painter {
    fn new(gpu: &Gpu, format: vk::Format) -> Result<Self, GpuError> {
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

/// What was made for one format of the window.
struct Panel {
    /// Taken only by `drop`.
    painter: Option<Box<Painter>>,
    gpu: Arc<Gpu>,
    format: vk::Format,
    /// Where the window is not in sRGB: the panel's own image, and what puts it over the picture.
    detour: Option<Detour>,
}

impl Drop for Panel {
    fn drop(&mut self) {
        if let Some(painter) = self.painter.take() {
            self.gpu.retire(Retired::Painter(painter));
        }
    }
}

/// The way of the panel into windows of wide range.
struct Detour {
    pipeline: Pipeline,
    image: Option<Image>,
}

/// Draws what egui has tessellated into the acquired image of a swapchain.
///
/// Textures are kept here too: they outlive windows that are hidden, change their format or lose their surface. Drawing
/// waits for the GPU only where a texture has changed, which is rare after the first frames.
pub struct Overlay {
    gpu: Arc<Gpu>,
    panel: Option<Panel>,
    /// Each texture, and whether the painter has it as it is.
    textures: BTreeMap<TextureId, (ImageDelta, bool)>,
    /// Freed textures, each with the last frame that may use it.
    freed: Vec<(u64, TextureId)>,
}

impl Overlay {
    /// Makes pipelines for the swapchain's format.
    ///
    /// # Errors
    ///
    /// [`GpuError`] naming the call.
    pub fn new(swapchain: &Swapchain) -> Result<Self, GpuError> {
        let gpu = swapchain.gpu().clone();
        let mut overlay = Self { gpu, panel: None, textures: BTreeMap::new(), freed: Vec::new() };
        if swapchain.format() != vk::Format::UNDEFINED {
            overlay.panel = Some(overlay.make(swapchain)?);
        }
        Ok(overlay)
    }

    /// Draws over the acquired image, after [`Swapchain::draw`], once in a frame. Without an acquired image it only takes the
    /// textures, which must not be lost.
    ///
    /// # Errors
    ///
    /// [`GpuError`] naming the call; [`GpuError::Panel`] for triangles with a texture that egui has not delivered.
    pub fn draw(
        &mut self,
        swapchain: &mut Swapchain,
        frame: &mut Frame<'_>,
        textures: TexturesDelta,
        triangles: &[ClippedPrimitive],
        pixels_per_point: f32,
    ) -> Result<(), GpuError> {
        self.take(textures, frame.number());
        self.gpu.alive("vkQueueSubmit")?;
        let format = swapchain.format();
        if self.panel.as_ref().is_none_or(|panel| panel.format != format) {
            self.textures.values_mut().for_each(|(_, known)| *known = false);
            self.panel = None;
            self.panel = Some(self.make(swapchain)?);
        }
        let empty = triangles.iter().all(|t| matches!(&t.primitive, Primitive::Mesh(m) if m.is_empty()));
        let (Some(panel), Some(acquired)) = (&mut self.panel, &mut swapchain.acquired) else { return Ok(()) };
        let Some(painter) = &mut panel.painter else { return Ok(()) };
        let completed = self.gpu.completed()?;
        for (_, id) in self.freed.extract_if(.., |(last, _)| *last <= completed) {
            painter.renderer.free_texture(id).map_err(panel_error)?;
        }
        for (id, (texture, known)) in &mut self.textures {
            if !*known {
                // Whole textures only: the renderer forgets what is around a part (it transitions from UNDEFINED).
                let queue = self.gpu.queue;
                painter.renderer.set_texture(queue, painter.pool, *id, texture).map_err(panel_error)?;
                *known = true;
            }
        }
        if empty {
            return Ok(());
        }
        let mut cmd = frame.cmd();
        let mut cmd = cmd.scope("panel");
        if acquired.shown.access == Access::Acquired {
            cmd.clear_shown(&mut acquired.shown);
        }
        let job = Job { triangles, pixels_per_point };
        match &mut panel.detour {
            None => {
                let shown = &mut acquired.shown;
                cmd.access_shown(shown.raw, &mut shown.access, Access::ColorBlend);
                job.paint(&mut cmd, &mut painter.renderer, (acquired.view, Load::Keep), shown.extent)
            }
            Some(detour) => job.by_detour(&mut cmd, &self.gpu, &mut painter.renderer, (detour, acquired)),
        }
    }

    /// Takes what egui says of its textures.
    fn take(&mut self, mut delta: TexturesDelta, frame: u64) {
        for (id, parts) in delta.set.drain() {
            for part in parts {
                match self.textures.get_mut(&id) {
                    Some((whole, known)) if part.pos.is_some() => {
                        paste(whole, &part);
                        *known = false;
                    }
                    _ => drop(self.textures.insert(id, (part, false))),
                }
            }
            self.freed.retain(|(_, freed)| *freed != id);
        }
        // They are still used by this frame: egui frees them after it.
        self.freed.extend(delta.free.drain().map(|id| (frame, id)));
        self.textures.retain(|id, _| self.freed.iter().all(|(last, freed)| freed != id || *last == frame));
    }

    fn make(&self, swapchain: &Swapchain) -> Result<Panel, GpuError> {
        let (format, output) = (swapchain.format(), swapchain.output());
        let wide = match output {
            ColorOutput::Sdr => None,
            ColorOutput::ScRgb => Some((Format::Rgba16F, 0)),
            ColorOutput::Hdr10 => Some((Format::Rgb10A2, 1)),
        };
        let detour = wide.map(|(target, encoding)| {
            let pipeline = Pipeline::new(
                &self.gpu,
                &GraphicsDesc {
                    name: "panel",
                    vert: ("fullscreen.vert", &[]),
                    frag: ("panel.frag", &[encoding]),
                    push_bytes: 0,
                    textures: 1,
                    targets: &[(target, Blend::Over)],
                    topology: Topology::Fullscreen,
                    vertex: VertexLayout::default(),
                },
            )?;
            Ok::<_, GpuError>(Detour { pipeline, image: None })
        });
        let detour = detour.transpose()?;
        let drawn = if detour.is_some() { Format::Rgba8.raw() } else { format };
        let painter = Some(Box::new(Painter::new(&self.gpu, drawn)?));
        Ok(Panel { painter, gpu: self.gpu.clone(), format, detour })
    }
}

/// What is to be drawn.
struct Job<'a> {
    triangles: &'a [ClippedPrimitive],
    pixels_per_point: f32,
}

impl Job<'_> {
    /// Draws the triangles into a view.
    fn paint(
        &self,
        cmd: &mut Cmd<'_>,
        renderer: &mut Renderer<GpuAllocator>,
        target: (vk::ImageView, Load),
        [width, height]: [u32; 2],
    ) -> Result<(), GpuError> {
        let mut outcome = Ok(());
        cmd.render_into(&[target], [width, height], |cmd| {
            let extent = vk::Extent2D { width, height };
            outcome = renderer.cmd_draw(cmd.raw, extent, self.pixels_per_point, self.triangles);
        });
        outcome.map_err(panel_error)
    }

    /// Draws the triangles into the panel's own image, and that over the picture.
    fn by_detour(
        &self,
        cmd: &mut Cmd<'_>,
        gpu: &Arc<Gpu>,
        renderer: &mut Renderer<GpuAllocator>,
        (detour, acquired): (&mut Detour, &mut Acquired),
    ) -> Result<(), GpuError> {
        let shown = &mut acquired.shown;
        let image = match detour.image.take().filter(|image| image.extent(0) == shown.extent) {
            Some(image) => image,
            None => {
                let (name, format) = ("panel", Format::Rgba8);
                Image::new(gpu, ImageDesc { name, format, extent: shown.extent, mips: false })?
            }
        };
        let image = detour.image.insert(image);
        cmd.access(image, Access::ColorWrite);
        self.paint(cmd, renderer, (image.view_of(Some(0)), Load::Clear), shown.extent)?;
        cmd.access(image, Access::Sampled);
        cmd.access_shown(shown.raw, &mut shown.access, Access::ColorBlend);
        let texture = Texture { image, level: Some(0), sampler: Sampler::Nearest };
        cmd.render_into(&[(acquired.view, Load::Keep)], shown.extent, |cmd| {
            cmd.bind(&detour.pipeline, &[], &[texture]);
            cmd.draw_fullscreen();
        });
        Ok(())
    }
}

/// Writes a part of a texture into the whole; what lies outside is left away.
fn paste(whole: &mut ImageDelta, part: &ImageDelta) {
    let ImageData::Color(source) = &part.image;
    let ImageData::Color(target) = &mut whole.image;
    let target: &mut ColorImage = Arc::make_mut(target);
    let [x, y] = part.pos.unwrap_or_default();
    let ([columns, rows], [width, height]) = (source.size, target.size);
    let columns_left = columns.min(width.saturating_sub(x));
    for row in 0..rows.min(height.saturating_sub(y)) {
        let (from, to) = (row * columns, (y + row) * width + x);
        target.pixels[to..to + columns_left].copy_from_slice(&source.pixels[from..from + columns_left]);
    }
}

/// What the renderer's errors mean here.
fn panel_error(error: RendererError) -> GpuError {
    match error {
        RendererError::Vulkan(result) => GpuError::Call { call: "drawing the panel".into(), result },
        RendererError::GpuAllocator(source) => GpuError::Memory { name: "the panel".into(), source },
        other => GpuError::Panel(other.to_string()),
    }
}
