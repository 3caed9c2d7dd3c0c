//! The window before its first scene is loaded: it shows the progress, and closes at once on request.

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};
use raw_window_handle::HasDisplayHandle;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::keyboard::{Key, ModifiersState, NamedKey};
use winit::window::Window;

use crate::client::window::host::{EguiHost, ReaderEvent};
use crate::client::window::viewport::Viewport;
use crate::client::{ClientError, FilmSpec, SplatFilter, VarianceForm};
use crate::gpu;
use crate::render::process::tell;
use crate::viewer::context::SessionContext;
use crate::viewer::light_mix::LightMix;
use crate::viewer::loader::{ReadyScene, SceneLoader, ViewSource};
use crate::viewer::picture::regions::Regions;
use crate::viewer::preferences::Preferences;
use crate::viewer::screen::{Canvas, PictureParts, Screen, is_device_lost};

/// Window size, in pixels, if the scene's is not known in time.
const SIZE: [u32; 2] = [1280, 720];

/// How long to wait for the picture size before opening the window with [`SIZE`].
const PATIENCE: Duration = Duration::from_millis(250);

/// Fraction of the display that the window takes if the picture does not fit: decorations and system bars need the rest.
const OF_DISPLAY: f64 = 0.9;

/// Polling interval of the loader.
const LOOK: Duration = Duration::from_millis(10);

/// Frame interval.
const FRAME: Duration = Duration::from_millis(100);

/// A window with a device and a film.
pub(super) struct OpenWindow {
    pub screen: Screen,
    pub host: EguiHost,
}

/// The window while its scene is loaded.
pub(super) struct LoadingWindow {
    pub options: SessionContext,
    pub preferences: Preferences,
    pub loader: SceneLoader,
    /// For the accessibility tree of screen readers.
    proxy: EventLoopProxy<ReaderEvent>,
    pub open: Option<OpenWindow>,
    /// The window system is ready to open windows.
    pub may_open: bool,
    modifiers: ModifiersState,
    drawn: Option<Instant>,
    /// An error of drawing has been reported.
    told: bool,
    /// The window is to close.
    pub quit: bool,
}

impl LoadingWindow {
    /// Begins to load.
    pub fn start(
        source: ViewSource,
        options: SessionContext,
        preferences: Preferences,
        proxy: EventLoopProxy<ReaderEvent>,
    ) -> Result<Self> {
        let (open, may_open, modifiers, drawn, told, quit) = Default::default();
        let loader = SceneLoader::start(source, true)?;
        Ok(Self { options, preferences, loader, proxy, open, may_open, modifiers, drawn, told, quit })
    }

