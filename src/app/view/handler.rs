//! What winit says, and when a frame is due.

use std::sync::Arc;
use std::time::{Duration, Instant};

use raw_window_handle::HasDisplayHandle;
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::{Window, WindowId};

use crate::app::process;
use crate::app::timings::TimingCapture;
use crate::app::view::cores;
use crate::app::view::screen::Screen;
use crate::app::view::ui::Ui;
use crate::app::view::viewer::{DEFAULT_BUDGET, Viewer};
use crate::client::pacing::Pacer;
use crate::gpu;

/// How soon the loop looks again while the device or first samples are waited for.
const SOON: Duration = Duration::from_millis(1);

/// How long it sleeps at most: signals from outside are heard then.
const IDLE: Duration = Duration::from_millis(100);

/// An epoch that is not shown may be cut off by the next edit after this long: a scene that is too slow for its first picture
/// must not hold the camera.
const PATIENCE: Duration = Duration::from_millis(250);

impl ApplicationHandler for Viewer {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        if self.screen.is_none()
            && let Err(error) = self.open(events)
        {
            self.fail(error);
        }
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, mut event: WindowEvent) {
        let Some(window) = self.screen.as_ref().map(|screen| screen.window().clone()) else { return };
        match &mut event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.quit = true,
            WindowEvent::Resized(size) => self.resized(*size),
            WindowEvent::ScaleFactorChanged { inner_size_writer, .. } => {
                // Points become larger or smaller; the picture keeps its pixels.
                let _ = inner_size_writer.request_inner_size(window.inner_size());
                self.refresh();
            }
            WindowEvent::Occluded(true) => self.pending.hidden = true,
            WindowEvent::RedrawRequested | WindowEvent::Occluded(false) => self.pending.show = true,
            _ => {}
        }
        let panel = self.controls.visible || self.controls.help;
        let taken = match &mut self.ui {
            Some(ui) if concerns_all(&event) => {
                // Also while hidden: what it knows of keys and scale must not grow old.
                let _ = ui.on_event(&window, &event);
                false // Nothing of this begins anything.
            }
            Some(ui) if panel && !self.input.is_dragging() => ui.on_event(&window, &event),
            _ => false,
        };
        for intent in self.input.on_window_event(&event, taken) {
            self.intend(intent);
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
    /// Opens the window, the device and the panel; the first epoch begins with the first step.
    fn open(&mut self, events: &ActiveEventLoop) -> miette::Result<()> {
        use miette::IntoDiagnostic;
        let [width, height] = self.size;
        let attributes = Window::default_attributes()
            .with_title(format!("{} · Pointillist", self.plan.name))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = Arc::new(events.create_window(attributes).into_diagnostic()?);
        gpu::survive_display_loss(window.display_handle().into_diagnostic()?.as_raw());
        if self.plan.budget.is_none() {
            let rate = window.current_monitor().and_then(|monitor| monitor.refresh_rate_millihertz());
            let budget =
                rate.filter(|rate| *rate >= 1000).map(|rate| Duration::from_secs_f64(1e3 / f64::from(rate)));
            self.pacer = Pacer::new(budget.unwrap_or(DEFAULT_BUDGET));
        }
        self.ui = Some(Ui::new(&window));
        // Tracing begins while the device is opened, by path tracing where the method is to be chosen.
        self.choose()?;
        self.restart()?;
        let screen = Screen::open(window, &self.plan, self.spec()).into_diagnostic()?;
        if let Some(info) = screen.gpu().map(|gpu| gpu.info()) {
            self.plan.run.device = info.name.clone();
            self.plan.cores = cores::plan(self.session.threads(), info.kind);
        }
        if let Some(path) = &self.plan.timings {
            self.session.server().set_tracing(true);
            self.capture = Some(TimingCapture::new(path, screen.gpu())?);
        }
        self.screen = Some(screen);
        self.clock.due = Instant::now();
        Ok(())
    }

    fn resized(&mut self, size: PhysicalSize<u32>) {
        if let Some(swapchain) = self.screen.as_mut().and_then(Screen::swapchain) {
            swapchain.resize([size.width, size.height]);
        }
        (self.pending.show, self.clock.due) = (true, Instant::now());
        if let Some(ui) = &mut self.ui {
            ui.refresh();
        }
    }

    /// Does what is due: camera, epoch, frame.
    fn step(&mut self) {
        let now = Instant::now();
        if let Some(gesture) = self.input.tick((now - self.clock.tick).as_secs_f64()) {
            self.gesture(gesture);
        }
        self.clock.tick = now;
        if let Some(gpu) = self.screen.as_ref().and_then(Screen::gpu).cloned() {
            self.figures.completed(&gpu, &mut self.pacer);
        }
        self.act();
        if let Err(error) = self.choose() {
            return self.fail(error);
        }
        let shown = !self.pending.unseen || self.session.elapsed() > PATIENCE;
        if self.pending.restart && shown {
            match self.restart() {
                Ok(()) => self.clock.due = now,
                Err(error) => return self.fail(error),
            }
        }
        let free = self.screen.as_ref().is_some_and(Screen::is_idle);
        if now >= self.clock.due && free {
            // Until its first picture the window opens; that time has a figure of its own.
            let open = self.figures.presented > 0;
            if open {
                self.figures.waited("for the device", now - self.clock.due.max(self.clock.ended));
            }
            self.clock.due = self.clock.due.max(now) + self.pacer.budget();
            if let Err(error) = self.frame() {
                self.recover(error);
            }
            self.clock.ended = Instant::now();
            if open {
                self.figures.waited("for a frame", self.clock.ended - now);
            }
            if self.pending.unseen && !self.pending.hidden {
                self.clock.due = Instant::now() + SOON;
            }
        }
    }

    /// When the loop looks again.
    fn next_look(&self, now: Instant) -> Instant {
        let busy = !self.screen.as_ref().is_some_and(Screen::is_idle);
        if self.figures.awaits_edit() || (busy && now >= self.clock.due) {
            return now + SOON;
        }
        let still = self.session.is_through()
            && self.saving.is_empty()
            && !self.costs.is_measuring()
            && self.kept.caught_up()
            && !(self.pending.restart || self.pending.unseen || self.pending.repaint || self.pending.show)
            && !self.input.is_moving();
        if !still {
            return self.clock.due;
        }
        let panel = self.ui.as_ref().filter(|_| self.has_overlay()).map_or(now + IDLE, Ui::due);
        panel.min(now + IDLE).max(self.clock.due)
    }
}

/// Events that are nobody's alone.
fn concerns_all(event: &WindowEvent) -> bool {
    matches!(
        event,
        WindowEvent::ScaleFactorChanged { .. }
            | WindowEvent::ModifiersChanged(_)
            | WindowEvent::Focused(_)
            | WindowEvent::ThemeChanged(_)
            | WindowEvent::CursorLeft { .. }
            // A press on the picture is heard by both; without its end egui would hold the button for ever.
            | WindowEvent::MouseInput { state: ElementState::Released, .. }
    )
}
