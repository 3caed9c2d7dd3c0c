//! The window on its device: swapchain, film and panel overlay, and the replacement of each when lost.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DVec2, Vec3};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle, RawDisplayHandle, RawWindowHandle};
use winit::window::Window;

use crate::client::background::BackgroundPolicy;
use crate::client::film::VulkanFilm;
use crate::client::memory::{FilmContents, film_memory};
use crate::client::pass::glare::glare_detail;
use crate::client::window::host::PanelDrawing;
use crate::client::window::panel_renderer::PanelRenderer;
use crate::client::window::viewport::Viewport;
use crate::client::{ClientError, Film, FilmSpec, Settings};
use crate::gpu::{
    DeviceChoice, DeviceFaults, FrameNumber, Gpu, GpuError, GpuFrame, GpuOptions, Readiness, Swapchain,
};
use crate::image::Grid;
use crate::render::pipelines::PipelineKeeper;
use crate::render::process::tell;
use crate::viewer::clock::Backoff;
use crate::viewer::light_mix::LightMix;
use crate::viewer::picture::regions::{Regions, per_pixel};

/// Interval at which a swapchain image is asked for again if none was available.
const SOON: Duration = Duration::from_millis(1);

/// A device counts as stable after this time or this number of frames.
const LASTING: (Duration, u64) = (Duration::from_secs(10), 480);

/// Number of consecutive devices that may be lost before they are stable.
const MOST_LOSSES: u32 = 1;

/// How long to keep trying to open the first device, or one after a loss.
const REOPENING: Duration = Duration::from_secs(30);
const OPENING: Duration = Duration::from_secs(5);

/// Result of asking for a swapchain image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Canvas {
    /// An image of this extent is acquired.
    Ready([u32; 2]),
    /// No image, because the window is hidden or there is no device.
    Hidden,
    /// No image yet: ask again at this time.
    Later(Instant),
}

/// Pictures combined with the film of all samples.
pub struct PictureParts<'a> {
    pub regions: &'a mut Regions,
    pub mix: &'a mut LightMix,
}

/// Source of a repaint.
#[derive(Clone, Copy)]
pub enum PictureSource<'a> {
    /// The film, at this internal resolution (`detail`).
    Film(u32),
    /// The light mix, at this internal resolution (`detail`).
    Mix(u32),
    /// A denoised picture for each eye, scene-linear XYZ.
    Filtered(&'a [&'a Grid<Vec3>]),
}

/// Objects of one device, dropped in order of declaration.
struct DeviceObjects {
    /// `None` once taken for the files written at the end.
    film: Option<VulkanFilm>,
    swapchain: Swapchain,
    pipelines: PipelineKeeper,
}

/// The window, and film and swapchain on the device that draws into it.
pub struct Screen {
    /// `None` while there is no device.
    objects: Option<DeviceObjects>,
    /// Film of a lost device, if its sums are in main memory.
    rescued: Option<VulkanFilm>,
    /// Whether the film has a right eye.
    both_eyes: bool,
    overlay: Option<PanelRenderer>,
    choice: DeviceChoice,
    /// The window.
    pub window: Arc<Window>,
    /// The last submitted frame, and the last one before the present iteration of the loop.
    last: FrameNumber,
    before: FrameNumber,
    /// Faults planned by a test.
    simulated: DeviceFaults,
    /// The window must show the same bits as a headless render.
    exact: bool,
    /// Number of lost devices.
    pub device_losses: u32,
    /// Number of lost surfaces.
    pub surface_losses: u32,
    /// Number of consecutive devices lost before they were stable.
    losses_in_a_row: u32,
    /// When the device was opened.
    opened: Instant,
    /// Back-off for opening a device, acquiring images, and drawing the panel.
    opening: Backoff,
    presenting: Backoff,
    overlaying: Backoff,
    /// Grid spacing in pixels at which the glare convolution fits the device.
    glare_grid: u32,
    /// Pending messages to the user.
    news: Vec<String>,
    /// Number of validation-layer messages on devices already closed.
    messages: usize,
}

