//! Runs egui in a window: passes events to it, runs the panel when due, and keeps its drawing.

use std::time::{Duration, Instant};

use egui_winit::accesskit_winit;
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::Window;

use crate::client::window::action::UserAction;
use crate::client::window::keys::KeyTable;
use crate::client::window::panel::{self, LoadingData, PanelControls, PanelData, PanelTools};

/// Longest interval between runs of the panel while it is visible.
const REFRESH: Duration = Duration::from_millis(200);

/// How long a message is shown over the picture.
const MESSAGE: Duration = Duration::from_secs(5);

/// Output of egui to draw.
#[derive(Default)]
pub struct PanelDrawing {
    /// Texture updates that have not been handed over yet.
    pub textures: egui::TexturesDelta,
    /// Triangles of the last run, in points.
    pub primitives: Vec<egui::ClippedPrimitive>,
    /// Physical pixels per point.
    pub pixels_per_point: f32,
}

impl Drop for PanelDrawing {
    /// egui reports textures that were dropped before they were handed over; that is expected if the window could not be drawn.
    fn drop(&mut self) {
        self.textures.clear();
    }
}

/// Event of the accessibility tree, sent to the event loop.
pub use accesskit_winit::Event as ReaderEvent;

/// egui in one window, which may not have been opened yet.
pub struct EguiHost {
    context: egui::Context,
    /// `None` until the window is open.
    state: Option<egui_winit::State>,
    drawing: PanelDrawing,
    /// Pointer position in points.
    pointer: Option<egui::Pos2>,
    /// Width that the dock leaves to the picture, points.
    picture_width: f32,
    /// Factor on the size of text.
    text_scale: f32,
    /// When egui must run next.
    due: Instant,
    /// The last message to the user, and when it disappears; `None` means when the next one arrives.
    message: Option<(String, Option<Instant>)>,
    /// Whether the message was drawn in the last run.
    message_drawn: bool,
}

impl Default for EguiHost {
    fn default() -> Self {
        Self {
            context: egui::Context::default(),
            state: None,
            drawing: PanelDrawing::default(),
            pointer: None,
            picture_width: f32::INFINITY,
            text_scale: 1.0,
            due: Instant::now(),
            message: None,
            message_drawn: false,
        }
    }
}

impl EguiHost {
    /// Attaches to this window, which is not visible yet. The accessibility tree is served through `proxy`; requests of screen readers
    /// arrive at [`hear_reader`](Self::hear_reader).
    pub fn open(&mut self, window: &Window, events: &ActiveEventLoop, proxy: EventLoopProxy<ReaderEvent>) {
        let (context, id) = (self.context.clone(), egui::ViewportId::ROOT);
        context.options_mut(|options| options.zoom_with_keyboard = false);
        let scale = Some(window.scale_factor() as f32);
        let mut state = egui_winit::State::new(context, id, window, scale, window.theme(), Some(4096));
        state.init_accesskit(events, window, proxy);
        self.state = Some(state);
        self.refresh();
    }

    /// Handles a request of a screen reader.
    pub fn hear_reader(&mut self, event: ReaderEvent) {
        match event.window_event {
            accesskit_winit::WindowEvent::InitialTreeRequested => self.context.enable_accesskit(),
            accesskit_winit::WindowEvent::ActionRequested(request) => {
                if let Some(state) = &mut self.state {
                    state.on_accesskit_action_request(request);
                }
            }
            accesskit_winit::WindowEvent::AccessibilityDeactivated => self.context.disable_accesskit(),
        }
        self.refresh();
    }

    /// Scales all text relative to the default size.
    pub fn scale_text(&mut self, factor: f32) {
        self.context.set_zoom_factor(factor);
        self.text_scale = factor;
        self.refresh();
    }

    /// Physical pixels per point in this window.
    pub fn pixels_per_point(&self, window: &Window) -> f32 {
        window.scale_factor() as f32 * self.text_scale
    }

    /// Passes an event to egui. Returns true if the panel has consumed it, so that the picture must not react. `active` is false while the
    /// panel is hidden or the picture is dragged: egui then receives only the events that keep its state valid. While a `modal` element
    /// such as a dialog is open, it receives all keys.
    pub fn on_event(&mut self, window: &Window, event: &WindowEvent, active: bool, modal: bool) -> bool {
        if keeps_state(event) {
            let _ = self.handle(window, event);
            return false; // None of these starts anything.
        }
        if matches!(event, WindowEvent::KeyboardInput { .. }) {
            // Without a widget that has the keyboard, egui would take Tab for moving its focus.
            // Escape closes what has popped up, such as a choice of colours, and nothing else.
            let modal = modal || active && egui::Popup::is_any_open(&self.context);
            let wanted = modal || active && self.context.egui_wants_keyboard_input();
            return wanted && (self.handle(window, event) || modal);
        }
        active && self.handle(window, event)
    }

