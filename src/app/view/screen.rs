//! The device's side of the window: swapchain, film and panel drawing, and what is done when one of them is lost.

use std::sync::Arc;
use std::time::Duration;

use raw_window_handle::{HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle};
use winit::window::Window;

use crate::app::view::viewer::Plan;
use crate::client::film::VulkanFilm;
use crate::client::later::Patience;
use crate::client::{ClientError, FilmSpec, Settings};
use crate::gpu::{
    DeviceChoice, DeviceKind, FrameNumber, Gpu, GpuError, GpuOptions, Overlay, Readiness, Swapchain,
};

/// What egui wants drawn.
#[derive(Default)]
pub struct Triangles {
    /// Changes of textures that have not been handed over yet.
    pub textures: egui::TexturesDelta,
    /// Triangles of the last run, in points.
    pub primitives: Vec<egui::ClippedPrimitive>,
    /// Physical pixels per point.
    pub pixels_per_point: f32,
}

/// What is to be lost on purpose, so that tests see what follows.
#[derive(Clone, Debug, Default)]
pub struct Losses {
    /// Frames that each device lives; devices that are not listed live on.
    pub devices: Vec<u64>,
    /// The surface is lost once after this many attempts to draw.
    pub surface: Option<u64>,
}

/// What is made for one device; dropped from the top.
struct Parts {
    /// Taken out at the end.
    film: Option<VulkanFilm>,
    swapchain: Swapchain,
}

/// The window and all that draws into it.
pub struct Screen {
    parts: Option<Parts>,
    overlay: Option<Overlay>,
    choice: DeviceChoice,
    window: Arc<Window>,
    /// The last frame that was handed over.
    last: FrameNumber,
    /// What is still to be lost on purpose.
    planned: Losses,
    /// The window shows what a headless render does, bit for bit.
    exact: bool,
    /// Devices and surfaces lost.
    pub losses: [u32; 2],
    /// What the validation layer has said on devices that are gone.
    messages: usize,
}

impl Screen {
    /// Opens a device for this window and makes a film of its size.
    ///
    /// # Errors
    ///
    /// When no device can show pictures in this window, or the film does not fit.
    pub fn open(window: Arc<Window>, plan: &Plan, spec: FilmSpec) -> Result<Self, ClientError> {
        let mut screen = Self {
            parts: None,
            overlay: None,
            choice: plan.choice.clone(),
            window,
            last: FrameNumber::default(),
            planned: plan.losses.clone(),
            exact: plan.run.deterministic,
            losses: [0; 2],
            messages: 0,
        };
        screen.parts = Some(screen.make(spec)?);
        Ok(screen)
    }

    fn make(&self, spec: FilmSpec) -> Result<Parts, ClientError> {
        let size = self.window.inner_size();
        let extent = [size.width, size.height];
        let swapchain = Swapchain::open(&self.choice, GpuOptions::from_env(), self.handles()?, extent)?;
        swapchain.gpu().set_timing(true);
        if let Some(frames) = self.planned.devices.get(self.losses[0] as usize) {
            swapchain.gpu().lose_after(*frames);
        }
        let film = Some(new_film(swapchain.gpu(), spec, self.exact)?);
        Ok(Parts { film, swapchain })
    }

    fn handles(&self) -> Result<(RawDisplayHandle, RawWindowHandle), GpuError> {
        let gone =
            |e: raw_window_handle::HandleError| GpuError::NoWindow(format!("the window system says: {e}"));
        let display = self.window.display_handle().map_err(gone)?.as_raw();
        Ok((display, self.window.window_handle().map_err(gone)?.as_raw()))
    }

    /// The device was lost: a new one, and an empty film of the same kind on it.
    ///
    /// # Errors
    ///
    /// As [`open`](Self::open). There is no film afterwards.
    pub fn replace_device(&mut self, spec: FilmSpec) -> Result<(), ClientError> {
        self.losses[0] += 1;
        self.messages += self.gpu().map_or(0, |gpu| gpu.validation_messages().len());
        // Before the new one: a window has one swapchain at a time.
        self.parts = None;
        self.last = FrameNumber::default();
        self.parts = Some(self.make(spec)?);
        Ok(())
    }

    /// A new surface for the same window.
    ///
    /// # Errors
    ///
    /// As [`Swapchain::replace_surface`].
    pub fn replace_surface(&mut self) -> Result<(), ClientError> {
        self.losses[1] += 1;
        let handles = self.handles()?;
        match &mut self.parts {
            Some(parts) => Ok(parts.swapchain.replace_surface(handles)?),
            None => Ok(()),
        }
    }

