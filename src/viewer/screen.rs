//! The window on its device: swapchain, film and the overlay of the panel, and how each is replaced when it is lost.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;
use raw_window_handle::{HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle};
use winit::window::Window;

use crate::client::background::BackgroundPolicy;
use crate::client::film::VulkanFilm;
use crate::client::memory::film_memory;
use crate::client::pass::glare::glare_detail;
use crate::client::window::host::PanelDrawing;
use crate::client::window::panel_renderer::PanelRenderer;
use crate::client::window::viewport::Viewport;
use crate::client::{ClientError, Film, FilmSpec, Settings};
use crate::gpu::{
    CallFaults, DeviceChoice, FrameNumber, Gpu, GpuError, GpuFrame, GpuOptions, Readiness, Swapchain,
};
use crate::image::Grid;
use crate::render::pipelines::PipelineKeeper;
use crate::render::process::tell;
use crate::viewer::clock::Backoff;
use crate::viewer::light_mix::LightMix;
use crate::viewer::picture::regions::{Regions, per_pixel};

/// How soon another image is asked for where there is none yet.
const SOON: Duration = Duration::from_millis(1);

/// A device has lasted when it has worked for this long, or has been given so many frames.
const LASTING: (Duration, u64) = (Duration::from_secs(10), 480);

/// Devices in a row that may be lost before they have lasted.
const MOST_LOSSES: u32 = 1;

/// How long a device that has been lost is waited for, and the first one.
const REOPENING: Duration = Duration::from_secs(30);
const OPENING: Duration = Duration::from_secs(5);

/// Faults that are simulated, so that tests see what follows.
#[derive(Clone, Debug, Default)]
pub struct SimulatedLosses {
    /// Frames after which each device is lost; devices that are not listed stay.
    pub devices: Vec<u64>,
    /// Results of calls.
    pub calls: CallFaults,
    /// Bytes of device memory, where less than there is.
    pub memory: Option<u64>,
}

/// What there is to draw into.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Canvas {
    /// An image of this extent.
    Ready([u32; 2]),
    /// Nothing while the window is hidden, or without a device.
    Hidden,
    /// Nothing yet: ask again then.
    Later(Instant),
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
    /// `None` while there is no device.
    objects: Option<DeviceObjects>,
    /// The film of a device that was lost, where its sums are in memory.
    rescued: Option<VulkanFilm>,
    overlay: Option<PanelRenderer>,
    choice: DeviceChoice,
    /// The window.
    pub window: Arc<Window>,
    /// The last frame that was handed over, and the last one before the present frame of the loop.
    last: FrameNumber,
    before: FrameNumber,
    /// Losses still to be simulated.
    simulated: SimulatedLosses,
    /// The window shows what a headless render does, bit for bit.
    exact: bool,
    /// Number of devices that were lost.
    pub device_losses: u32,
    /// Number of surfaces that were lost.
    pub surface_losses: u32,
    /// Devices that were lost one after the other before they had lasted.
    losses_in_a_row: u32,
    /// When the device was opened.
    opened: Instant,
    /// Attempts at opening a device, at images of the window, and at drawing the panel.
    opening: Backoff,
    presenting: Backoff,
    overlaying: Backoff,
    /// Pixels along a side of the grid that glare fits.
    glare_grid: u32,
    /// What the user is to be told.
    news: Vec<String>,
    /// Messages of the validation layer on devices that are gone.
    messages: usize,
}

impl Screen {
    /// Opens a device for this window and makes a film on it. `exact`: the window shows what a headless render does, bit
    /// for bit. Where that fails for a reason that may pass, [`reopen`](Self::reopen) tries it again.
    pub fn open(
        window: Arc<Window>,
        choice: &DeviceChoice,
        simulated: &SimulatedLosses,
        spec: FilmSpec,
        exact: bool,
    ) -> Result<Self, ClientError> {
        let mut screen = Self {
            objects: None,
            rescued: None,
            overlay: None,
            choice: choice.clone(),
            window,
            last: FrameNumber::default(),
            before: FrameNumber::default(),
            simulated: simulated.clone(),
            exact,
            device_losses: 0,
            surface_losses: 0,
            losses_in_a_row: 0,
            opened: Instant::now(),
            opening: Backoff::default(),
            presenting: Backoff::default(),
            overlaying: Backoff::default(),
            glare_grid: 1,
            news: Vec::new(),
            messages: 0,
        };
        screen.reopen(spec)?;
        Ok(screen)
    }