    fn handle(&mut self, window: &Window, event: &WindowEvent) -> bool {
        match event {
            WindowEvent::CursorMoved { position, .. } => {
                let scale = f64::from(egui_winit::pixels_per_point(&self.context, window));
                let at = position.to_logical::<f32>(scale);
                self.pointer = Some(egui::pos2(at.x, at.y));
            }
            WindowEvent::CursorLeft { .. } => self.pointer = None,
            _ => {}
        }
        let Some(state) = &mut self.state else { return false };
        let response = state.on_window_event(window, event);
        if response.repaint {
            self.refresh();
        }
        // egui uses the pointer position of its last run, which may be long ago on a slow device.
        let pressed = matches!(event, WindowEvent::MouseInput { .. } | WindowEvent::MouseWheel { .. });
        response.consumed || (pressed && self.is_under_pointer())
    }

    /// Whether the pointer is over the dock, the list of keys or an open menu.
    pub fn is_under_pointer(&self) -> bool {
        let layer = self.pointer.and_then(|at| self.context.layer_id_at(at));
        layer.is_some_and(|layer| layer.order != egui::Order::Background)
            || self.pointer.is_some_and(|at| at.x >= self.picture_width)
    }

    /// Copies text to the clipboard.
    pub fn copy(&mut self, text: String) {
        if let Some(state) = &mut self.state {
            state.set_clipboard_text(text);
        }
    }

    /// Shows a message over the picture for a while.
    pub fn say(&mut self, text: String) {
        self.message = Some((text, Some(Instant::now() + MESSAGE)));
        self.refresh();
    }

    /// Shows a message until the next one arrives.
    pub fn pin(&mut self, text: String) {
        if self.message.as_ref().is_none_or(|(known, until)| *known != text || until.is_some()) {
            self.message = Some((text, None));
            self.refresh();
        }
    }

    /// The message shown over the picture now.
    pub fn message(&self, now: Instant) -> Option<&str> {
        let stands = |until: &Option<Instant>| until.is_none_or(|until| now < until);
        self.message.as_ref().filter(|(_, until)| stands(until)).map(|(text, _)| text.as_str())
    }

    /// Whether a message must be drawn, or was drawn last time and must be removed.
    pub fn has_message(&self) -> bool {
        self.message_drawn || self.message(Instant::now()).is_some()
    }

    /// Requests a run of the panel.
    pub fn refresh(&mut self) {
        self.due = Instant::now();
    }

    /// When egui must run next.
    pub fn due(&self) -> Instant {
        self.due
    }

    /// Runs the panel; returns the actions that the user asks for in the dock and in the palette.
    pub fn run<T: Clone>(
        &mut self,
        window: &Window,
        data: &PanelData,
        controls: &mut PanelControls,
        tools: &mut dyn PanelTools,
        keys: &KeyTable<T>,
    ) -> Vec<UserAction<T>> {
        self.message_drawn = data.message.is_some();
        let mut actions = Vec::new();
        self.draw(window, |ui| actions.extend(panel::show(ui, data, controls, tools, keys)));
        let width = self.context.content_rect().width();
        self.picture_width = width - controls.layout.width_in(width);
        actions
    }

    /// Runs the loading screen.
    pub fn run_loading(&mut self, window: &Window, data: &LoadingData) {
        self.draw(window, |ui| panel::show_loading(ui, data));
    }

    fn draw(&mut self, window: &Window, contents: impl FnMut(&mut egui::Ui)) {
        let Some(state) = &mut self.state else { return };
        let input = state.take_egui_input(window);
        let output = self.context.run_ui(input, contents);
        state.handle_platform_output(window, output.platform_output);
        self.drawing.textures.append(output.textures_delta);
        self.drawing.primitives = self.context.tessellate(output.shapes, output.pixels_per_point);
        self.drawing.pixels_per_point = output.pixels_per_point;
        let delay = output.viewport_output.values().map(|v| v.repaint_delay).min().unwrap_or(REFRESH);
        self.due = Instant::now() + delay.min(REFRESH);
    }

    /// The drawing of the last run.
    pub fn drawing(&mut self) -> &mut PanelDrawing {
        &mut self.drawing
    }

    /// Physical pixels per point of the drawing; 1 before the first.
    pub fn drawing_scale(&self) -> f32 {
        let scale = self.drawing.pixels_per_point;
        if scale > 0.0 { scale } else { 1.0 }
    }
}

/// Whether egui must receive the event even if it does not concern the panel, so that its state of keys and scale stays valid.
fn keeps_state(event: &WindowEvent) -> bool {
    matches!(
        event,
        WindowEvent::ScaleFactorChanged { .. }
            | WindowEvent::ModifiersChanged(_)
            | WindowEvent::Focused(_)
            | WindowEvent::ThemeChanged(_)
            | WindowEvent::CursorLeft { .. }
            // A press on the picture reaches both; without the release egui would consider the button held.
            | WindowEvent::MouseInput { state: ElementState::Released, .. }
    )
}
