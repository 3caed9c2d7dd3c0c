//! The panel of the viewer: egui, mouse and keyboard input, display controls, list of effects, and the displayed data.

use std::time::{Duration, Instant};

use glam::DVec2;
use miette::{Result, miette};
use winit::event::WindowEvent;
use winit::window::Window;

use crate::client::Settings;
use crate::client::lod::level_of_detail;
use crate::client::window::action::UserAction;
use crate::client::window::host::{EguiHost, PanelDrawing};
use crate::client::window::input::{InputEvent, InputState};
use crate::client::window::keys::KeyTable;
use crate::client::window::panel::{
    ErrorSummary, PanelControls, PanelData, PanelTools, PictureView, RejectedList, RejectedRow, ToolPresence,
    TracerRow,
};
use crate::client::window::viewport::{GRID_ZOOM, Viewport};
use crate::remote::{Health, TracerStatus};
use crate::render::effect_plan::{self, PlannedEffect};
use crate::render::rejected::RejectedExample;
use crate::scene::desc::IntegratorKind;
use crate::study::{ErrorQuantile, ErrorTarget};
use crate::viewer::editor::SceneEditor;
use crate::viewer::maps;
use crate::viewer::metrics::ViewerMetrics;
use crate::viewer::picture::LivePicture;
use crate::viewer::screen::Screen;
use crate::viewer::session::RenderSession;

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
        let modal = self.controls.is_modal() || self.tools == ToolPresence::Modal;
        let taken = self.host.on_event(window, event, active, modal);
        self.input.on_window_event(event, taken, keys)
    }

    /// Error target chosen by the user.
    pub fn target(&self) -> ErrorTarget {
        ErrorTarget { error: self.controls.target, at: ErrorQuantile::P95 }
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

    /// Whether any visible part of the panel reacts to input.
    fn is_interactive(&self) -> bool {
        let controls = &self.controls;
        let is_open = controls.layout.is_open || controls.help || controls.is_modal();
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

    /// Sets the window area and the size of the picture.
    pub fn set_sizes(&mut self, area: [u32; 2], picture: [u32; 2]) {
        self.viewport.set_sizes(area, picture);
        let shown = self.viewport.zoom() * self.viewport.picture();
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

    /// Runs the panel; returns the user's actions but for those of the tools.
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

    /// Cursor position in pixels of the picture, while over it.
    pub fn cursor(&self) -> Option<DVec2> {
        let at = self.input.cursor().filter(|at| self.viewport.contains(*at))?;
        Some(self.viewport.to_picture(at))
    }

    /// Picture coordinates, in pixels, of a window position.
    ///
    /// # Errors
    ///
    /// If it lies outside of the picture.
    pub fn on_picture(&self, at: [f64; 2]) -> Result<[f64; 2]> {
        if !self.viewport.contains(at.into()) {
            return Err(miette!("there is no picture here"));
        }
        Ok(self.viewport.to_picture(at.into()).to_array())
    }

    /// Gathers the data of the panel, except that of the tools.
    pub fn data(
        &self,
        session: &RenderSession,
        picture: &LivePicture,
        editor: &SceneEditor,
        metrics: &mut ViewerMetrics,
        now: Instant,
    ) -> PanelData {
        let (run, counts) = (session.run_spec(), picture.counts());
        let rates = metrics.rates(session.traced(), picture.rasterised);
        let latency = |milliseconds| Duration::try_from_secs_f32(milliseconds * 1e-3).unwrap_or_default();
        let last_edit = metrics.recent_edits.last();
        let device = picture.screen.as_ref().and_then(Screen::gpu).map(|gpu| gpu.info().clone());
        PanelData {
            device: device.map_or(String::new(), |d| match d.driver.contains(&d.name) {
                true => d.driver,
                false => format!("{} ({})", d.name, d.driver),
            }),
            plan: session.processor_sharing.clone(),
            method: run.integrator.name(),
            methods: IntegratorKind::candidates().map(IntegratorKind::name).collect(),
            chooses_method: session.chooses_method(),
            reason: run.auto.as_ref().map_or(String::new(), |chosen| chosen.reason.clone()),
            extent: session.size(),
            view: PictureView { viewport: self.viewport, pixels_per_point: self.host.drawing_scale() },
            detail: picture.detail(),
            counts,
            traced_per_second: rates.traced,
            rasterised_per_second: rates.rasterised,
            drawing: rates.drawing,
            lods: [counts.camera_samples, counts.light_samples].map(|n| level_of_detail(&run.film, n)),
            ring: session.fill(),
            passes: metrics.passes.clone(),
            frames: metrics.intervals.iter().collect(),
            percentiles: metrics.intervals.percentiles([50.0, 95.0, 99.0]),
            budget: picture.budget(),
            edit_latency: last_edit.map(latency),
            edit_latency_p95: last_edit.map(|_| latency(metrics.recent_edits.percentiles([95.0])[0])),
            threads: session.tracers.threads(),
            tracers: session.tracers.status().into_iter().map(tracer_row).collect(),
            elapsed: session.elapsed(),
            message: self.host.message(now).map(str::to_owned),
            selection: editor.selection(),
            error: picture.present_observer().map(|observer| {
                if picture.mix.is_mixing() {
                    let message = "not known of a mix of lights".to_owned();
                    return ErrorSummary { message, ..ErrorSummary::default() }.into();
                }
                let filtered = picture.filtered_error(run, &self.controls.settings);
                let target = self.controls.target;
                maps::error_summary(observer, run, target, session.is_through(), filtered).into()
            }),
            left_out: run.left_out().collect(),
            rejected: rejected(session, editor),
            ..PanelData::default()
        }
    }
}

/// Panel row of a remote tracer.
fn tracer_row(status: TracerStatus) -> TracerRow {
    let TracerStatus { address, health, words, .. } = status;
    TracerRow { address, words, ill: health == Health::Ill }
}

/// Rejected values, for the panel.
fn rejected(session: &RenderSession, editor: &SceneEditor) -> RejectedList {
    let report = session.rejected(editor);
    let row = |example: RejectedExample| RejectedRow {
        what: format!("path {}: {}", example.index, example.what),
        command: example.replay,
    };
    RejectedList { total: report.total, rows: report.examples.into_iter().map(row).collect() }
}
