//! One generation of a window's swapchain images, and the commands recorded into them. They are recreated whenever size or format of the
//! window changes.

use ash::{khr, vk};

use crate::gpu::commands::cmd::Cmd;
use crate::gpu::device::faults::{CallFaults, DeviceCall};
use crate::gpu::device::gpu::Gpu;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::resources::image::Image;
use crate::gpu::resources::sync::{Access, level, levels};
use crate::gpu::window::surface::Surface;

/// Parameters of a generation.
pub(in crate::gpu) struct ImagesDesc {
    pub capabilities: vk::SurfaceCapabilitiesKHR,
    pub extent: [u32; 2],
    pub format: vk::SurfaceFormatKHR,
    pub mode: vk::PresentModeKHR,
    /// Layers of each image, one or two, which the surface offers.
    pub layers: u32,
    /// The previous generation, or null.
    pub old: vk::SwapchainKHR,
    pub faults: CallFaults,
}

/// Most layers of a swapchain image: one for each eye.
pub(in crate::gpu) const MOST_LAYERS: u32 = 2;

/// A view of each layer of an image to be shown; those of layers that it lacks are null.
pub(in crate::gpu) type LayerViews = [vk::ImageView; MOST_LAYERS as usize];

/// A swapchain image.
pub(in crate::gpu) struct SwapchainImage {
    pub raw: vk::Image,
    pub views: LayerViews,
    /// Signalled by the frame that draws the image; presenting waits for it. It may be reused once the image is acquired again; a semaphore
    /// per frame in flight would not be safe to reuse then.
    pub drawn: vk::Semaphore,
}

/// A `VkSwapchainKHR` with its images.
pub(in crate::gpu) struct SwapchainImages {
    pub raw: vk::SwapchainKHR,
    pub images: Vec<SwapchainImage>,
    pub extent: [u32; 2],
    pub layers: u32,
    pub format: vk::Format,
    /// Whether any of the images was presented.
    pub presented: bool,
}

impl SwapchainImages {
    /// Creates the images; those of the previous generation may still be displayed, but not acquired.
    pub fn new(
        gpu: &Gpu,
        loader: &khr::swapchain::Device,
        surface: &Surface,
        desc: &ImagesDesc,
    ) -> Result<Self, GpuError> {
        let limits = &desc.capabilities;
        // Three images: one being scanned out, one queued, one being drawn.
        let most = if limits.max_image_count == 0 { u32::MAX } else { limits.max_image_count };
        let count = (limits.min_image_count + 1).max(3).min(most);
        let opaque = vk::CompositeAlphaFlagsKHR::OPAQUE;
        let alpha = if limits.supported_composite_alpha.contains(opaque) {
            opaque
        } else {
            vk::CompositeAlphaFlagsKHR::INHERIT
        };
        let [width, height] = desc.extent;
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw)
            .min_image_count(count)
            .image_format(desc.format.format)
            .image_color_space(desc.format.color_space)
            .image_extent(vk::Extent2D { width, height })
            .image_array_layers(desc.layers)
            .image_usage(vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::COLOR_ATTACHMENT)
            .pre_transform(limits.current_transform)
            .composite_alpha(alpha)
            .present_mode(desc.mode)
            .clipped(true)
            .old_swapchain(desc.old);
        desc.faults.check(DeviceCall::Swapchain).named("vkCreateSwapchainKHR")?;
        // SAFETY: all values are among those that the surface has offered; the old chain belongs to this surface.
        let raw = unsafe { loader.create_swapchain(&info, None) }.named("vkCreateSwapchainKHR")?;
        gpu.name(raw, "window");
        let (images, format) = (Vec::new(), desc.format.format);
        let (extent, layers) = (desc.extent, desc.layers);
        let mut chain = SwapchainImages { raw, images, extent, layers, format, presented: false };
        match chain.fill(gpu, loader) {
            Ok(()) => Ok(chain),
            Err(error) => {
                // SAFETY: nothing uses it yet.
                unsafe { chain.destroy(gpu, loader) };
                Err(error)
            }
        }
    }

    fn fill(&mut self, gpu: &Gpu, loader: &khr::swapchain::Device) -> Result<(), GpuError> {
        // SAFETY: the chain was made above.
        let images = unsafe { loader.get_swapchain_images(self.raw) }.named("vkGetSwapchainImagesKHR")?;
        for (i, raw) in images.into_iter().enumerate() {
            gpu.name(raw, &format!("window image {i}"));
            let drawn = gpu.semaphore(&format!("window image {i} drawn"))?;
            self.images.push(SwapchainImage { raw, views: LayerViews::default(), drawn });
            for layer in 0..self.layers {
                let range =
                    vk::ImageSubresourceRange { base_array_layer: layer, layer_count: 1, ..levels(0, 1) };
                let (kind, name) = (vk::ImageViewType::TYPE_2D, format!("window image {i} layer {layer}"));
                self.images[i].views[layer as usize] = gpu.view(raw, self.format, kind, range, &name)?;
            }
        }
        Ok(())
    }

    /// Destroys everything.
    ///
    /// # Safety
    ///
    /// No frame that uses the images is pending, and none of them is acquired or waits to be shown.
    pub unsafe fn destroy(self, gpu: &Gpu, loader: &khr::swapchain::Device) {
        // SAFETY: the caller promises that nothing is pending; null handles are allowed here.
        unsafe {
            for image in self.images {
                image.views.into_iter().for_each(|view| gpu.device.destroy_image_view(view, None));
                gpu.device.destroy_semaphore(image.drawn, None);
            }
            loader.destroy_swapchain(self.raw, None);
        }
    }
}

