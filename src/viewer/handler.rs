//! Handles winit events: turns them into actions, and steps the loop when a frame is due.

use std::path::PathBuf;
use std::time::Instant;

use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::WindowId;

use crate::client::window::host::ReaderEvent;
use crate::gpu;
use crate::render::process;
use crate::viewer::Viewer;
use crate::viewer::screen::Screen;
use crate::viewer::start::{Stage, ViewerApp};

impl ApplicationHandler<ReaderEvent> for ViewerApp {
    fn resumed(&mut self, _: &ActiveEventLoop) {
        if let Stage::Loading(loading) = &mut self.stage {
            loading.may_open = true;
        }
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        match &mut self.stage {
            Stage::Loading(loading) => loading.hear(&event),
            Stage::Open(viewer) => viewer.hear(event),
            Stage::Over(_) => {}
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, event: ReaderEvent) {
        match &mut self.stage {
            Stage::Loading(loading) => {
                if let Some(open) = &mut loading.open {
                    open.host.hear_reader(event);
                }
            }
            Stage::Open(viewer) => {
                viewer.panel.host.hear_reader(event);
                viewer.refresh();
            }
            Stage::Over(_) => {}
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        self.step(events);
        let next = match &mut self.stage {
            Stage::Loading(loading) if !loading.quit => loading.next_look(),
            Stage::Open(viewer) if !viewer.quit => viewer.next_look(Instant::now()),
            _ => return events.exit(),
        };
        events.set_control_flow(ControlFlow::WaitUntil(next));
    }
}

impl Viewer {
    /// Handles an event of the window.
    fn hear(&mut self, mut event: WindowEvent) {
        let Some(window) = self.picture.screen.as_ref().map(|screen| screen.window.clone()) else { return };
        match &mut event {
            WindowEvent::CloseRequested => self.quit = self.may_discard("closing the window"),
            WindowEvent::Destroyed => self.quit = true,
            WindowEvent::Resized(size) => self.resized(*size),
            WindowEvent::ScaleFactorChanged { inner_size_writer, .. } => {
                // The scale factor changes; the picture keeps its size in pixels, and the dock its size in points.
                let _ = inner_size_writer.request_inner_size(window.inner_size());
                self.keep_picture();
                self.refresh();
                self.look_at_display = Instant::now();
            }
            WindowEvent::Moved(_) => self.look_at_display = Instant::now(),
            WindowEvent::Occluded(true) => self.picture.hide(),
            WindowEvent::RedrawRequested | WindowEvent::Occluded(false) => self.picture.request_show(),
            WindowEvent::DroppedFile(path) => self.drop_file(path.clone()),
            _ => {}
        }
        if self.with_tools(None, |tools, context| tools.hear(&event, context)) {
            return;
        }
        let actions = self.panel.on_event(&window, &event, &self.keys);
        if !actions.is_empty() {
            self.actions.extend(actions);
            self.act();
        }
    }

    /// Opens the scene or model that was dropped onto the window.
    fn drop_file(&mut self, path: PathBuf) {
        if self.may_discard("dropping a scene") {
            self.open_file(path);
        }
    }

    /// Performs the due work.
    pub(super) fn turn(&mut self) {
        if process::is_interrupted() {
            self.quit = true;
        }
        if gpu::display_lost() {
            self.fail(miette::miette!("the connection to the display broke"));
        }
        if !self.quit {
            self.step();
        }
    }

    pub(super) fn resized(&mut self, size: PhysicalSize<u32>) {
        if let Some(swapchain) = self.picture.screen.as_mut().and_then(Screen::swapchain) {
            swapchain.resize([size.width, size.height]);
        }
        self.picture.request_show();
        self.clock.set(Instant::now());
        self.panel.host.refresh();
    }
}
