//! A window's surface: which devices can present images in it, and in which formats.

use std::sync::Arc;

use ash::{khr, vk};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use crate::gpu::device::faults::{CallFaults, DeviceCall};
use crate::gpu::device::instance::VulkanInstance;
use crate::gpu::device::physical::{DeviceChoice, PhysicalDevice, enumerate, names, pick};
use crate::gpu::error::{GpuError, Named};

/// A window and the connection to its display.
pub(in crate::gpu) type WindowHandles = (RawDisplayHandle, RawWindowHandle);

/// The encoding of colours in the picture and in the window's images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, clap::ValueEnum)]
pub enum ColorOutput {
    /// 8 bits, gamma-encoded.
    #[default]
    Sdr,
    /// Linear extended sRGB in half floats, 1.0 = 80 cd/m².
    #[value(name = "scrgb")]
    ScRgb,
    /// Rec.2020 with the PQ transfer, 10 bits.
    Hdr10,
}

impl ColorOutput {
    /// All outputs.
    pub(in crate::gpu) const ALL: [Self; 3] = [Self::Sdr, Self::ScRgb, Self::Hdr10];

    /// Colour space and texel formats, preferred one first.
    fn encodings(self) -> (vk::ColorSpaceKHR, &'static [vk::Format]) {
        match self {
            // Channel order does not matter, since a blit converts it.
            Self::Sdr => (
                vk::ColorSpaceKHR::SRGB_NONLINEAR,
                &[vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_UNORM, vk::Format::A8B8G8R8_UNORM_PACK32],
            ),
            Self::ScRgb => (vk::ColorSpaceKHR::EXTENDED_SRGB_LINEAR_EXT, &[vk::Format::R16G16B16A16_SFLOAT]),
            Self::Hdr10 => (
                vk::ColorSpaceKHR::HDR10_ST2084_EXT,
                &[vk::Format::A2B10G10R10_UNORM_PACK32, vk::Format::A2R10G10B10_UNORM_PACK32],
            ),
        }
    }
}

/// Owns a window's surface. The window itself must outlive it.
pub(in crate::gpu) struct Surface {
    pub raw: vk::SurfaceKHR,
    loader: khr::surface::Instance,
    instance: Arc<VulkanInstance>,
}

impl Surface {
    /// Creates the surface of a window.
    pub fn new(
        instance: &Arc<VulkanInstance>,
        (display, window): WindowHandles,
        faults: &CallFaults,
    ) -> Result<Self, GpuError> {
        faults.check(DeviceCall::Surface).named("vkCreateSurfaceKHR")?;
        // SAFETY: the handles belong to a live window, as `Swapchain::open` demands; the instance, which this surface
        // keeps alive, was made with the extensions of this display.
        let raw =
            unsafe { ash_window::create_surface(&instance.entry, &instance.raw, display, window, None) }
                .named("vkCreateSurfaceKHR")?;
        let loader = khr::surface::Instance::new(&instance.entry, &instance.raw);
        Ok(Self { raw, loader, instance: instance.clone() })
    }

    /// The selected device, among those that can present to this surface.
    pub fn pick(&self, choice: &DeviceChoice) -> Result<PhysicalDevice, GpuError> {
        let mut devices = enumerate(&self.instance)?;
        let mut any = false;
        for device in &mut devices {
            let (raw, missing) = (device.raw, device.info.missing.len());
            device.check_window(|family| self.is_shown_by(raw, family));
            any |= device.info.missing.len() == missing;
        }
        if !any {
            let why = "none of the devices can show pictures in it; there are:";
            return Err(GpuError::NoWindow(format!("{why} {}", names(&devices))));
        }
        pick(devices, choice)
    }

    /// Whether queues of this family can present to this surface.
    pub fn is_shown_by(&self, device: vk::PhysicalDevice, family: u32) -> bool {
        // SAFETY: device and surface belong to this instance, and the family exists.
        unsafe { self.loader.get_physical_device_surface_support(device, family, self.raw) }.unwrap_or(false)
    }

    /// Present limits of sizes and uses of the surface.
    pub fn capabilities(&self, device: vk::PhysicalDevice) -> Result<vk::SurfaceCapabilitiesKHR, vk::Result> {
        // SAFETY: device and surface belong to this instance.
        unsafe { self.loader.get_physical_device_surface_capabilities(device, self.raw) }
    }

    /// The format of each output that the surface offers.
    pub fn formats(
        &self,
        device: vk::PhysicalDevice,
    ) -> Result<Vec<(ColorOutput, vk::SurfaceFormatKHR)>, vk::Result> {
        // SAFETY: as above.
        let offered = unsafe { self.loader.get_physical_device_surface_formats(device, self.raw) }?;
        let find = |output: ColorOutput| {
            let (space, formats) = output.encodings();
            let mut wanted = formats.iter().filter(|f| self.can_be_filled(device, **f));
            wanted.find_map(|f| offered.iter().find(|o| o.format == *f && o.color_space == space))
        };
        Ok(ColorOutput::ALL.into_iter().filter_map(|output| find(output).map(|f| (output, *f))).collect())
    }

    /// Whether images of this format can be rendered to and blitted into.
    fn can_be_filled(&self, device: vk::PhysicalDevice, format: vk::Format) -> bool {
        use vk::FormatFeatureFlags as F;
        // SAFETY: plain query.
        let have = unsafe { self.instance.raw.get_physical_device_format_properties(device, format) };
        have.optimal_tiling_features.contains(F::BLIT_DST | F::COLOR_ATTACHMENT)
    }

    /// Mailbox, which neither blocks nor tears, if available; otherwise FIFO, which every surface supports.
    pub fn present_mode(&self, device: vk::PhysicalDevice) -> Result<vk::PresentModeKHR, vk::Result> {
        // SAFETY: as above.
        let offered = unsafe { self.loader.get_physical_device_surface_present_modes(device, self.raw) }?;
        let mailbox = vk::PresentModeKHR::MAILBOX;
        Ok(if offered.contains(&mailbox) { mailbox } else { vk::PresentModeKHR::FIFO })
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: `Swapchain` destroys what was made of it before.
        unsafe { self.loader.destroy_surface(self.raw, None) };
    }
}
