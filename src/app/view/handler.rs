//! Hears winit: opens the window, turns its events into actions, and lets the loop step when a frame is due.

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::IntoDiagnostic;
use raw_window_handle::HasDisplayHandle;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::{Window, WindowId};

use crate::app::process;
use crate::app::timings::TimingCapture;
use crate::app::view::Viewer;
use crate::app::view::screen::Screen;
use crate::gpu;

impl ApplicationHandler for Viewer {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.picture.screen.is_none()
            && let Err(error) = self.open(events)
        {
            self.fail(error);
        }
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, mut event: WindowEvent) {
        let Some(window) = self.picture.screen.as_ref().map(|screen| screen.window.clone()) else { return };
        match &mut event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.quit = true,
            WindowEvent::Resized(size) => self.resized(*size),
            WindowEvent::ScaleFactorChanged { inner_size_writer, .. } => {
                // Points become larger or smaller; the picture keeps its pixels.
                let _ = inner_size_writer.request_inner_size(window.inner_size());
                self.refresh();
            }
            WindowEvent::Occluded(true) => self.picture.hide(),
            WindowEvent::RedrawRequested | WindowEvent::Occluded(false) => self.picture.request_show(),
            _ => {}
        }
        if self.panel.on_event(&window, &event) {
            self.act();
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if process::is_interrupted() {
            self.quit = true;
        }
        if gpu::display_lost() {
            self.fail(miette::miette!("the connection to the display broke"));
        }
        if !self.quit {
            self.step();
        }
        if self.quit {
            events.exit();
            return;
        }
        events.set_control_flow(ControlFlow::WaitUntil(self.next_look(Instant::now())));
    }
}

impl Viewer {
    /// Opens the window, the device and the panel; the first epoch begins meanwhile.
    fn open(&mut self, events: &ActiveEventLoop) -> miette::Result<()> {
        let [width, height] = self.session.size();
        let attributes = Window::default_attributes()
            .with_title(format!("{} · Pointillist", self.options.name))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = Arc::new(events.create_window(attributes).into_diagnostic()?);
        gpu::survive_display_loss(window.display_handle().into_diagnostic()?.as_raw());
        let rate = window.current_monitor().and_then(|monitor| monitor.refresh_rate_millihertz());
        let rate = rate.filter(|rate| self.options.budget.is_none() && *rate >= 1000);
        self.panel.host.open(&window);
        // Tracing begins while the device is opened, by path tracing where the method is to be chosen.
        self.choose_method()?;
        self.restart()?;
        let (run, options) = (self.session.run_spec(), &self.options);
        let screen = Screen::open(window, &options.device, &options.losses, run.film, run.deterministic);
        let screen = screen.into_diagnostic()?;
        if let Some(gpu) = screen.gpu() {
            self.session.set_device(gpu.info());
        }
        if let Some(path) = &self.options.timings {
            self.session.server.set_tracing(true);
            self.capture = Some(TimingCapture::new(path, screen.gpu())?);
        }
        self.picture.open(screen, rate.map(|rate| Duration::from_secs_f64(1e3 / f64::from(rate))));
        self.due = Instant::now();
        Ok(())
    }

    fn resized(&mut self, size: PhysicalSize<u32>) {
        if let Some(swapchain) = self.picture.screen.as_mut().and_then(Screen::swapchain) {
            swapchain.resize([size.width, size.height]);
        }
        self.picture.request_show();
        self.due = Instant::now();
        self.panel.host.refresh();
    }
}
