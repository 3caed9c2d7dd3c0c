//! Draws egui's triangles over the picture.

use std::collections::BTreeMap;
use std::sync::Arc;

use egui::epaint::{ImageData, ImageDelta, Primitive};
use egui::{ClippedPrimitive, ColorImage, TextureId, TexturesDelta};
use egui_ash_renderer::allocator::GpuAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer, RendererError};

use crate::gpu::{ForeignRenderer, FrameNumber, Gpu, GpuError, GpuFrame, RendererParts, Swapchain};

type EguiRenderer = Renderer<GpuAllocator>;

/// Draws the tessellated output of egui into the acquired swapchain image.
///
/// It also keeps the textures, which outlive hidden windows, format changes, lost surfaces and lost devices: drawing continues with any
/// swapchain, and egui need not send anything again. Drawing waits for the GPU only if a texture has changed, which is rare after the first
/// frames.
pub struct PanelRenderer {
    gpu: Arc<Gpu>,
    renderer: Option<ForeignRenderer<EguiRenderer>>,
    /// Each texture, and whether the renderer has its present contents.
    textures: BTreeMap<TextureId, (ImageDelta, bool)>,
    /// Freed textures, each with the last frame that may use it.
    freed: Vec<(FrameNumber, TextureId)>,
}

impl PanelRenderer {
    /// Makes pipelines for the swapchain's format.
    ///
    /// # Errors
    ///
    /// [`GpuError`] naming the call.
    pub fn new(swapchain: &Swapchain) -> Result<Self, GpuError> {
        let renderer = ForeignRenderer::for_window(swapchain, renderer)?;
        Ok(Self { gpu: swapchain.gpu().clone(), renderer, textures: BTreeMap::new(), freed: Vec::new() })
    }

    /// Draws over the acquired image, after [`Swapchain::draw`], once per frame. Without an acquired image it only stores texture updates,
    /// which must not be lost.
    ///
    /// # Errors
    ///
    /// [`GpuError`] naming the call; [`GpuError::Panel`] for triangles with an unknown texture. The next call recreates pipelines and
    /// textures.
    pub fn draw(
        &mut self,
        swapchain: &mut Swapchain,
        frame: &mut GpuFrame<'_>,
        textures: TexturesDelta,
        triangles: &[ClippedPrimitive],
        pixels_per_point: f32,
    ) -> Result<(), GpuError> {
        self.follow(swapchain);
        self.take(textures, frame.number());
        let outcome = self.try_draw(swapchain, frame, triangles, pixels_per_point);
        if outcome.is_err() {
            self.renderer = None;
        }
        outcome
    }

    fn try_draw(
        &mut self,
        swapchain: &mut Swapchain,
        frame: &mut GpuFrame<'_>,
        triangles: &[ClippedPrimitive],
        pixels_per_point: f32,
    ) -> Result<(), GpuError> {
        if !self.renderer.as_ref().is_some_and(|renderer| renderer.fits(swapchain)) {
            self.textures.values_mut().for_each(|(_, known)| *known = false);
            self.renderer = None;
            self.renderer = ForeignRenderer::for_window(swapchain, renderer)?;
        }
        let Some(renderer) = self.renderer.as_mut().filter(|_| swapchain.is_acquired()) else {
            return Ok(());
        };
        let (gpu, textures, freed) = (&self.gpu, &mut self.textures, &mut self.freed);
        renderer.change(|egui, queue, pool| {
            for (_, id) in freed.extract_if(.., |(last, _)| gpu.has_completed(*last)) {
                egui.free_texture(id).map_err(panel_error)?;
            }
            for (id, (texture, known)) in textures.iter_mut().filter(|(_, (_, known))| !known) {
                // Only whole textures are uploaded: a partial update would discard the rest (the renderer transitions from UNDEFINED).
                egui.set_texture(queue, pool, *id, texture).map_err(panel_error)?;
                *known = true;
            }
            Ok(())
        })?;
        let draws = |t: &ClippedPrimitive| matches!(&t.primitive, Primitive::Mesh(m) if !m.is_empty());
        if !triangles.iter().any(draws) {
            return Ok(()); // the renderer would make empty buffers
        }
        renderer.draw(swapchain, frame, |egui, commands, extent| {
            egui.cmd_draw(commands, extent, pixels_per_point, triangles).map_err(panel_error)
        })
    }

    /// Releases the resources of the previous device if this swapchain has another.
    fn follow(&mut self, swapchain: &Swapchain) {
        if !Arc::ptr_eq(&self.gpu, swapchain.gpu()) {
            self.renderer = None;
            self.gpu = swapchain.gpu().clone();
            for (_, id) in self.freed.drain(..) {
                self.textures.remove(&id);
            }
        }
    }

    /// Applies egui's texture updates.
    fn take(&mut self, mut delta: TexturesDelta, frame: FrameNumber) {
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
        // Still used by this frame; freed after it.
        self.freed.extend(delta.free.drain().map(|id| (frame, id)));
        self.textures.retain(|id, _| self.freed.iter().all(|(last, freed)| freed != id || *last == frame));
    }
}