impl Screen {
    /// Opens a device for this window and creates a film on it. `exact`: the window must show the same bits as a headless render. If
    /// opening fails for a transient reason, [`reopen`](Self::reopen) retries it.
    pub fn open(
        window: Arc<Window>,
        choice: &DeviceChoice,
        simulated: &DeviceFaults,
        spec: FilmSpec,
        exact: bool,
    ) -> Result<Self, ClientError> {
        let mut screen = Self {
            objects: None,
            rescued: None,
            both_eyes: false,
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

    /// Opens a device if there is none and the next attempt is due. Its film is empty, or that of the lost device if its sums are in main
    /// memory. Returns whether there is a new device.
    ///
    /// # Errors
    ///
    /// The error of the last attempt, if it is not transient.
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
        // At startup such errors are permanent; after a loss, a restarting driver may return any error transiently.
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

    /// Releases the lost device; [`reopen`](Self::reopen) opens another one. Sums in main memory are kept for its film.
    ///
    /// # Errors
    ///
    /// The same error if several devices are lost in short succession.
    pub fn lose_device(&mut self, error: ClientError) -> Result<(), ClientError> {
        let has_lasted = self.opened.elapsed() >= LASTING.0 || self.last.get() >= LASTING.1;
        self.device_losses += 1;
        self.losses_in_a_row = if has_lasted { 1 } else { self.losses_in_a_row + 1 };
        self.messages += self.gpu().map_or(0, |gpu| gpu.validation_messages().len());
        // Dropped before the next one is created: a window has one swapchain at a time.
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
        let swapchain = Swapchain::open(&self.choice, options, self.handles()?, extent, faults)?;
        swapchain.gpu().set_timing(true);
        swapchain.gpu().plan(&self.simulated, self.device_losses);
        let pipelines = PipelineKeeper::new(swapchain.gpu().clone());
        // The requested size or filter may have changed meanwhile.
        let is_asked_for = |film: &VulkanFilm| *film.spec() == spec && film.has_right_eye() == self.both_eyes;
        let rescued = self.rescued.take().filter(is_asked_for);
        let film = match rescued.and_then(|film| film.moved_to(swapchain.gpu())) {
            Some(film) => film,
            None => self.main_film(swapchain.gpu(), spec, self.both_eyes)?,
        };
        Ok(DeviceObjects { film: Some(film), swapchain, pipelines })
    }

    /// An empty film for all of the picture.
    fn main_film(&self, gpu: &Arc<Gpu>, spec: FilmSpec, both_eyes: bool) -> Result<VulkanFilm, ClientError> {
        let film = new_film(gpu, spec, self.exact)?;
        if both_eyes { film.with_right_eye() } else { Ok(film) }
    }

    fn handles(&self) -> Result<(RawDisplayHandle, RawWindowHandle), GpuError> {
        let gone =
            |e: raw_window_handle::HandleError| GpuError::NoWindow(format!("the window system says: {e}"));
        let display = self.window.display_handle().map_err(gone)?.as_raw();
        Ok((display, self.window.window_handle().map_err(gone)?.as_raw()))
    }

    /// Checks whether device memory suffices to replace the film by this one, as far as the device reports it. Images are allocated on
    /// first use; without this check the present film would be gone when that fails.
    ///
    /// # Errors
    ///
    /// [`GpuError::Memory`].
    pub fn check_room(
        &self,
        spec: &FilmSpec,
        both_eyes: bool,
        settings: &Settings,
    ) -> Result<(), ClientError> {
        let Some((gpu, film)) = self.gpu().zip(self.film()) else { return Ok(()) };
        let (streams, samples) = (film.allocated_streams(), film.counts().samples() as usize);
        let of_sums =
            |name: &str| name.starts_with("batch") || name.starts_with("samples") || name.ends_with("rests");
        let bytes = |spec: &FilmSpec, both_eyes: bool| -> u64 {
            let contents = FilmContents { streams, samples, eyes: if both_eyes { 2 } else { 1 } };
            let all = film_memory(spec, settings, contents, !gpu.fetches_any_level());
            let on_device = all.iter().filter(|(name, _)| !film.is_summed_on_host() || !of_sums(name));
            on_device.map(|(_, bytes)| bytes).sum()
        };
        let name = format!("a picture of {}×{} pixels", spec.width, spec.height);
        Ok(gpu.check_room(&name, bytes(spec, both_eyes), bytes(film.spec(), film.has_right_eye()))?)
    }

    /// Replaces the film by an empty one on the same device, with a right eye or without. On an error the old one stays. If the device has
    /// finished with the old film, its images are freed first, since few devices have room for both.
    pub fn replace_film(&mut self, spec: FilmSpec, both_eyes: bool) -> Result<(), ClientError> {
        let Some(gpu) = self.gpu().cloned() else { return Ok(()) };
        let film = self.main_film(&gpu, spec, both_eyes)?;
        self.both_eyes = both_eyes;
        if let Some(objects) = &mut self.objects {
            objects.film = Some(film);
            gpu.free_retired()?;
        }
        Ok(())
    }

    /// Another film on the same device.
    ///
    /// # Errors
    ///
    /// If there is no device, and those of a film.
    pub fn new_film(&self, spec: FilmSpec) -> Result<VulkanFilm, ClientError> {
        let gpu = self.gpu().ok_or_else(|| GpuError::NoWindow("its device was lost.".to_owned()))?;
        new_film(gpu, spec, self.exact)
    }

    /// The film; `None` while there is no device, and once taken.
    pub fn film(&self) -> Option<&VulkanFilm> {
        self.objects.as_ref().and_then(|objects| objects.film.as_ref())
    }

    /// Mutable [`film`](Self::film).
    pub fn film_mut(&mut self) -> Option<&mut VulkanFilm> {
        self.objects.as_mut().and_then(|objects| objects.film.as_mut())
    }

    /// Takes the film of a lost device, if its sums are in main memory.
    pub fn take_rescued(&mut self) -> Option<VulkanFilm> {
        self.rescued.take()
    }

    /// Takes the film, for the files written at the end.
    pub fn take_film(&mut self) -> Option<VulkanFilm> {
        self.objects.as_mut().and_then(|objects| objects.film.take())
    }

    /// Swapchain of the window.
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

    /// The last submitted frame of batches and pictures.
    fn last(&self) -> FrameNumber {
        self.film().map_or(self.last, |film| film.rasterised().max(self.last))
    }

    /// Whether frames are recorded while the device works on the previous one (double buffering). A device that is the CPU would only be
    /// slowed down.
    pub fn leads(&self) -> bool {
        self.gpu().is_some_and(|gpu| !gpu.is_processor())
    }

    /// Begins an iteration of the loop.
    pub fn begin_frame(&mut self) {
        self.before = self.last();
    }

    /// Whether the device has completed all submitted work or, with [double buffering](Self::leads), everything before the last iteration
    /// of the loop.
    pub fn is_idle(&self) -> bool {
        let awaited = if self.leads() { self.before } else { self.last() };
        self.gpu().is_none_or(|gpu| gpu.has_completed(awaited))
    }

    /// Refresh interval of the display that the window is on, if known.
    pub fn frame_length(&self) -> Option<Duration> {
        let rate = self.window.current_monitor()?.refresh_rate_millihertz().filter(|rate| *rate >= 1000)?;
        Some(Duration::from_secs_f64(1e3 / f64::from(rate)))
    }

    /// Takes the messages to the user since the last call.
    pub fn take_news(&mut self) -> Vec<String> {
        std::mem::take(&mut self.news)
    }

    /// Acquires a swapchain image without blocking. Errors of surface and images are reported and retried.
    ///
    /// # Errors
    ///
    /// If the device is lost.
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

    /// Draws the picture with its regions according to the viewport, and the panel over it, into the acquired image, and presents it.
    /// Without a `repaint` the last painted picture is drawn. Returns the frame's number.
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
                // Regions and light groups are reconstructed at the internal resolution of the whole picture.
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
                    PictureSource::Filtered(pictures) => {
                        film.paint_filtered(cmd, pictures, settings, &mut regions)?
                    }
                })
            }
            None => film.painted(),
        };
        if let Some(picture) = picture {
            let painted = picture.extent(0);
            let stale =
                viewport.layout().is_some() && viewport.picture() != DVec2::from(painted.map(f64::from));
            // A picture in the layout before is shown whole until there is one in the present layout.
            let viewport = if stale { viewport.whole_of(painted) } else { *viewport };
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

/// Draws the panel over the acquired image. After an error its renderer is created anew.
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

/// A film that prepares expensive tables in the background, so that the window does not block.
fn new_film(gpu: &Arc<Gpu>, spec: FilmSpec, exact: bool) -> Result<VulkanFilm, ClientError> {
    // If the device is the CPU, glare at full resolution exceeds the frame time, and GPU passes rasterise samples slowly.
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

/// Whether a new device may resolve the error.
pub fn is_device_lost(error: &ClientError) -> bool {
    matches!(error, ClientError::Gpu(gpu) if gpu.is_device_lost())
}