    /// Opens a device where there is none, with an empty film or that of the last device if its sums are in memory, once it is time to
    /// try. Returns whether there is a new one.
    ///
    /// # Errors
    ///
    /// That of the last attempt, when it does not pass.
    pub fn reopen(&mut self, spec: FilmSpec) -> Result<bool, ClientError> {
        let now = Instant::now();
        if self.objects.is_some() || !self.opening.is_due(now) {
            return Ok(false);
        }
        let error = match self.make(spec) {
            Ok(objects) => {
                self.objects = Some(objects);
                self.opened = Instant::now();
                let failed = self.opening.succeed().map_or(String::new(), |why| format!(", at last ({why})"));
                if self.device_losses > 0 {
                    self.news.push(format!("the device was lost and is open again{failed}"));
                }
                return Ok(true);
            }
            Err(error) => error,
        };
        // What is wrong with a machine from the start does not pass; a driver that begins anew says anything.
        let was_there = self.device_losses > 0;
        let may_pass = was_there
            || matches!(
                &error,
                ClientError::Gpu(GpuError::Call { .. } | GpuError::Memory { .. } | GpuError::Unmapped(_))
            );
        let patience = if was_there { REOPENING } else { OPENING };
        if !may_pass || self.opening.lasts(now) > patience {
            return Err(error);
        }
        if !self.opening.has_failed() {
            tell(&format!("no device can be opened, which is tried again for {patience:.0?}: {error}"));
        }
        self.opening.fail(Instant::now(), &error);
        Ok(false)
    }

    /// Gives up the device, which was lost; [`reopen`](Self::reopen) opens another one. Sums in memory stay for the film on it.
    ///
    /// # Errors
    ///
    /// The same error where devices are lost one soon after the other.
    pub fn lose_device(&mut self, error: ClientError) -> Result<(), ClientError> {
        let has_lasted = self.opened.elapsed() >= LASTING.0 || self.last.get() >= LASTING.1;
        self.device_losses += 1;
        self.losses_in_a_row = if has_lasted { 1 } else { self.losses_in_a_row + 1 };
        self.messages += self.gpu().map_or(0, |gpu| gpu.validation_messages().len());
        // Before the next one: a window has one swapchain at a time.
        let film = self.objects.take().and_then(|objects| objects.film);
        self.rescued = film.filter(VulkanFilm::is_summed_on_host);
        (self.last, self.before) = (FrameNumber::default(), FrameNumber::default());
        if self.losses_in_a_row > MOST_LOSSES {
            return Err(error);
        }
        tell(&format!("the device was lost; opening it again ({error})"));
        Ok(())
    }

    fn make(&mut self, spec: FilmSpec) -> Result<DeviceObjects, ClientError> {
        let size = self.window.inner_size();
        let extent = [size.width, size.height];
        let (options, faults) = (GpuOptions::from_env(), &self.simulated.calls);
        let swapchain = Swapchain::open_with_faults(&self.choice, options, self.handles()?, extent, faults)?;
        swapchain.gpu().set_timing(true);
        if let Some(frames) = self.simulated.devices.get(self.device_losses as usize) {
            swapchain.gpu().lose_after(*frames);
        }
        if let Some(bytes) = self.simulated.memory {
            swapchain.gpu().limit_memory(bytes);
        }
        let pipelines = PipelineKeeper::new(swapchain.gpu().clone());
        // Another size or filter may have been asked for meanwhile.
        let rescued = self.rescued.take().filter(|film| *film.spec() == spec);
        let film = match rescued.and_then(|film| film.moved_to(swapchain.gpu())) {
            Some(film) => film,
            None => new_film(swapchain.gpu(), spec, self.exact)?,
        };
        Ok(DeviceObjects { film: Some(film), swapchain, pipelines })
    }

