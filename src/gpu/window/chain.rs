//! One generation of a window's images: made anew whenever its size or its colours change.

use ash::{khr, vk};

use crate::gpu::device::Gpu;
use crate::gpu::error::{GpuError, Named};
use crate::gpu::window::surface::Surface;

/// What a chain is made for.
pub(in crate::gpu) struct ChainDesc {
    pub capabilities: vk::SurfaceCapabilitiesKHR,
    pub extent: [u32; 2],
    pub format: vk::SurfaceFormatKHR,
    pub mode: vk::PresentModeKHR,
    /// The generation before, or null.
    pub old: vk::SwapchainKHR,
}

/// One image of a window.
pub(in crate::gpu) struct ChainImage {
    pub raw: vk::Image,
    pub view: vk::ImageView,
    /// Signalled by the frame that has drawn it, waited for by showing it. It is free again when the image has been
    /// acquired the next time; a semaphore of a frame in flight would not be.
    pub drawn: vk::Semaphore,
}

/// A swapchain with its images.
pub(in crate::gpu) struct Chain {
    pub raw: vk::SwapchainKHR,
    pub images: Vec<ChainImage>,
    pub extent: [u32; 2],
    pub format: vk::Format,
    pub mode: vk::PresentModeKHR,
    /// An image of it was presented.
    pub shown: bool,
}

impl Chain {
    /// Makes the images; the old ones may be shown until they are destroyed, but not acquired any more.
    pub fn new(
        gpu: &Gpu,
        loader: &khr::swapchain::Device,
        surface: &Surface,
        desc: &ChainDesc,
    ) -> Result<Self, GpuError> {
        let limits = &desc.capabilities;
        // One to show, one to be shown next, one to draw.
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
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::COLOR_ATTACHMENT)
            .pre_transform(limits.current_transform)
            .composite_alpha(alpha)
            .present_mode(desc.mode)
            .clipped(true)
            .old_swapchain(desc.old);
        // SAFETY: all values are among those that the surface has offered; the old chain belongs to this surface.
        let raw = unsafe { loader.create_swapchain(&info, None) }.named("vkCreateSwapchainKHR")?;
        gpu.name(raw, "window");
        let (images, format) = (Vec::new(), desc.format.format);
        let mut chain = Chain { raw, images, extent: desc.extent, format, mode: desc.mode, shown: false };
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
            let info = vk::SemaphoreCreateInfo::default();
            // SAFETY: nothing is asked for that could be missing.
            let drawn = unsafe { gpu.device.create_semaphore(&info, None) }.named("vkCreateSemaphore")?;
            gpu.name(drawn, &format!("window image {i} drawn"));
            self.images.push(ChainImage { raw, view: vk::ImageView::null(), drawn });
            let info = vk::ImageViewCreateInfo::default()
                .image(raw)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(self.format)
                .subresource_range(WHOLE);
            // SAFETY: the image belongs to the chain and can be drawn into.
            let view = unsafe { gpu.device.create_image_view(&info, None) }
                .named(&format!("vkCreateImageView(window image {i})"))?;
            gpu.name(view, &format!("window image {i}"));
            if let Some(image) = self.images.last_mut() {
                image.view = view;
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
                gpu.device.destroy_image_view(image.view, None);
                gpu.device.destroy_semaphore(image.drawn, None);
            }
            loader.destroy_swapchain(self.raw, None);
        }
    }
}

/// The only level and layer of a window's image.
pub(in crate::gpu) const WHOLE: vk::ImageSubresourceRange = vk::ImageSubresourceRange {
    aspect_mask: vk::ImageAspectFlags::COLOR,
    base_mip_level: 0,
    level_count: 1,
    base_array_layer: 0,
    layer_count: 1,
};