    /// Hears an event of the window.
    pub fn hear(&mut self, event: &WindowEvent) {
        let Some(OpenWindow { screen, host, .. }) = &mut self.open else { return };
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.quit = true,
            WindowEvent::Resized(size) => {
                if let Some(swapchain) = screen.swapchain() {
                    swapchain.resize([size.width, size.height]);
                }
                self.drawn = None;
            }
            WindowEvent::RedrawRequested => self.drawn = None,
            WindowEvent::ModifiersChanged(modifiers) => self.modifiers = modifiers.state(),
            WindowEvent::KeyboardInput { event, .. } if event.state == ElementState::Pressed => {
                let q = matches!(&event.logical_key, Key::Character(c) if c == "q");
                let escape = event.logical_key == Key::Named(NamedKey::Escape);
                self.quit |= escape || q && self.modifiers.control_key();
            }
            WindowEvent::DroppedFile(path) => {
                match SceneLoader::start(self.loader.source.with_scene(path.clone()), true) {
                    Ok(loader) => self.loader = loader,
                    Err(error) => tell(&error.to_string()),
                }
            }
            _ => {}
        }
        host.on_event(&screen.window, event, true, false);
    }

    /// Opens the window as soon as its size is known, draws the progress, and polls the loader. Returns the scene when it is loaded and
    /// there is a window for it.
    pub fn step(&mut self, events: &ActiveEventLoop) -> Result<Option<ReadyScene>> {
        if !self.may_open {
            return Ok(None);
        }
        let ready = self.loader.take().transpose()?;
        if self.open.is_none() {
            let late = self.options.began.elapsed() > PATIENCE;
            let film = ready.as_ref().map(|ready| [ready.run.film.width, ready.run.film.height]);
            if let Some(size) = film.or(self.loader.film()).or(late.then_some(SIZE)) {
                self.open = Some(self.window(events, size)?);
            }
        }
        if ready.is_none()
            && let Err(error) = self.draw()
        {
            self.recover(error).into_diagnostic()?;
        }
        Ok(ready)
    }

    /// Time of the next wake-up.
    pub fn next_look(&self) -> Instant {
        Instant::now() + LOOK
    }

    /// Opens a window for a picture of this size, and the device for it.
    fn window(&self, events: &ActiveEventLoop, [width, height]: [u32; 2]) -> Result<OpenWindow> {
        let options = &self.options;
        let attributes = Window::default_attributes()
            .with_title(title(&self.loader.source.name()))
            .with_inner_size(PhysicalSize::new(width, height))
            // Hidden until the accessibility tree is attached.
            .with_visible(false);
        let window = Arc::new(events.create_window(attributes).into_diagnostic()?);
        gpu::survive_display_loss(window.display_handle().into_diagnostic()?.as_raw());
        tracing::info!("the window opens after {:.0?}", options.began.elapsed());
        let mut host = EguiHost::default();
        host.open(&window, events, self.proxy.clone());
        let layout = &self.options.controls.layout;
        host.scale_text(layout.font_scale);
        let dock = layout.width * layout.font_scale * window.scale_factor() as f32;
        let dock = if layout.is_open { dock.round() as u32 } else { 0 };
        let _ = window.request_inner_size(window_size(&window, [width, height], dock));
        window.set_visible(true);
        let (exact, spec) = (self.loader.source.deterministic, film([width, height]));
        let screen = Screen::open(window, &options.device, &options.faults, spec, exact).into_diagnostic()?;
        Ok(OpenWindow { screen, host })
    }

    fn draw(&mut self) -> Result<(), ClientError> {
        let Some(OpenWindow { screen, host, .. }) = &mut self.open else { return Ok(()) };
        if self.drawn.is_some_and(|at| at.elapsed() < FRAME) || !screen.is_idle() {
            return Ok(());
        }
        if screen.gpu().is_none() && !screen.reopen(film(screen.window.inner_size().into()))? {
            return Ok(());
        }
        let Canvas::Ready(extent) = screen.acquire()? else { return Ok(()) };
        let window = screen.window.clone();
        host.run_loading(&window, &self.loader.state());
        let viewport = Viewport::new(extent);
        let panel = Some(host.drawing());
        let parts = PictureParts { regions: &mut Regions::default(), mix: &mut LightMix::default() };
        screen.show(&self.options.controls.settings, None, parts, &viewport, panel)?;
        self.drawn = Some(Instant::now());
        Ok(())
    }

    /// Handles an error of drawing: a lost device is replaced, and the next step draws again.
    fn recover(&mut self, error: ClientError) -> Result<(), ClientError> {
        self.drawn = Some(Instant::now());
        match &mut self.open {
            Some(OpenWindow { screen, .. }) if is_device_lost(&error) => screen.lose_device(error),
            Some(OpenWindow { screen, .. }) if screen.gpu().is_some() => {
                if !std::mem::replace(&mut self.told, true) {
                    tell(&format!("the window cannot be drawn, which is tried again: {error}"));
                }
                Ok(())
            }
            _ => Err(error),
        }
    }
}

/// Film of a window of this size before the scene is known.
fn film([width, height]: [u32; 2]) -> FilmSpec {
    FilmSpec {
        width: width.max(1),
        height: height.max(1),
        filter: SplatFilter::Gaussian,
        variance: Some(VarianceForm::Product),
        sums: Default::default(),
    }
}

/// Inner window size, in physical pixels, that shows a picture of this size at 1:1 beside a dock of this width. If that exceeds the
/// display, the window is smaller and keeps the picture's aspect ratio.
pub(super) fn window_size(window: &Window, [width, height]: [u32; 2], dock: u32) -> PhysicalSize<u32> {
    let whole = PhysicalSize::new(width + dock, height);
    let Some(display) = window.current_monitor().map(|monitor| monitor.size()) else { return whole };
    if whole.width <= display.width && whole.height <= display.height || display.width <= dock {
        return whole;
    }
    let room = [display.width - dock, display.height].map(|side| OF_DISPLAY * f64::from(side));
    let scale = (room[0] / f64::from(width)).min(room[1] / f64::from(height));
    let [width, height] = [width, height].map(|side| (scale * f64::from(side)).round().max(1.0) as u32);
    PhysicalSize::new(width + dock, height)
}

/// The title of a window with this scene.
pub(super) fn title(name: &str) -> String {
    format!("{name} · Pointillist")
}
