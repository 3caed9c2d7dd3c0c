//! The window on its device: swapchain, film and the overlay of the panel, and how each is replaced when it is lost.

use std::sync::Arc;
use std::time::Duration;

use glam::Vec3;
use raw_window_handle::{HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle};
use winit::window::Window;

use crate::app::pipelines::PipelineKeeper;
use crate::app::view::light_mix::LightMix;
use crate::app::view::picture::regions::{Regions, per_pixel};
use crate::client::background::BackgroundPolicy;
use crate::client::film::VulkanFilm;
use crate::client::pass::glare::glare_detail;
use crate::client::window::host::PanelDrawing;
use crate::client::window::panel_renderer::PanelRenderer;
use crate::client::window::viewport::Viewport;
use crate::client::{ClientError, FilmSpec, Settings};
use crate::gpu::{DeviceChoice, DeviceKind, FrameNumber, Gpu, GpuError, GpuOptions, Readiness, Swapchain};
use crate::image::Grid;

/// Faults that are simulated, so that tests see what follows.
#[derive(Clone, Debug, Default)]
pub struct SimulatedLosses {
    /// Frames after which each device is lost; devices that are not listed stay.
    pub devices: Vec<u64>,
    /// Attempts to draw after which the surface is lost once.
    pub surface: Option<u64>,
    /// Bytes of device memory, where less than there is.
    pub memory: Option<u64>,
}

/// What a picture is composed of beside the film of all samples.
pub struct PictureParts<'a> {
    pub regions: &'a mut Regions,
    pub mix: &'a mut LightMix,
}

/// What a repaint shows.
#[derive(Clone, Copy)]
pub enum PictureSource<'a> {
    /// The film, at this `detail`.
    Film(u32),
    /// The mix of lights, at this `detail`.
    Mix(u32),
    /// A filtered picture, scene-linear XYZ.
    Filtered(&'a Grid<Vec3>),
}

/// The objects of one device; dropped from the top.
struct DeviceObjects {
    /// `None` once it was taken out for the files written at the end.
    film: Option<VulkanFilm>,
    swapchain: Swapchain,
    pipelines: PipelineKeeper,
}

/// The window, and the film and swapchain on the device that draws into it.
pub struct Screen {
    /// `None` after a device was lost for good.
    objects: Option<DeviceObjects>,
    overlay: Option<PanelRenderer>,
    choice: DeviceChoice,
    /// The window.
    pub window: Arc<Window>,
    /// The last frame that was handed over.
    last: FrameNumber,
    /// Losses still to be simulated.
    simulated: SimulatedLosses,
    /// The window shows what a headless render does, bit for bit.
    exact: bool,
    /// Number of devices that were lost.
    pub device_losses: u32,
    /// Number of surfaces that were lost.
    pub surface_losses: u32,
    /// Messages of the validation layer on devices that are gone.
    messages: usize,
}

impl Screen {
    /// Opens a device for this window and makes a film of its size. `exact`: the window shows what a headless render does, bit
    /// for bit.
    pub fn open(
        window: Arc<Window>,
        choice: &DeviceChoice,
        simulated: &SimulatedLosses,
        spec: FilmSpec,
        exact: bool,
    ) -> Result<Self, ClientError> {
        let mut screen = Self {
            objects: None,
            overlay: None,
            choice: choice.clone(),
            window,
            last: FrameNumber::default(),
            simulated: simulated.clone(),
            exact,
            device_losses: 0,
            surface_losses: 0,
            messages: 0,
        };
        screen.objects = Some(screen.make(spec)?);
        Ok(screen)
    }

    fn make(&self, spec: FilmSpec) -> Result<DeviceObjects, ClientError> {
        let size = self.window.inner_size();
        let extent = [size.width, size.height];
        let swapchain = Swapchain::open(&self.choice, GpuOptions::from_env(), self.handles()?, extent)?;
        swapchain.gpu().set_timing(true);
        if let Some(frames) = self.simulated.devices.get(self.device_losses as usize) {
            swapchain.gpu().lose_after(*frames);
        }
        if let Some(bytes) = self.simulated.memory {
            swapchain.gpu().limit_memory(bytes);
        }
        let pipelines = PipelineKeeper::new(swapchain.gpu().clone());
        let film = Some(new_film(swapchain.gpu(), spec, self.exact)?);
        Ok(DeviceObjects { film, swapchain, pipelines })
    }