    /// Another film on the same device, empty.
    ///
    /// # Errors
    ///
    /// When it does not fit; the old one stays.
    pub fn replace_film(&mut self, spec: FilmSpec) -> Result<(), ClientError> {
        if let Some(parts) = &mut self.parts {
            parts.film = Some(new_film(parts.swapchain.gpu(), spec, self.exact)?);
        }
        Ok(())
    }

    /// The film; `None` after a device was lost for good.
    pub fn film(&mut self) -> Option<&mut VulkanFilm> {
        self.parts.as_mut().and_then(|parts| parts.film.as_mut())
    }

    /// Takes the film out, for the end.
    pub fn take_film(&mut self) -> Option<VulkanFilm> {
        self.parts.as_mut().and_then(|parts| parts.film.take())
    }

    /// The window's images.
    pub fn swapchain(&mut self) -> Option<&mut Swapchain> {
        self.parts.as_mut().map(|parts| &mut parts.swapchain)
    }

    /// The device.
    pub fn gpu(&self) -> Option<&Arc<Gpu>> {
        self.parts.as_ref().map(|parts| parts.swapchain.gpu())
    }

    /// The window.
    pub fn window(&self) -> &Arc<Window> {
        &self.window
    }

    /// What the validation layer has said so far, on all devices.
    pub fn validation_messages(&self) -> usize {
        self.messages + self.gpu().map_or(0, |gpu| gpu.validation_messages().len())
    }

    /// True when the device has done everything it was given.
    pub fn is_idle(&self) -> bool {
        let film = self.parts.as_ref().and_then(|parts| parts.film.as_ref());
        let last = film.map_or(self.last, |film| film.rasterised().max(self.last));
        self.gpu().is_none_or(|gpu| gpu.has_completed(last))
    }

    /// Number of the last frame that was handed over.
    pub fn last(&self) -> FrameNumber {
        self.last
    }

    /// Asks for an image to draw into, without waiting; says its extent.
    ///
    /// # Errors
    ///
    /// As [`Swapchain::acquire`].
    pub fn acquire(&mut self) -> Result<(Readiness, Option<[u32; 2]>), ClientError> {
        let Some(parts) = &mut self.parts else { return Ok((Readiness::Hidden, None)) };
        match &mut self.planned.surface {
            Some(0) => {
                self.planned.surface = None;
                parts.swapchain.lose_surface_once();
            }
            Some(left) => *left -= 1,
            None => {}
        }
        let readiness = parts.swapchain.acquire(Duration::ZERO)?;
        Ok((readiness, parts.swapchain.extent()))
    }

    /// Rasterises the film's batch.
    ///
    /// # Errors
    ///
    /// As [`VulkanFilm::flush`].
    pub fn flush(&mut self) -> Result<(), ClientError> {
        self.film().map_or(Ok(()), VulkanFilm::flush)
    }

    /// Draws the picture and over it the panel into the acquired image, and shows it. `repaint` is the `detail` of a repaint;
    /// without one the picture is the one painted last.
    ///
    /// # Errors
    ///
    /// As [`VulkanFilm::paint`], [`Overlay::draw`] and [`Swapchain::present`].
    pub fn show(
        &mut self,
        settings: &Settings,
        repaint: Option<u32>,
        panel: Option<&mut Triangles>,
    ) -> Result<(), ClientError> {
        let Some(Parts { film: Some(film), swapchain }) = &mut self.parts else { return Ok(()) };
        let gpu = swapchain.gpu().clone();
        let mut frame = gpu.begin()?;
        let picture = match repaint {
            Some(detail) => Some(film.paint(&mut frame.cmd(), settings, detail)?),
            None => film.painted(),
        };
        if let Some(picture) = picture {
            swapchain.draw(&mut frame, picture);
        }
        if let Some(panel) = panel {
            let overlay = match &mut self.overlay {
                Some(overlay) => overlay,
                empty => empty.insert(Overlay::new(swapchain)?),
            };
            let textures = std::mem::take(&mut panel.textures);
            overlay.draw(swapchain, &mut frame, textures, &panel.primitives, panel.pixels_per_point)?;
        }
        self.window.pre_present_notify();
        self.last = swapchain.present(frame)?;
        Ok(())
    }
}

/// A film that does not let the window stand still.
fn new_film(gpu: &Arc<Gpu>, spec: FilmSpec, exact: bool) -> Result<VulkanFilm, ClientError> {
    let mut film = VulkanFilm::new(gpu.clone(), spec)?;
    // Where the device is the processor, glare at full resolution takes longer than a frame may.
    let hurry = gpu.info().kind == DeviceKind::Cpu && !exact;
    film.set_patience(if hurry { Patience::Hurry } else { Patience::Ask });
    Ok(film)
}

/// True when a new device may help.
pub fn is_device_lost(error: &ClientError) -> bool {
    matches!(error, ClientError::Gpu(gpu) if gpu.is_device_lost())
}
