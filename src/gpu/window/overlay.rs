//! The panel's triangles over the picture.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use egui::epaint::{ImageData, ImageDelta, Primitive};
use egui::{ClippedPrimitive, ColorImage, TextureId, TexturesDelta};
use egui_ash_renderer::Renderer;
use egui_ash_renderer::allocator::GpuAllocator;

use crate::gpu::commands::cmd::{Cmd, Load, Sampler, Texture};
use crate::gpu::commands::frame::Frame;
use crate::gpu::commands::sync::Access;
use crate::gpu::device::Gpu;
use crate::gpu::device::retire::Retired;
use crate::gpu::error::GpuError;
use crate::gpu::resources::image::{Format, Image, ImageDesc};
use crate::gpu::resources::pipeline::{Blend, GraphicsDesc, Pipeline, Topology, VertexLayout};
use crate::gpu::window::acquire::Acquired;
use crate::gpu::window::painter::{Painter, panel_error};
use crate::gpu::window::surface::ColorOutput;
use crate::gpu::window::swapchain::Swapchain;

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
/// Textures are kept here too: they outlive windows that are hidden, change their format or lose their surface, and lost
/// devices: the overlay goes on with the swapchain that it is given, egui need not send anything again. Drawing
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
            overlay.panel = Some(overlay.make(swapchain.format(), swapchain.output())?);
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
        self.follow(swapchain);
        self.take(textures, frame.number());
        self.gpu.alive("vkQueueSubmit")?;
        let format = swapchain.format();
        if self.panel.as_ref().is_none_or(|panel| panel.format != format) {
            self.textures.values_mut().for_each(|(_, known)| *known = false);
            self.panel = None;
            self.panel = Some(self.make(format, swapchain.output())?);
        }
        let draws = |t: &ClippedPrimitive| matches!(&t.primitive, Primitive::Mesh(m) if !m.is_empty());
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
        if !triangles.iter().any(draws) {
            return Ok(()); // the renderer would make empty buffers
        }
        acquired.claim(frame);
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

    /// Leaves the device of earlier frames if this swapchain has another.
    fn follow(&mut self, swapchain: &Swapchain) {
        if !Arc::ptr_eq(&self.gpu, swapchain.gpu()) {
            self.panel = None;
            self.gpu = swapchain.gpu().clone();
            for (_, id) in self.freed.drain(..) {
                self.textures.remove(&id);
            }
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

    fn make(&self, format: vk::Format, output: ColorOutput) -> Result<Panel, GpuError> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::commands::readback::{Region, read_image};
    use crate::gpu::device::GpuOptions;
    use crate::gpu::device::choice::DeviceChoice;
    use crate::gpu::window::present::Shown;

    /// What `output` holds after an opaque rectangle of one grey was drawn over black: red, of each texel.
    fn drawn(output: ColorOutput, format: Format, grey: u8) -> Vec<u8> {
        let options = GpuOptions { validation: true, quads: false };
        let gpu = Gpu::with_options(&DeviceChoice::Best, options).expect("a device with validation");
        let extent = [32, 32];
        let mut target =
            Image::new(&gpu, ImageDesc { name: "target", format, extent, mips: false }).expect("an image");
        let overlay = Overlay { gpu: gpu.clone(), panel: None, textures: BTreeMap::new(), freed: Vec::new() };
        let mut panel = overlay.make(format.raw(), output).expect("a panel");
        let context = egui::Context::default();
        let rect = egui::Rect::from_min_max(egui::pos2(-9.0, -9.0), egui::pos2(99.0, 99.0));
        let color = egui::Color32::from_gray(grey);
        let input = egui::RawInput { screen_rect: Some(rect), ..egui::RawInput::default() };
        let mut egui = context.run_ui(input, |ui| _ = ui.painter().rect_filled(rect, 0.0, color));
        let triangles = context.tessellate(egui.shapes, 1.0);
        let (painter, detour) = (panel.painter.as_mut().expect("made"), panel.detour.as_mut().expect("wide"));
        let mut frame = gpu.begin().expect("a frame");
        for (id, parts) in egui.textures_delta.set.drain() {
            for part in &parts {
                painter.renderer.set_texture(gpu.queue, painter.pool, id, part).expect("a texture");
            }
        }
        let mut cmd = frame.cmd();
        cmd.access(&mut target, Access::ColorWrite);
        let view = target.view_of(Some(0));
        cmd.render_into(&[(view, Load::Clear)], extent, |_| ());
        let shown = Shown { raw: target.raw, extent, access: Access::ColorWrite };
        let mut acquired =
            Acquired { index: 0, semaphore: vk::Semaphore::null(), waiting: None, shown, view };
        let job = Job { triangles: &triangles, pixels_per_point: 1.0 };
        job.by_detour(&mut cmd, &gpu, &mut painter.renderer, (detour, &mut acquired)).expect("drawn");
        frame.submit().expect("submit");
        let region = Region { origin: [16, 16], extent: [1, 1] };
        let bytes = read_image(&gpu, &mut target, region).expect("the texel");
        assert!(gpu.validation_messages().is_empty(), "{:?}", gpu.validation_messages());
        bytes
    }

    /// White is 203 cd/m² (ITU-R BT.2408), and a middle grey what sRGB makes of it, in both encodings.
    #[test]
    fn wide_outputs_show_the_panel_at_the_luminance_of_paper() {
        for (grey, linear) in [(255, 1.0), (128, 0.2158)] {
            let half = drawn(ColorOutput::ScRgb, Format::Rgba16F, grey);
            let bits = u32::from(u16::from_le_bytes([half[0], half[1]]));
            // A normal half float: 5 bits of exponent with bias 15, 10 of mantissa.
            let value = f32::from_bits((((bits >> 10) + 112) << 23) | ((bits & 1023) << 13));
            let wanted = linear * 203.0 / 80.0;
            assert!((value / wanted - 1.0).abs() < 0.03, "{grey}: {value} instead of {wanted}");
        }
        // PQ of 203 cd/m² is 0.5807 (BT.2408, table 1: 58 %), of 43.8 cd/m² 0.4235 by the formula of ST 2084.
        for (grey, pq) in [(255, 0.5807), (128, 0.4235)] {
            let bytes = drawn(ColorOutput::Hdr10, Format::Rgb10A2, grey);
            let word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            let channels = [0, 10, 20].map(|shift| (word >> shift & 1023) as f32 / 1023.0);
            for value in channels {
                assert!((value - pq).abs() < 0.005, "{grey}: {channels:?} instead of {pq}");
            }
        }
    }
}