    fn handles(&self) -> Result<(RawDisplayHandle, RawWindowHandle), GpuError> {
        let gone =
            |e: raw_window_handle::HandleError| GpuError::NoWindow(format!("the window system says: {e}"));
        let display = self.window.display_handle().map_err(gone)?.as_raw();
        Ok((display, self.window.window_handle().map_err(gone)?.as_raw()))
    }

    /// Replaces the device that was lost, and makes an empty film on the new one. On an error there is no film
    /// afterwards.
    pub fn replace_device(&mut self, spec: FilmSpec) -> Result<(), ClientError> {
        self.messages += self.gpu().map_or(0, |gpu| gpu.validation_messages().len());
        // Before the new one: a window has one swapchain at a time.
        self.objects = None;
        self.last = FrameNumber::default();
        self.objects = Some(self.make(spec)?);
        Ok(())
    }

    /// Replaces the surface of the window.
    pub fn replace_surface(&mut self) -> Result<(), ClientError> {
        self.surface_losses += 1;
        let handles = self.handles()?;
        match &mut self.objects {
            Some(objects) => Ok(objects.swapchain.replace_surface(handles)?),
            None => Ok(()),
        }
    }

    /// Replaces the film by an empty one on the same device. On an error the old one stays. The images of the old one are freed
    /// first, if the device has finished with them: few devices have room for both.
    pub fn replace_film(&mut self, spec: FilmSpec) -> Result<(), ClientError> {
        if let Some(objects) = &mut self.objects {
            let gpu = objects.swapchain.gpu();
            objects.film = Some(new_film(gpu, spec, self.exact)?);
            gpu.free_retired()?;
        }
        Ok(())
    }

    /// Another film on the same device.
    ///
    /// # Errors
    ///
    /// Without a device, and those of a film.
    pub fn new_film(&self, spec: FilmSpec) -> Result<VulkanFilm, ClientError> {
        let gpu = self.gpu().ok_or_else(|| GpuError::NoWindow("its device was lost".to_owned()))?;
        new_film(gpu, spec, self.exact)
    }

    /// Extent of the window's images, pixels.
    pub fn extent(&self) -> Option<[u32; 2]> {
        self.objects.as_ref().and_then(|objects| objects.swapchain.extent())
    }

    /// The film; `None` before there is a device, once it was taken, and after the device was lost for good.
    pub fn film(&self) -> Option<&VulkanFilm> {
        self.objects.as_ref().and_then(|objects| objects.film.as_ref())
    }

    /// As [`film`](Self::film), to be changed.
    pub fn film_mut(&mut self) -> Option<&mut VulkanFilm> {
        self.objects.as_mut().and_then(|objects| objects.film.as_mut())
    }

    /// Takes the film out, for the files written at the end.
    pub fn take_film(&mut self) -> Option<VulkanFilm> {
        self.objects.as_mut().and_then(|objects| objects.film.take())
    }

    /// The window's images.
    pub fn swapchain(&mut self) -> Option<&mut Swapchain> {
        self.objects.as_mut().map(|objects| &mut objects.swapchain)
    }

    /// The device.
    pub fn gpu(&self) -> Option<&Arc<Gpu>> {
        self.objects.as_ref().map(|objects| objects.swapchain.gpu())
    }

    /// Messages of the validation layer so far, on all devices.
    pub fn validation_messages(&self) -> usize {
        self.messages + self.gpu().map_or(0, |gpu| gpu.validation_messages().len())
    }

    /// True when the device has done everything it was given.
    pub fn is_idle(&self) -> bool {
        let last = self.film().map_or(self.last, |film| film.rasterised().max(self.last));
        self.gpu().is_none_or(|gpu| gpu.has_completed(last))
    }