/// Colour of the window outside of the picture.
const BACKGROUND: vk::ClearColorValue = vk::ClearColorValue { float32: [0.0, 0.0, 0.0, 1.0] };

/// Swapchain image being drawn.
#[derive(Clone, Copy)]
pub(in crate::gpu) struct WindowImage {
    pub raw: vk::Image,
    views: LayerViews,
    pub extent: [u32; 2],
    /// One, which both eyes see, or one for each.
    layers: u32,
    /// Last use.
    pub access: Access,
}

impl WindowImage {
    /// An acquired image of a generation.
    pub fn acquired(chain: &SwapchainImages, index: u32) -> Self {
        let &SwapchainImage { raw, views, .. } = &chain.images[index as usize];
        Self { raw, views, extent: chain.extent, layers: chain.layers, access: Access::Acquired }
    }

    /// Level 0 of an ordinary image of one layer or two.
    pub fn of(image: &Image) -> Self {
        let layers = image.layers().min(MOST_LAYERS);
        let mut views = LayerViews::default();
        (0..layers).for_each(|layer| views[layer as usize] = image.layer_view(layer));
        Self { raw: image.raw, views, extent: image.extent(0), layers, access: image.access[0] }
    }

    /// The view of each layer.
    pub fn views(&self) -> &[vk::ImageView] {
        &self.views[..self.layers as usize]
    }
}

/// Interpolation of a scaled copy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CopyFilter {
    /// Nearest texel: texels keep hard edges, and unscaled copies keep their bits.
    Nearest,
    /// Linear; reduced pictures average all texels.
    Linear,
}

impl CopyFilter {
    fn raw(self) -> vk::Filter {
        match self {
            Self::Nearest => vk::Filter::NEAREST,
            Self::Linear => vk::Filter::LINEAR,
        }
    }
}

/// Source rectangle in a picture and target rectangle in a window: left top corner and exclusive right bottom corner, in texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CopyRegion {
    /// Source in the picture.
    pub from: [[i32; 2]; 2],
    /// Target in the window.
    pub to: [[i32; 2]; 2],
}

