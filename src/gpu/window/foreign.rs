//! Renderers of other crates, which draw over the picture in a window.

use std::sync::{Arc, Mutex};

use ash::vk;
use gpu_allocator::vulkan::Allocator;

use crate::gpu::commands::cmd::{Cmd, LoadOp, Texture};
use crate::gpu::commands::frame::GpuFrame;
use crate::gpu::device::gpu::Gpu;
use crate::gpu::device::retire::Retired;
use crate::gpu::device::ring::IN_FLIGHT;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::resources::image::{Image, TexelFormat};
use crate::gpu::resources::pipeline::{Blend, GraphicsDesc, Pipeline, Topology, VertexLayout};
use crate::gpu::resources::sync::Access;
use crate::gpu::window::images::WindowImage;
use crate::gpu::window::surface::ColorOutput;
use crate::gpu::window::swapchain::Swapchain;

/// Device objects for creating a foreign renderer.
pub struct RendererParts {
    /// The device.
    pub device: ash::Device,
    /// The allocator of the device's memory.
    pub allocator: Arc<Mutex<Allocator>>,
    /// Format of the images to draw into.
    pub format: vk::Format,
    /// Number of draws in flight.
    pub draws: usize,
}

/// A renderer of another crate that draws over the picture in a window. Dropping it retires it.
///
/// Images of two layers show the same in both. If the window has wide-range colours, the renderer draws into an 8-bit image, which is then
/// converted and blended over the picture.
pub struct ForeignRenderer<R: Send + 'static> {
    gpu: Arc<Gpu>,
    /// Taken only by `drop`.
    renderer: Option<Box<R>>,
    /// Command pool for its uploads.
    uploads: vk::CommandPool,
    /// Format and layers of the window's images.
    format: vk::Format,
    layers: u32,
    conversion: Option<Conversion>,
}

/// The 8-bit image, and the pipeline that blends it over the picture.
struct Conversion {
    pipeline: Pipeline,
    image: Option<Image>,
}

