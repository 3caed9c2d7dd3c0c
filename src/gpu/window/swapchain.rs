//! A window's images. `acquire.rs` takes and shows them, `recreate.rs` makes them anew.

use std::sync::Arc;

use ash::{khr, vk};
use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use crate::gpu::commands::frame::Frame;
use crate::gpu::device::choice::DeviceChoice;
use crate::gpu::device::{Gpu, GpuOptions};
use crate::gpu::error::GpuError;
use crate::gpu::resources::image::Image;
use crate::gpu::window::acquire::Acquired;
use crate::gpu::window::chain::Chain;
use crate::gpu::window::recreate::Old;
use crate::gpu::window::surface::{ColorOutput, Surface};

/// What the surface says to an attempt to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Readiness {
    /// An image can be drawn.
    Ready,
    /// No image within the time given: try later.
    Busy,
    /// Minimised or without extent: nothing to draw into.
    Hidden,
    /// The surface is gone: make a new one with [`Swapchain::replace_surface`].
    SurfaceLost,
}

/// The images of one window. Recreates itself when out of date.
///
/// Resizing does not wait for the GPU: images of the old size live until the frames that use them have completed and
/// some of the new ones have been shown. Dropping it waits. The window must outlive it.
pub struct Swapchain {
    pub(in crate::gpu) gpu: Arc<Gpu>,
    pub(in crate::gpu) loader: khr::swapchain::Device,
    pub(in crate::gpu) surface: Surface,
    pub(in crate::gpu) chain: Option<Chain>,
    /// Earlier generations.
    pub(in crate::gpu) old: Vec<Old>,
    /// How many images were presented.
    pub(in crate::gpu) presents: u64,
    /// Semaphores to acquire with, each with the number of the frame that waits for it.
    pub(in crate::gpu) semaphores: Vec<(u64, vk::Semaphore)>,
    pub(in crate::gpu) acquired: Option<Acquired>,
    /// The extent that the window was said to have.
    pub(in crate::gpu) wanted: [u32; 2],
    pub(in crate::gpu) output: ColorOutput,
    pub(in crate::gpu) outputs: Vec<ColorOutput>,
    /// The chain does not fit the window any more.
    pub(in crate::gpu) stale: bool,
    pub(in crate::gpu) hidden: bool,
    pub(in crate::gpu) surface_lost: bool,
    /// What the next attempt to acquire answers, for tests.
    pub(in crate::gpu) planned: Option<vk::Result>,
}

impl Swapchain {
    /// Opens a device that can show pictures in this window, and the window's images. `extent` is the window's size in
    /// physical pixels, used where the window system leaves it to the program (Wayland).
    ///
    /// The handles must be those of a live window and of its connection, and both must outlive what is returned.
    ///
    /// # Errors
    ///
    /// As [`Gpu::with_options`], [`GpuError::NoWindow`] where no device can show pictures in this window, and
    /// [`GpuError::Call`] for surface and swapchain.
    pub fn open(
        choice: &DeviceChoice,
        options: GpuOptions,
        window: (RawDisplayHandle, RawWindowHandle),
        extent: [u32; 2],
    ) -> Result<Self, GpuError> {
        let (gpu, surface) = Gpu::for_window(choice, options, window)?;
        let mut swapchain = Self {
            loader: khr::swapchain::Device::new(&gpu.instance.raw, &gpu.device),
            gpu,
            surface,
            chain: None,
            old: Vec::new(),
            presents: 0,
            semaphores: Vec::new(),
            acquired: None,
            wanted: extent,
            output: ColorOutput::Sdr,
            outputs: Vec::new(),
            stale: false,
            hidden: false,
            surface_lost: false,
            planned: None,
        };
        swapchain.recreate()?;
        Ok(swapchain)
    }

    /// The device.
    pub fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }

    /// The window's extent in physical pixels, as it is drawn; `None` while hidden.
    pub fn extent(&self) -> Option<[u32; 2]> {
        self.chain.as_ref().filter(|_| !self.hidden).map(|chain| chain.extent)
    }

    /// What the window's colours are.
    pub fn output(&self) -> ColorOutput {
        self.output
    }

    /// The outputs that the surface offers.
    pub fn outputs(&self) -> Vec<ColorOutput> {
        self.outputs.clone()
    }

    /// How images follow each other on the screen: `mailbox` (the newest replaces one that waits) or `fifo` (one for
    /// each refresh).
    pub fn present_mode(&self) -> &'static str {
        match self.chain.as_ref().map(|chain| chain.mode) {
            Some(vk::PresentModeKHR::MAILBOX) => "mailbox",
            Some(_) => "fifo",
            None => "none",
        }
    }

    /// Format of the window's images; undefined before there are any.
    pub(in crate::gpu) fn format(&self) -> vk::Format {
        self.chain.as_ref().map_or(vk::Format::UNDEFINED, |chain| chain.format)
    }

    /// Asks for another output; takes effect with the next image. `false` where it is not offered.
    pub fn set_output(&mut self, output: ColorOutput) -> bool {
        let offered = self.outputs.contains(&output);
        if offered && self.output != output {
            self.output = output;
            self.stale = true;
        }
        offered
    }

    /// Says that the window has a new size.
    pub fn resize(&mut self, extent: [u32; 2]) {
        self.wanted = extent;
        self.stale |= self.chain.as_ref().is_none_or(|chain| chain.extent != extent);
    }

    /// Makes the next [`acquire`](Self::acquire) find the surface lost. For tests.
    pub fn lose_surface_once(&mut self) {
        self.planned = Some(vk::Result::ERROR_SURFACE_LOST_KHR);
    }

    /// Makes the next [`acquire`](Self::acquire) find the images out of date. For tests.
    pub fn outdate_once(&mut self) {
        self.planned = Some(vk::Result::ERROR_OUT_OF_DATE_KHR);
    }

    /// Copies `picture` into the acquired image, texel by texel from the left top, and clears what it does not cover.
    pub fn draw(&mut self, frame: &mut Frame<'_>, picture: &mut Image) {
        if let Some(acquired) = &mut self.acquired {
            acquired.claim(frame);
            frame.cmd().scope("show").show(picture, &mut acquired.shown);
        }
    }

    /// A new surface for the same window, after the old one was lost.
    ///
    /// # Errors
    ///
    /// As [`open`](Self::open).
    pub fn replace_surface(&mut self, window: (RawDisplayHandle, RawWindowHandle)) -> Result<(), GpuError> {
        self.clear();
        self.surface = Surface::new(&self.gpu.instance, window)?;
        if !self.surface.is_shown_by(self.gpu.physical, self.gpu.queue_family) {
            return Err(GpuError::NoWindow("this device cannot show pictures in it any more.".into()));
        }
        (self.surface_lost, self.stale) = (false, false);
        self.recreate()
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        self.clear();
    }
}