/// Makes egui's renderer.
fn renderer(parts: RendererParts) -> Result<EguiRenderer, GpuError> {
    let mode = RenderMode::DynamicRendering(DynamicRendering {
        color_attachment_format: parts.format,
        depth_attachment_format: None,
        stencil_attachment_format: None,
    });
    // Every draw has buffers of its own: an image of two layers takes two.
    let options = Options { in_flight_frames: parts.draws, ..Options::default() };
    Renderer::with_gpu_allocator(parts.allocator, parts.device, mode, options).map_err(panel_error)
}

/// Converts the renderer's error.
fn panel_error(error: RendererError) -> GpuError {
    match error {
        RendererError::Vulkan(result) => GpuError::Call { call: "drawing the panel".into(), result },
        RendererError::GpuAllocator(source) => {
            GpuError::Memory { name: "the panel".into(), source, numbers: String::new() }
        }
        other => GpuError::Panel(other.to_string()),
    }
}

/// Copies a partial update into the whole texture, clipped.
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
    use crate::gpu::{
        Access, Attachment, ColorOutput, DeviceChoice, GpuOptions, Image, ImageDesc, Region, TexelFormat,
        read_image,
    };

    /// The bytes of a texel of each layer of an image that holds colours as `output` says, after an opaque rectangle of one grey was drawn
    /// over black.
    fn drawn(output: ColorOutput, format: TexelFormat, layers: u32, grey: u8) -> Vec<Vec<u8>> {
        let options = GpuOptions { validation: true, ..GpuOptions::default() };
        let gpu = Gpu::with_options(&DeviceChoice::Best, options).expect("a device with validation");
        let desc = ImageDesc::new(format, [32, 32]).layered(layers);
        let mut target = Image::of(&gpu, "target", desc).expect("an image");
        let mut panel = ForeignRenderer::for_images(&gpu, &target, output, renderer).expect("a panel");
        let context = egui::Context::default();
        let rect = egui::Rect::from_min_max(egui::pos2(-9.0, -9.0), egui::pos2(99.0, 99.0));
        let color = egui::Color32::from_gray(grey);
        let input = egui::RawInput { screen_rect: Some(rect), ..egui::RawInput::default() };
        let mut output = context.run_ui(input, |ui| _ = ui.painter().rect_filled(rect, 0.0, color));
        let triangles = context.tessellate(output.shapes, 1.0);
        let mut frame = gpu.begin().expect("a frame");
        for (id, parts) in output.textures_delta.set.drain() {
            for part in &parts {
                let set = |egui: &mut EguiRenderer, queue, pool| {
                    egui.set_texture(queue, pool, id, part).map_err(panel_error)
                };
                panel.change(set).expect("a texture");
            }
        }
        let mut cmd = frame.cmd();
        cmd.access(&mut target, Access::ColorWrite);
        cmd.rendering(&[Attachment::cleared(&target)], |_| ());
        let draw = |egui: &mut EguiRenderer, commands, extent| {
            egui.cmd_draw(commands, extent, 1.0, &triangles).map_err(panel_error)
        };
        panel.draw_image(&mut cmd, &mut target, draw).expect("drawn");
        frame.submit().expect("submit");
        let region = Region { origin: [16, 16], extent: [1, 1] };
        let texels =
            (0..layers).map(|layer| read_image(&gpu, &mut target, layer, region).expect("the texel"));
        let texels = texels.collect();
        assert!(gpu.validation_messages().is_empty(), "{:?}", gpu.validation_messages());
        texels
    }

    /// A window with a layer for each eye shows the panel to both, at the same place.
    #[test]
    fn both_layers_show_the_panel() {
        assert_eq!(drawn(ColorOutput::Sdr, TexelFormat::Rgba8, 2, 255), [[255_u8; 4]; 2]);
        let wide = |layers| drawn(ColorOutput::ScRgb, TexelFormat::Rgba16F, layers, 255);
        assert_eq!(wide(2), [wide(1), wide(1)].concat());
    }

    /// White is 203 cd/m² (ITU-R BT.2408), and a middle grey what sRGB makes of it, in both encodings.
    #[test]
    fn wide_outputs_show_the_panel_at_the_luminance_of_paper() {
        for (grey, linear) in [(255, 1.0), (128, 0.2158)] {
            let half = &drawn(ColorOutput::ScRgb, TexelFormat::Rgba16F, 1, grey)[0];
            let bits = u32::from(u16::from_le_bytes([half[0], half[1]]));
            // A normal half float: 5 bits of exponent with bias 15, 10 of mantissa.
            let value = f32::from_bits((((bits >> 10) + 112) << 23) | ((bits & 1023) << 13));
            let wanted = linear * 203.0 / 80.0;
            assert!((value / wanted - 1.0).abs() < 0.03, "{grey}: {value} instead of {wanted}");
        }
        // PQ of 203 cd/m² is 0.5807 (BT.2408, table 1: 58 %), of 43.8 cd/m² 0.4235 by the formula of ST 2084.
        for (grey, pq) in [(255, 0.5807), (128, 0.4235)] {
            for format in [TexelFormat::Rgb10A2, TexelFormat::Bgr10A2] {
                let bytes = &drawn(ColorOutput::Hdr10, format, 1, grey)[0];
                let word = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
                let channels = [0, 10, 20].map(|shift| (word >> shift & 1023) as f32 / 1023.0);
                for value in channels {
                    assert!((value - pq).abs() < 0.005, "{grey}: {channels:?} instead of {pq}");
                }
            }
        }
    }
}