    /// Asks for an image to draw into, without waiting; says its extent.
    pub fn acquire(&mut self) -> Result<(Readiness, Option<[u32; 2]>), ClientError> {
        let Some(objects) = &mut self.objects else { return Ok((Readiness::Hidden, None)) };
        match &mut self.simulated.surface {
            Some(0) => {
                self.simulated.surface = None;
                objects.swapchain.lose_surface_once();
            }
            Some(left) => *left -= 1,
            None => {}
        }
        let readiness = objects.swapchain.acquire(Duration::ZERO)?;
        Ok((readiness, objects.swapchain.extent()))
    }

    /// Draws the picture with its regions as the viewport says and over it the panel into the acquired image, and shows it. Without a `repaint`
    /// the picture is the one painted last. Returns the frame's number.
    pub fn show(
        &mut self,
        settings: &Settings,
        repaint: Option<PictureSource<'_>>,
        parts: PictureParts<'_>,
        viewport: &Viewport,
        panel: Option<&mut PanelDrawing>,
    ) -> Result<FrameNumber, ClientError> {
        let Some(DeviceObjects { film: Some(film), swapchain, pipelines }) = &mut self.objects else {
            return Ok(self.last);
        };
        let gpu = swapchain.gpu().clone();
        let mut frame = gpu.begin()?;
        let picture = match repaint {
            Some(source) => {
                let detail = match source {
                    PictureSource::Film(detail) | PictureSource::Mix(detail) => detail,
                    PictureSource::Filtered(_) => 1,
                };
                // Regions and lights are drawn at the resolution of the picture that they are part of.
                let extent = [film.spec().width, film.spec().height];
                let detail = settings.glare.map_or(detail, |_| detail.max(glare_detail(&gpu, extent)));
                let cmd = &mut frame.cmd();
                let mut regions = parts.regions.record(cmd, settings, detail, per_pixel(film))?;
                Some(match source {
                    PictureSource::Film(_) => film.paint(cmd, settings, detail, &mut regions)?,
                    PictureSource::Mix(_) => {
                        let mut layers = parts.mix.record(cmd, settings, detail)?;
                        film.paint_sum(cmd, settings, detail, &mut layers)?
                    }
                    PictureSource::Filtered(picture) => {
                        film.paint_filtered(cmd, picture, settings, &mut regions)?
                    }
                })
            }
            None => film.painted(),
        };
        if let Some(picture) = picture {
            let copies = viewport.copies(swapchain.extent().unwrap_or_default());
            swapchain.draw(&mut frame, picture, &copies);
        }
        if let Some(panel) = panel {
            let overlay = match &mut self.overlay {
                Some(overlay) => overlay,
                empty => empty.insert(PanelRenderer::new(swapchain)?),
            };
            let textures = std::mem::take(&mut panel.textures);
            overlay.draw(swapchain, &mut frame, textures, &panel.primitives, panel.pixels_per_point)?;
        }
        self.window.pre_present_notify();
        self.last = swapchain.present(frame)?;
        pipelines.tick();
        Ok(self.last)
    }
}

/// A film that does not let the window stand still.
fn new_film(gpu: &Arc<Gpu>, spec: FilmSpec, exact: bool) -> Result<VulkanFilm, ClientError> {
    // Where the device is the processor, glare at full resolution takes longer than a frame may, and its passes draw samples slowly.
    let hurry = gpu.info().kind == DeviceKind::Cpu && !exact;
    let make = if hurry { VulkanFilm::summed_on_host } else { VulkanFilm::new };
    let mut film = make(gpu.clone(), spec)?;
    film.set_background_policy(if hurry {
        BackgroundPolicy::BackgroundCoarse
    } else {
        BackgroundPolicy::Background
    });
    Ok(film)
}

/// True when a new device may help.
pub fn is_device_lost(error: &ClientError) -> bool {
    matches!(error, ClientError::Gpu(gpu) if gpu.is_device_lost())
}
