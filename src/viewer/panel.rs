//! The panel of the viewer: egui, mouse and keyboard input, and display controls.

use std::time::Instant;

use glam::DVec2;
use miette::{Result, miette};
use winit::event::WindowEvent;
use winit::window::Window;

use crate::client::Settings;
use crate::client::window::action::UserAction;
use crate::client::window::host::{EguiHost, PanelDrawing};
use crate::client::window::input::{InputEvent, InputState};
use crate::client::window::keys::KeyTable;
use crate::client::window::panel::{PanelControls, PanelData, PanelTools, ToolPresence};
use crate::client::window::viewport::{GRID_ZOOM, Viewport};
use crate::image::stereo::{Eye, StereoLayout};
use crate::render::effect_plan::{self, PlannedEffect};
use crate::viewer::editor::SceneEditor;
use crate::viewer::session::RenderSession;

/// Place under the cursor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CursorPlace {
    /// The eye whose picture it is in; the left one where there is one eye.
    pub eye: Eye,
    /// Pixels of what is displayed of this eye.
    pub shown: DVec2,
    /// Pixels of the picture: another place where a view into a panorama is displayed.
    pub picture: DVec2,
}

impl CursorPlace {
    /// What is seen there, in the left eye's picture of this size.
    pub fn in_left_eye(self, editor: &SceneEditor, size: [u32; 2]) -> Self {
        if self.eye == Eye::Left {
            return self;
        }
        let place = editor.in_left_eye((self.eye, self.picture.to_array()), size).into();
        Self { eye: Eye::Left, shown: place, picture: place }
    }
}

/// The panel, and what the user does with mouse and keys.
pub struct ViewerPanel {
    /// egui, which draws the panel.
    pub host: EguiHost,
    /// The display controls.
    pub controls: PanelControls,
    /// Mouse and keys.
    pub input: InputState,
    /// Which part of the picture is shown, and where.
    pub viewport: Viewport,
    /// The display controls have changed since the last frame.
    settings_changed: bool,
    /// How much of the tools is visible outside of the dock.
    pub tools: ToolPresence,
}

impl ViewerPanel {
    /// A panel beside a picture of this size.
    pub fn new(host: EguiHost, controls: PanelControls, size: [u32; 2]) -> Self {
        Self {
            host,
            controls,
            input: InputState::new(size),
            viewport: Viewport::new(size),
            settings_changed: false,
            tools: ToolPresence::Hidden,
        }
    }

    /// Handles a window event; returns the user's actions.
    pub fn on_event<T: Clone>(
        &mut self,
        window: &Window,
        event: &WindowEvent,
        keys: &KeyTable<T>,
    ) -> Vec<UserAction<T>> {
        let active = self.is_interactive() && !self.input.is_dragging();
        let modal = self.controls.palette.is_open || self.tools == ToolPresence::Modal;
        let taken = self.host.on_event(window, event, active, modal);
        self.input.set_looks_around(self.looks_around());
        self.input.on_window_event(event, taken, keys)
    }

    /// Whether a view into a panorama is displayed in its place.
    pub fn looks_around(&self) -> bool {
        self.controls.settings.look_around().is_some()
    }

    /// Whether the display controls have changed since the last call.
    pub fn take_settings_changed(&mut self) -> bool {
        std::mem::take(&mut self.settings_changed)
    }

    /// Changes the display settings.
    pub fn change_settings(&mut self, change: impl FnOnce(&mut Settings)) {
        change(&mut self.controls.settings);
        self.settings_changed = true;
    }

    /// Returns to these controls, and shows the whole picture.
    pub fn start_over(&mut self, controls: PanelControls) {
        self.host.scale_text(controls.layout.font_scale);
        self.controls = controls;
        self.viewport.reset();
        self.settings_changed = true;
    }

    /// Whether any visible part of the panel reacts to input.
    fn is_interactive(&self) -> bool {
        let controls = &self.controls;
        let is_open = controls.layout.is_open || controls.help || controls.palette.is_open;
        is_open || self.tools >= ToolPresence::Interactive
    }