impl<R: Send + 'static> ForeignRenderer<R> {
    /// Creates a renderer for the images of a window; `None` while the window has none.
    ///
    /// # Errors
    ///
    /// [`GpuError`] naming the call, and the errors of `make`.
    pub fn for_window(
        swapchain: &Swapchain,
        make: impl FnOnce(RendererParts) -> Result<R, GpuError>,
    ) -> Result<Option<Self>, GpuError> {
        if swapchain.format() == vk::Format::UNDEFINED {
            return Ok(None);
        }
        let images = (swapchain.format(), swapchain.layers());
        Self::new(swapchain.gpu(), images, swapchain.output(), make).map(Some)
    }

    /// Creates a renderer for images like this one with colours encoded as `output`.
    #[cfg(test)]
    pub fn for_images(
        gpu: &Arc<Gpu>,
        image: &Image,
        output: ColorOutput,
        make: impl FnOnce(RendererParts) -> Result<R, GpuError>,
    ) -> Result<Self, GpuError> {
        Self::new(gpu, (image.format().raw(), image.layers()), output, make)
    }

    fn new(
        gpu: &Arc<Gpu>,
        (format, layers): (vk::Format, u32),
        output: ColorOutput,
        make: impl FnOnce(RendererParts) -> Result<R, GpuError>,
    ) -> Result<Self, GpuError> {
        let wide = match output {
            ColorOutput::Sdr => None,
            ColorOutput::ScRgb => Some((TexelFormat::Rgba16F, 0)),
            ColorOutput::Hdr10 if format == TexelFormat::Bgr10A2.raw() => Some((TexelFormat::Bgr10A2, 1)),
            ColorOutput::Hdr10 => Some((TexelFormat::Rgb10A2, 1)),
        };
        let conversion = match wide {
            Some((target, encoding)) => {
                Some(Conversion { pipeline: blend(gpu, target, encoding)?, image: None })
            }
            None => None,
        };
        let drawn = if conversion.is_some() { TexelFormat::Rgba8.raw() } else { format };
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(gpu.queue_family);
        // SAFETY: the family exists.
        let uploads = unsafe { gpu.device.create_command_pool(&info, None) }.named("vkCreateCommandPool")?;
        gpu.name(uploads, "panel uploads");
        // From here on a failure drops `this`, which retires the pool.
        let mut this = Self { gpu: gpu.clone(), renderer: None, uploads, format, layers, conversion };
        let (device, allocator) = (gpu.device.clone(), gpu.memory.shared());
        let parts = RendererParts { device, allocator, format: drawn, draws: IN_FLIGHT * layers as usize };
        this.renderer = Some(Box::new(make(parts)?));
        Ok(this)
    }

    /// Whether it can draw into the window's images.
    pub fn fits(&self, swapchain: &Swapchain) -> bool {
        let images = (swapchain.format(), swapchain.layers());
        Arc::ptr_eq(&self.gpu, swapchain.gpu()) && (self.format, self.layers) == images
    }

    /// Calls `change` with the renderer, the queue and the pool for its uploads.
    ///
    /// # Errors
    ///
    /// The errors of `change`, and a lost device.
    pub fn change(
        &mut self,
        change: impl FnOnce(&mut R, vk::Queue, vk::CommandPool) -> Result<(), GpuError>,
    ) -> Result<(), GpuError> {
        self.gpu.alive("vkQueueSubmit")?;
        self.renderer.as_mut().map_or(Ok(()), |renderer| change(renderer, self.gpu.queue, self.uploads))
    }

    /// Draws over the acquired image of the window, if there is one; `record` records the renderer's commands for an
    /// image of this extent, once for each of its layers.
    ///
    /// # Errors
    ///
    /// [`GpuError`] naming the call, and the errors of `record`.
    pub fn draw(
        &mut self,
        swapchain: &mut Swapchain,
        frame: &mut GpuFrame<'_>,
        record: impl FnMut(&mut R, vk::CommandBuffer, vk::Extent2D) -> Result<(), GpuError>,
    ) -> Result<(), GpuError> {
        self.gpu.alive("vkQueueSubmit")?;
        let Some(acquired) = &mut swapchain.acquired else { return Ok(()) };
        acquired.claim(frame);
        let mut cmd = frame.cmd();
        let mut cmd = cmd.scope("panel");
        if acquired.image.access == Access::Acquired {
            cmd.clear_shown(&mut acquired.image);
        }
        self.draw_over(&mut cmd, &mut acquired.image, record)
    }

    /// Draws over level 0 of an image of the renderer's format.
    #[cfg(test)]
    pub fn draw_image(
        &mut self,
        cmd: &mut Cmd<'_>,
        image: &mut Image,
        record: impl FnMut(&mut R, vk::CommandBuffer, vk::Extent2D) -> Result<(), GpuError>,
    ) -> Result<(), GpuError> {
        let mut target = WindowImage::of(image);
        let outcome = self.draw_over(cmd, &mut target, record);
        image.access[0] = target.access;
        outcome
    }

    fn draw_over(
        &mut self,
        cmd: &mut Cmd<'_>,
        target: &mut WindowImage,
        mut record: impl FnMut(&mut R, vk::CommandBuffer, vk::Extent2D) -> Result<(), GpuError>,
    ) -> Result<(), GpuError> {
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        let [width, height] = target.extent;
        let mut paint = |cmd: &mut Cmd<'_>, view, load| {
            let mut outcome = Ok(());
            cmd.render_into(&[(view, load)], [width, height], 1, |cmd| {
                outcome = record(renderer, cmd.raw, vk::Extent2D { width, height });
            });
            outcome
        };
        let Some(conversion) = &mut self.conversion else {
            cmd.access_shown(target.raw, &mut target.access, Access::ColorBlend);
            return target.views().iter().try_for_each(|view| paint(cmd, *view, LoadOp::Keep));
        };
        let image = match conversion.image.take().filter(|image| image.extent(0) == target.extent) {
            Some(image) => image,
            None => Image::new(&self.gpu, "panel", TexelFormat::Rgba8, target.extent)?,
        };
        let image = conversion.image.insert(image);
        cmd.access(image, Access::ColorWrite);
        paint(cmd, image.view_of(Some(0)), LoadOp::Clear)?;
        cmd.access(image, Access::Sampled);
        cmd.access_shown(target.raw, &mut target.access, Access::ColorBlend);
        let texture = Texture::texels(image);
        for view in target.views() {
            cmd.render_into(&[(*view, LoadOp::Keep)], target.extent, 1, |cmd| {
                cmd.bind(&conversion.pipeline, &[], &[texture]);
                cmd.draw_triangle(&conversion.pipeline);
            });
        }
        Ok(())
    }
}

/// Pipeline that converts the 8-bit image to an output's encoding and blends it over images of this format.
fn blend(gpu: &Arc<Gpu>, format: TexelFormat, encoding: u32) -> Result<Pipeline, GpuError> {
    Pipeline::new(
        gpu,
        &GraphicsDesc {
            name: "panel",
            vert: ("fullscreen.vert", &[]),
            frag: ("panel.frag", &[encoding]),
            push_bytes: 0,
            textures: 1,
            attachments: &[(format, Blend::Over)],
            layers: 1,
            topology: Topology::Fullscreen,
            vertex: VertexLayout::default(),
        },
    )
}

impl<R: Send + 'static> Drop for ForeignRenderer<R> {
    fn drop(&mut self) {
        let renderer = self.renderer.take().map(|renderer| renderer as Box<dyn Send>);
        self.gpu.retire(Retired::Foreign(self.uploads, renderer));
    }
}