    fn handles(&self) -> Result<(RawDisplayHandle, RawWindowHandle), GpuError> {
        let gone =
            |e: raw_window_handle::HandleError| GpuError::NoWindow(format!("the window system says: {e}"));
        let display = self.window.display_handle().map_err(gone)?.as_raw();
        Ok((display, self.window.window_handle().map_err(gone)?.as_raw()))
    }

    /// Looks whether the device has room for this film in the place of the present one, as far as it tells. Images are made when they are
    /// needed first: without the look the present film would be gone by then.
    ///
    /// # Errors
    ///
    /// [`GpuError::Memory`].
    pub fn check_room(&self, spec: &FilmSpec, settings: &Settings) -> Result<(), ClientError> {
        let Some((gpu, film)) = self.gpu().zip(self.film()) else { return Ok(()) };
        let (streams, samples) = (film.allocated_streams(), film.counts().samples() as usize);
        let of_sums =
            |name: &str| name.starts_with("batch") || name.starts_with("samples") || name.ends_with("rests");
        let bytes = |spec: &FilmSpec| -> u64 {
            let all = film_memory(spec, settings, streams, samples, !gpu.fetches_any_level());
            let on_device = all.iter().filter(|(name, _)| !film.is_summed_on_host() || !of_sums(name));
            on_device.map(|(_, bytes)| bytes).sum()
        };
        let name = format!("a picture of {}×{} pixels", spec.width, spec.height);
        Ok(gpu.check_room(&name, bytes(spec), bytes(film.spec()))?)
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
        let gpu = self.gpu().ok_or_else(|| GpuError::NoWindow("its device was lost.".to_owned()))?;
        new_film(gpu, spec, self.exact)
    }

    /// The film; `None` while there is no device, and once it was taken.
    pub fn film(&self) -> Option<&VulkanFilm> {
        self.objects.as_ref().and_then(|objects| objects.film.as_ref())
    }

    /// As [`film`](Self::film), to be changed.
    pub fn film_mut(&mut self) -> Option<&mut VulkanFilm> {
        self.objects.as_mut().and_then(|objects| objects.film.as_mut())
    }