    /// Whether egui draws anything: dock, key list, palette, map, message or the grid between magnified pixels.
    fn has_overlay(&self) -> bool {
        self.is_interactive()
            || self.host.has_message()
            || self.tools >= ToolPresence::Drawn
            || !self.viewport.is_whole()
            || self.viewport.zoom() >= GRID_ZOOM
    }

    /// Extent that the dock leaves to the picture in a window of this extent, physical pixels.
    pub fn picture_area(&self, window: &Window, [width, height]: [u32; 2]) -> [u32; 2] {
        let scale = self.host.pixels_per_point(window);
        let dock = self.controls.layout.width_in(width as f32 / scale) * scale;
        [width.saturating_sub(dock.round() as u32).max(1), height]
    }

    /// Width of the dock in physical pixels; 0 if closed.
    pub fn dock_pixels(&self, window: &Window) -> u32 {
        let layout = &self.controls.layout;
        if layout.is_open { (layout.width * self.host.pixels_per_point(window)).round() as u32 } else { 0 }
    }

    /// Sets the window area and the size of the picture, and takes over the view into a panorama from the display settings. With a layout the
    /// picture is composed of two of this size.
    pub fn set_sizes(&mut self, area: [u32; 2], picture: [u32; 2], layout: Option<StereoLayout>) {
        self.viewport.set_look_around(self.controls.settings.look_around());
        self.viewport.set_sizes_of_eyes(area, picture, layout);
        let shown = self.viewport.zoom() * self.viewport.eye();
        self.input.respond(InputEvent::Size(self.viewport.area(), shown), Instant::now());
    }

    /// When egui must run next; `None` while nothing is visible.
    pub fn next_run(&self) -> Option<Instant> {
        self.has_overlay().then(|| self.host.due())
    }

    /// Whether egui must run now.
    pub fn is_due(&self, now: Instant) -> bool {
        self.next_run().is_some_and(|due| now >= due)
    }

    /// Runs the panel; returns the actions that the user asks for in the dock and in the palette.
    pub fn run<T: Clone>(
        &mut self,
        window: &Window,
        data: &PanelData,
        tools: &mut dyn PanelTools,
        keys: &KeyTable<T>,
    ) -> Vec<UserAction<T>> {
        let before = (self.controls.settings.clone(), self.controls.filter);
        let actions = self.host.run(window, data, &mut self.controls, tools, keys);
        self.settings_changed |= before != (self.controls.settings.clone(), self.controls.filter);
        actions
    }

    /// Display settings, viewport and overlay, to draw a frame.
    pub fn shown(&mut self) -> (&Settings, &Viewport, Option<&mut PanelDrawing>) {
        let drawn = self.has_overlay();
        (&self.controls.settings, &self.viewport, drawn.then(|| self.host.drawing()))
    }

    /// Every effect of tracer and display, on or off, and why.
    pub fn plan(&self, session: &RenderSession, editor: &SceneEditor) -> Vec<PlannedEffect> {
        effect_plan::plan(editor.desc(), session.run_spec(), &self.controls.settings)
    }

    /// Window points per picture pixel.
    pub fn points_per_pixel(&self) -> f64 {
        self.viewport.zoom() / f64::from(self.host.drawing_scale())
    }

    /// Place under the cursor, while that is over the picture.
    pub fn cursor(&self) -> Option<CursorPlace> {
        self.input.cursor().and_then(|at| self.place(at))
    }

    /// Place at a window position.
    ///
    /// # Errors
    ///
    /// If it lies outside of the picture.
    pub fn on_picture(&self, at: [f64; 2]) -> Result<CursorPlace> {
        self.place(at.into()).ok_or_else(|| miette!("there is no picture here"))
    }

    fn place(&self, at: DVec2) -> Option<CursorPlace> {
        let (eye, shown) = self.viewport.place_of_eye(at)?;
        let picture = if self.viewport.is_flat() { shown } else { self.viewport.to_picture(at) };
        Some(CursorPlace { eye, shown, picture })
    }
}