impl CopyRegion {
    /// A whole picture of this extent at the left top of the window, unscaled.
    pub fn whole([width, height]: [u32; 2]) -> Self {
        let corners = [[0, 0], [width as i32, height as i32]];
        Self { from: corners, to: corners }
    }

    /// Clips an unscaled copy to images of these extents; a scaled copy must fit already. `None` if nothing remains.
    fn within(self, picture: [u32; 2], window: [u32; 2]) -> Option<Self> {
        let Self { mut from, mut to } = self;
        let size = |corners: [[i32; 2]; 2], i: usize| corners[1][i] - corners[0][i];
        for i in 0..2 {
            let (of_picture, of_window) = (picture[i] as i32, window[i] as i32);
            if size(from, i) == size(to, i) {
                let fits = size(from, i).min(of_picture - from[0][i]).min(of_window - to[0][i]);
                (from[1][i], to[1][i]) = (from[0][i] + fits, to[0][i] + fits);
            }
            let fits = |[a, b]: [[i32; 2]; 2], most: i32| a[i] >= 0 && b[i] > a[i] && b[i] <= most;
            if !fits(from, of_picture) || !fits(to, of_window) {
                return None;
            }
        }
        Some(Self { from, to })
    }

    /// The copy of a layer of the picture into one of the window.
    fn blit(self, from: u32, to: u32) -> vk::ImageBlit {
        let corners = |[a, b]: [[i32; 2]; 2]| {
            [vk::Offset3D { x: a[0], y: a[1], z: 0 }, vk::Offset3D { x: b[0], y: b[1], z: 1 }]
        };
        vk::ImageBlit::default()
            .src_subresource(level(0, from..from + 1))
            .src_offsets(corners(self.from))
            .dst_subresource(level(0, to..to + 1))
            .dst_offsets(corners(self.to))
    }
}