    /// Takes the film whose device was lost, if its sums are in memory.
    pub fn take_rescued(&mut self) -> Option<VulkanFilm> {
        self.rescued.take()
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

    /// The last frame of batches and pictures that was handed over.
    fn last(&self) -> FrameNumber {
        self.film().map_or(self.last, |film| film.rasterised().max(self.last))
    }

    /// Whether a frame is recorded while the device works on the one before. A device that is the processor would only be held up.
    pub fn leads(&self) -> bool {
        self.gpu().is_some_and(|gpu| !gpu.is_processor())
    }

    /// A frame of the loop begins.
    pub fn begin_frame(&mut self) {
        self.before = self.last();
    }

    /// True when the device has done everything it was given, or, where the loop [leads](Self::leads), everything before the last frame
    /// of the loop.
    pub fn is_idle(&self) -> bool {
        let awaited = if self.leads() { self.before } else { self.last() };
        self.gpu().is_none_or(|gpu| gpu.has_completed(awaited))
    }

    /// Length of a frame of the display that the window is on, where it is known.
    pub fn frame_length(&self) -> Option<Duration> {
        let rate = self.window.current_monitor()?.refresh_rate_millihertz().filter(|rate| *rate >= 1000)?;
        Some(Duration::from_secs_f64(1e3 / f64::from(rate)))
    }

    /// What the user is to be told since the last call.
    pub fn take_news(&mut self) -> Vec<String> {
        std::mem::take(&mut self.news)
    }

    /// Asks for an image to draw into, without waiting. Errors of surface and images are told and tried again.
    ///
    /// # Errors
    ///
    /// A lost device.
    pub fn acquire(&mut self) -> Result<Canvas, ClientError> {
        let now = Instant::now();
        if let Some(next) = self.presenting.next().filter(|next| now < *next) {
            return Ok(Canvas::Later(next));
        }
        let error = match self.try_acquire() {
            Ok(canvas) => return Ok(canvas),
            Err(error) if error.is_device_lost() => return Err(error.into()),
            Err(error) => error,
        };
        if !self.presenting.has_failed() {
            tell(&format!("the window cannot be drawn, which is tried again: {error}"));
        }
        Ok(Canvas::Later(self.presenting.fail(Instant::now(), &error)))
    }

    fn try_acquire(&mut self) -> Result<Canvas, GpuError> {
        let handles = self.handles();
        let Some(DeviceObjects { swapchain, .. }) = &mut self.objects else { return Ok(Canvas::Hidden) };
        match swapchain.acquire(Duration::ZERO)? {
            Readiness::Ready => Ok(swapchain.extent().map_or(Canvas::Hidden, Canvas::Ready)),
            Readiness::Hidden => Ok(Canvas::Hidden),
            Readiness::Busy => Ok(Canvas::Later(Instant::now() + SOON)),
            Readiness::SurfaceLost => {
                swapchain.replace_surface(handles?)?;
                self.surface_losses += 1;
                tracing::info!("the surface was lost and replaced");
                Ok(Canvas::Later(Instant::now() + SOON))
            }
        }
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
                let grid = settings.glare.map_or(1, |_| glare_detail(&gpu, extent));
                if std::mem::replace(&mut self.glare_grid, grid) != grid && grid > 1 {
                    self.news.push(format!(
                        "this device has no memory for glare at this size: the picture is computed on a grid of {grid}×{grid} pixels"
                    ));
                }
                let detail = detail.max(grid);
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
            swapchain.draw(&mut frame, picture, &copies, viewport.filter(), repaint.is_some());
        }
        let panel = panel.filter(|_| self.overlaying.is_due(Instant::now()));
        let overlaid = panel.map(|panel| draw_panel(&mut self.overlay, swapchain, &mut frame, panel));
        self.window.pre_present_notify();
        self.last = swapchain.present(frame)?;
        pipelines.tick();
        match overlaid {
            Some(Err(error)) if error.is_device_lost() => return Err(error.into()),
            Some(Err(error)) => {
                if !self.overlaying.has_failed() {
                    tell(&format!("the panel cannot be drawn, which is tried again: {error}"));
                }
                self.overlaying.fail(Instant::now(), &error);
            }
            Some(Ok(())) => {
                let failed = self.overlaying.succeed();
                self.news.extend(failed.map(|why| format!("the panel is drawn again ({why})")));
            }
            None => {}
        }
        if !swapchain.has_failed() {
            let failed = self.presenting.succeed();
            self.news.extend(failed.map(|why| format!("the window is drawn again ({why})")));
        }
        Ok(self.last)
    }
}

/// Draws the panel over the acquired image. Its renderer is made anew after an error.
fn draw_panel(
    overlay: &mut Option<PanelRenderer>,
    swapchain: &mut Swapchain,
    frame: &mut GpuFrame<'_>,
    panel: &mut PanelDrawing,
) -> Result<(), GpuError> {
    let overlay = match overlay {
        Some(overlay) => overlay,
        empty => empty.insert(PanelRenderer::new(swapchain)?),
    };
    let textures = std::mem::take(&mut panel.textures);
    overlay.draw(swapchain, frame, textures, &panel.primitives, panel.pixels_per_point)
}

/// A film that does not let the window stand still.
fn new_film(gpu: &Arc<Gpu>, spec: FilmSpec, exact: bool) -> Result<VulkanFilm, ClientError> {
    // Where the device is the processor, glare at full resolution takes longer than a frame may, and its passes draw samples slowly.
    let hurry = gpu.is_processor() && !exact;
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
