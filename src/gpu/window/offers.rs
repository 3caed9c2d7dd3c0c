//! Optional window features of some devices beyond the swapchain: presentation times, and mastering metadata.

use std::collections::VecDeque;

use ash::{ext, khr, vk};

use crate::gpu::device::gpu::{FrameNumber, Gpu};

/// Tracks when frames are presented (`VK_KHR_present_wait`).
pub(in crate::gpu) struct PresentWait {
    loader: khr::present_wait::Device,
    /// Presented images not displayed yet, with their present ids.
    pending: VecDeque<(u64, FrameNumber)>,
    shown: FrameNumber,
}

impl PresentWait {
    /// For a device opened with the extension.
    pub fn new(gpu: &Gpu) -> Self {
        let loader = khr::present_wait::Device::new(&gpu.instance.raw, &gpu.device);
        Self { loader, pending: VecDeque::new(), shown: FrameNumber::default() }
    }

    /// Records a frame presented with this id; ids increase monotonically.
    pub fn presented(&mut self, id: u64, frame: FrameNumber) {
        self.pending.push_back((id, frame));
    }

    /// Discards the pending images of a swapchain that is being recreated, since their presentation can no longer be queried.
    pub fn leave(&mut self) {
        if let Some((_, frame)) = self.pending.drain(..).next_back() {
            self.shown = frame;
        }
    }

    /// The last frame that was displayed, or never will be; never blocks.
    pub fn shown(&mut self, chain: vk::SwapchainKHR) -> FrameNumber {
        while let Some((id, frame)) = self.pending.front() {
            // SAFETY: the feature is enabled, and an image of this swapchain was presented with this number.
            if unsafe { self.loader.wait_for_present(chain, *id, 0) } == Err(vk::Result::TIMEOUT) {
                break;
            }
            self.shown = *frame;
            self.pending.pop_front();
        }
        self.shown
    }
}

/// Sets the mastering metadata of the picture for the display (`VK_EXT_hdr_metadata`).
pub(in crate::gpu) struct HdrMetadata(ext::hdr_metadata::Device);

impl HdrMetadata {
    /// For a device opened with the extension.
    pub fn new(gpu: &Gpu) -> Self {
        Self(ext::hdr_metadata::Device::new(&gpu.instance.raw, &gpu.device))
    }

    /// The colours of the images are those of Rec.2020 (ITU-R BT.2020, white D65), up to a luminance of `peak` cd/m².
    pub fn set(&self, chain: vk::SwapchainKHR, peak: f32) {
        let xy = |x, y| vk::XYColorEXT { x, y };
        let metadata = vk::HdrMetadataEXT::default()
            .display_primary_red(xy(0.708, 0.292))
            .display_primary_green(xy(0.170, 0.797))
            .display_primary_blue(xy(0.131, 0.046))
            .white_point(xy(0.3127, 0.3290))
            .max_luminance(peak)
            // The mean luminance of a frame is unknown.
            .max_content_light_level(peak);
        // SAFETY: the extension is enabled, and the swapchain belongs to this device.
        unsafe { self.0.set_hdr_metadata(&[chain], &[metadata]) };
    }
}