impl Cmd<'_> {
    /// Copies rectangles of level 0 of `picture`, clipped to both images, and clears the rest. Each layer of the window shows the same layer
    /// of the picture; a picture of one layer is shown in all of them.
    ///
    /// Implemented as a blit, which converts channel orders; unscaled copies between equal formats keep their bits.
    pub(in crate::gpu) fn show(
        &mut self,
        picture: &mut Image,
        shown: &mut WindowImage,
        regions: &[CopyRegion],
        filter: CopyFilter,
    ) {
        let (from, to) = (picture.extent(0), shown.extent);
        let regions: Vec<CopyRegion> = regions.iter().filter_map(|region| region.within(from, to)).collect();
        let whole = [[0, 0], to.map(|n| n as i32)];
        if regions.iter().all(|region| region.to != whole) {
            self.clear_shown(shown);
        }
        if regions.is_empty() {
            return;
        }
        let layers = (0..shown.layers).map(|layer| (layer.min(picture.layers() - 1), layer));
        let blits: Vec<vk::ImageBlit> =
            layers.flat_map(|(from, to)| regions.iter().map(move |region| region.blit(from, to))).collect();
        self.access_levels(picture, 0..1, Access::TransferRead);
        self.access_shown(shown.raw, &mut shown.access, Access::TransferWrite);
        // SAFETY: the rectangles lie within both images, whose layouts were set above.
        unsafe {
            self.gpu.device.cmd_blit_image(
                self.raw,
                picture.raw,
                Access::TransferRead.layout(),
                shown.raw,
                Access::TransferWrite.layout(),
                &blits,
                filter.raw(),
            );
        }
    }

    /// Fills the whole image with the background.
    pub(in crate::gpu) fn clear_shown(&mut self, shown: &mut WindowImage) {
        self.access_shown(shown.raw, &mut shown.access, Access::TransferWrite);
        // SAFETY: the image can be copied to and is in this layout.
        unsafe {
            self.gpu.device.cmd_clear_color_image(
                self.raw,
                shown.raw,
                Access::TransferWrite.layout(),
                &BACKGROUND,
                &[levels(0, 1)],
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::gpu::commands::copies::{Region, read_image};
    use crate::gpu::device::options::GpuOptions;
    use crate::gpu::device::physical::DeviceChoice;
    use crate::gpu::resources::buffer::{Buffer, BufferUse};
    use crate::gpu::resources::image::TexelFormat;

    use super::*;

    /// Pictures are copied bit-identically to images of their own format, whatever that is; the rest is background.
    #[test]
    fn every_output_is_shown_bit_by_bit() {
        let options = GpuOptions { validation: true, ..GpuOptions::default() };
        let gpu = Gpu::with_options(&DeviceChoice::Best, options).expect("a device with validation");
        let (from, to) = ([37, 21], [40, 30]);
        for (format, shown_as, background) in [
            (TexelFormat::Rgba8, TexelFormat::Rgba8, 0xff00_0000_u64),
            (TexelFormat::Rgb10A2, TexelFormat::Rgb10A2, 0xc000_0000),
            (TexelFormat::Rgb10A2, TexelFormat::Bgr10A2, 0xc000_0000),
            (TexelFormat::Rgba16F, TexelFormat::Rgba16F, 0x3c00 << 48),
        ] {
            let query = |format: TexelFormat| {
                // SAFETY: plain query.
                let properties = unsafe {
                    gpu.instance.raw.get_physical_device_format_properties(gpu.physical, format.raw())
                };
                properties.optimal_tiling_features
            };
            // lavapipe cannot blit into the second 10-bit channel order, so no window gets it there.
            if !query(shown_as).contains(vk::FormatFeatureFlags::BLIT_DST) {
                assert_eq!(shown_as, TexelFormat::Bgr10A2);
                continue;
            }
            let image = |name, format, extent| Image::new(&gpu, name, format, extent).expect(name);
            let (mut picture, mut window) = (image("picture", format, from), image("window", shown_as, to));
            let size = format.bytes();
            let mut buffer =
                Buffer::new(&gpu, "texels", BufferUse::Upload, size * 37 * 21).expect("a buffer");
            for (i, byte) in buffer.mapped_mut().iter_mut().enumerate() {
                // Half floats must be normal numbers: the exponent, in the odd bytes, is bounded.
                let noise = (i as u32).wrapping_mul(2_654_435_761).rotate_left(9) as u8;
                *byte = if format == TexelFormat::Rgba16F && i % 2 == 1 { 16 + noise % 64 } else { noise };
            }
            let mut texels = buffer.mapped().to_vec();
            let mut frame = gpu.begin().expect("a frame");
            let mut cmd = frame.cmd();
            cmd.copy_from_buffers(&[&buffer], &mut picture);
            let mut shown = WindowImage::of(&window);
            cmd.show(&mut picture, &mut shown, &[CopyRegion::whole(from)], CopyFilter::Nearest);
            window.access[0] = shown.access;
            gpu.wait(frame.submit().expect("submit")).expect("wait");
            let read = read_image(&gpu, &mut window, 0, Region { origin: [0, 0], extent: to }).expect("read");
            if format != shown_as {
                // Swaps red and blue.
                for texel in texels.as_chunks_mut::<4>().0 {
                    let word = u32::from_le_bytes(*texel);
                    let (red, blue) = (word & 1023, word >> 20 & 1023);
                    *texel = (word & 0xc00f_fc00 | red << 20 | blue).to_le_bytes();
                }
            }
            for (i, texel) in read.chunks_exact(size).enumerate() {
                let (x, y) = (i % 40, i / 40);
                let at = (y * 37 + x) * size;
                let black = &background.to_le_bytes()[..size];
                let wanted = if x < 37 && y < 21 { &texels[at..at + size] } else { black };
                assert!(texel == wanted, "{format:?}: {texel:?} at {x}, {y} instead of {wanted:?}");
            }
        }
        assert!(gpu.validation_messages().is_empty(), "{:?}", gpu.validation_messages());
    }
}
