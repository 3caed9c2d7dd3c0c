//! Carries out the user's actions from mouse, keys and panel, or passes them on to the tools.

use std::time::{Duration, Instant};

use miette::Result;
use winit::window::Fullscreen;

use crate::client::window::action::{Action, UserAction};
use crate::client::window::navigation::Gesture;
use crate::client::window::panel::{PanelControls, PanelData, PictureView};
use crate::render::figures::human;
use crate::render::process::tell;
use crate::viewer::tools::{
    CameraAction, ExposureAction, FileAction, LookAroundAction, RegionAction, ToolAction, ToolContext, Tools,
};
use crate::viewer::{AskedPlace, Viewer, preferences};

/// A second request within this time after the warning discards unsaved changes.
const SURE: Duration = Duration::from_secs(10);

impl Viewer {
    /// Performs all actions queued since the last call and takes over results that other threads have finished.
    pub(super) fn act(&mut self) {
        if self.panel.take_settings_changed() {
            self.controls_changed();
        }
        self.take_prepared();
        for action in std::mem::take(&mut self.actions) {
            let camera = matches!(
                action,
                UserAction::Window(Action::Gesture(_) | Action::EndMove | Action::FocusAt(_))
            );
            match self.perform(action) {
                Ok(None) => {}
                Ok(Some(message)) => self.say(message),
                Err(error) => self.say(error.to_string()),
            }
            if self.panel.take_settings_changed() {
                self.controls_changed();
            }
            if !camera {
                self.refresh();
            }
        }
        self.note_tools();
    }

    /// Notes how much of the tools is visible.
    pub(super) fn note_tools(&mut self) {
        self.panel.tools = self.with_tools(None, |tools, context| tools.presence(context));
    }

    /// Performs an action; returns a message for the user.
    fn perform(&mut self, action: UserAction<ToolAction>) -> Result<Option<String>> {
        match action {
            UserAction::Window(Action::Pick(at)) if self.asked.is_some() => match self.asked.take() {
                Some(AskedPlace::Window(asked)) => self.perform_own(asked.at(at)),
                Some(AskedPlace::Tool(asked)) => self.perform(UserAction::ToolAt(asked, at)),
                None => Ok(None),
            },
            UserAction::AskPlace(asked) => {
                self.ask_place(AskedPlace::Tool(asked));
                Ok(None)
            }
            UserAction::Window(action) => self.perform_own(action),
            UserAction::Tool(action) => self.use_tool(action),
            UserAction::ToolAt(action, at) => {
                self.with_tools(Some(at), |tools, context| tools.perform(action, context))
            }
        }
    }

    /// Performs an action of a tool; returns a message for the user.
    fn use_tool(&mut self, action: ToolAction) -> Result<Option<String>> {
        self.with_tools(None, |tools, context| tools.perform(action, context))
    }

    fn ask_place(&mut self, asked: AskedPlace) {
        self.asked = Some(asked);
        self.panel.host.pin("Click the place in the picture; Escape leaves it".to_owned());
    }

    /// Lets the tools use the window. `at`: position of the window that an action is about.
    pub(super) fn with_tools<R>(
        &mut self,
        at: Option<[f64; 2]>,
        act: impl FnOnce(&mut Tools, &mut ToolContext<'_>) -> R,
    ) -> R {
        let rests_for_pictures = self.rests_for_pictures();
        let Self { session, picture, editor, panel, metrics, preferences, options, paused, tools, .. } = self;
        let mut context = ToolContext {
            session,
            picture,
            editor,
            panel,
            metrics,
            preferences,
            options,
            paused,
            rests_for_pictures,
            at,
            asks_place: self.asked.is_some(),
            has_edited: false,
            redraws: false,
            opens: None,
            asks_room: None,
        };
        let result = act(tools, &mut context);
        let ToolContext { has_edited, redraws, opens, asks_room, .. } = context;
        if has_edited {
            self.edited();
        }
        if redraws {
            self.refresh();
        }
        if let Some(size) = asks_room {
            self.ask_room(size);
        }
        if let Some(path) = opens
            && self.may_discard("opening another scene")
        {
            self.open_file(path);
        }
        result
    }

    /// Performs an action of the window itself; returns a message for the user.
    fn perform_own(&mut self, action: Action) -> Result<Option<String>> {
        match action {
            Action::Gesture(gesture) => self.gesture(gesture),
            Action::EndMove => self.editor.end_change(),
            Action::Pick(at) => self.pick(at)?,
            Action::AskPlace(asked) => self.ask_place(AskedPlace::Window(asked)),
            Action::FocusAt(at) => {
                return self.perform(UserAction::ToolAt(ToolAction::Camera(CameraAction::LookAt), at));
            }
            Action::Expose(steps) => return self.use_tool(ToolAction::Exposure(ExposureAction::Step(steps))),
            Action::DragRegion(places) => {
                return self.use_tool(ToolAction::Region(RegionAction::Drag(places)));
            }
            Action::TraceRegion(places) => {
                return self.use_tool(ToolAction::Region(RegionAction::Trace(places)));
            }
            Action::Undo => return self.undo(),
            Action::Redo => return self.redo(),
            Action::StartOver => return self.start_over(),
            Action::SaveExr => return self.use_tool(ToolAction::Files(FileAction::SaveExr)),
            Action::SaveDialog => return self.use_tool(ToolAction::Files(FileAction::AskName)),
            Action::OpenDialog => return self.use_tool(ToolAction::Files(FileAction::AskScene)),
            Action::ZoomAt(at, steps) => _ = self.panel.viewport.zoom_at(at.into(), steps),
            Action::TurnView(by) => return self.use_tool(ToolAction::LookAround(LookAroundAction::Turn(by))),
            Action::WidenView(by) => {
                return self.use_tool(ToolAction::LookAround(LookAroundAction::Widen(by)));
            }
            Action::PanView(by) => _ = self.panel.viewport.pan(by.into()),
            Action::ResetView => _ = self.panel.viewport.reset(),
            Action::ShowPixels(at) => _ = self.panel.viewport.show_pixels(at.into()),
            Action::SetPictureSize(wanted) => return Ok(self.change_picture_size(wanted)),
            Action::FillWindow => {
                let wanted = self.picture_area().unwrap_or(self.session.size());
                return Ok(self.change_picture_size(wanted));
            }
            Action::TogglePause => return Ok(self.toggle_pause()),
            Action::ToggleFullscreen => self.toggle_fullscreen(),
            Action::ScaleText(steps) => self.scale_text(steps),
            Action::ShowTab(tab) => self.open_panel().layout.bring(tab),
            Action::EnterPanel => self.open_panel().enters = true,
            Action::TogglePalette => self.panel.controls.palette.toggle(),
            Action::TogglePanel => self.toggle_panel(),
            Action::ToggleHelp => self.panel.controls.help ^= true,
            Action::Cancel => return self.cancel(),
            Action::Quit => self.quit = self.may_discard("closing the window"),
        }
        Ok(None)
    }

    /// Tells the tools of a click in the picture; a click beside it clears the selection.
    fn pick(&mut self, at: [f64; 2]) -> Result<()> {
        match self.panel.on_picture(at) {
            Ok(place) => {
                let place = place.in_left_eye(&self.editor, self.session.size());
                self.with_tools(None, |tools, context| tools.click(place.picture.to_array(), context))
            }
            Err(_) => {
                self.editor.select(None);
                Ok(())
            }
        }
    }

    fn undo(&mut self) -> Result<Option<String>> {
        let undone = self.editor.undo().map(|change| format!("Undo {change}"));
        self.restored().map(|()| undone)
    }

    fn redo(&mut self) -> Result<Option<String>> {
        let redone = self.editor.redo().map(|change| format!("Redo {change}"));
        self.restored().map(|()| redone)
    }

    /// Returns to everything as it was opened; returns a message. Changes of the scene can be undone, those of the display cannot.
    fn start_over(&mut self) -> Result<Option<String>> {
        if self.picture.mix.is_on() {
            self.session.set_light_groups(Vec::new())?;
            self.picture.mix.end();
        }
        self.panel.start_over(self.options.controls.clone());
        self.tools.look_around.begin_anew();
        self.editor.start_over();
        let size = self.session.start_over();
        self.set_picture_size(size);
        self.ask_room(size);
        self.restored()?;
        self.with_tools(None, |tools, context| tools.stereo.start_over(context))?;
        Ok(Some("everything is as it was opened; Ctrl+Z brings changes of the scene back".to_owned()))
    }

    /// Pauses or resumes; returns a message.
    fn toggle_pause(&mut self) -> Option<String> {
        if self.paused.is_some() {
            self.go_on();
            return None;
        }
        self.paused = Some(Instant::now());
        Some("paused: Space goes on, and so does every change".to_owned())
    }

    fn scale_text(&mut self, steps: i8) {
        let layout = &mut self.panel.controls.layout;
        layout.font_scale = preferences::scaled(layout.font_scale, steps);
        self.panel.host.scale_text(layout.font_scale);
        self.keep_picture();
    }

    /// Opens the dock; returns the controls in it.
    fn open_panel(&mut self) -> &mut PanelControls {
        if !self.panel.controls.layout.is_open {
            self.toggle_panel();
        }
        &mut self.panel.controls
    }

    /// Leaves what was begun; if nothing was, closes the list of keys, or releases the region, or else clears the selection.
    fn cancel(&mut self) -> Result<Option<String>> {
        let drags = self.panel.input.asks_region() || self.tools.region.stop_drag();
        let asked = self.asked.take().is_some() || drags;
        self.panel.input.cancel_region();
        if asked {
            self.panel.host.say("nothing was done".to_owned());
        } else if std::mem::take(&mut self.panel.controls.help) {
            return Ok(None);
        } else if self.session.is_in_region() {
            return self.use_tool(ToolAction::Region(RegionAction::Release));
        } else {
            self.editor.select(None);
        }
        Ok(None)
    }

    /// Changes the size of the picture; returns a message for the user.
    fn change_picture_size(&mut self, size @ [width, height]: [u32; 2]) -> Option<String> {
        if size == self.session.size() {
            return Some(format!("the picture has {width}×{height} pixels"));
        }
        let (was_stale, samples) = (self.session.is_stale(), self.picture.counts().samples());
        self.set_picture_size(size);
        let begins_anew = self.session.is_stale() && !was_stale && self.session.size() == size;
        begins_anew.then(|| {
            let samples = human(samples as f64);
            format!("a picture of {width}×{height} pixels begins anew, without the {samples} samples of the one before")
        })
    }

    /// Whether unsaved changes may be discarded: if there are any, the user has to ask twice.
    pub(super) fn may_discard(&mut self, by: &str) -> bool {
        let warned = self.warned.take().is_some_and(|at| at.elapsed() < SURE);
        if warned || !self.editor.has_unsaved_changes() {
            return true;
        }
        self.warned = Some(Instant::now());
        self.say(format!(
            "the scene has changes that are not saved (Ctrl+S saves them): {by} again loses them"
        ));
        false
    }

    fn toggle_fullscreen(&mut self) {
        let Some(screen) = &self.picture.screen else { return };
        let fullscreen = screen.window.fullscreen().is_none().then_some(Fullscreen::Borderless(None));
        screen.window.set_fullscreen(fullscreen);
    }

    /// Moves the camera.
    pub(super) fn gesture(&mut self, gesture: Gesture) {
        if self.editor.gesture(gesture, self.session.size()) {
            self.edited();
        }
    }

    /// Applies the edit state that undo or redo has selected.
    fn restored(&mut self) -> Result<()> {
        self.editor.follow()?;
        self.session.set_effects(&self.editor);
        self.edited();
        Ok(())
    }

    /// Shows the changed scene that another thread has prepared, if it is ready.
    fn take_prepared(&mut self) {
        if !self.editor.is_preparing() {
            return;
        }
        match self.editor.follow() {
            Ok(false) => {}
            Ok(true) => {
                self.session.set_effects(&self.editor);
                self.edited();
                self.refresh();
            }
            Err(error) => self.say(error.to_string()),
        }
    }

    /// What the panel shows, with the readings of the tools.
    pub(super) fn panel_data(&mut self, now: Instant) -> PanelData {
        let Self { editor, panel, .. } = self;
        let mut data = PanelData {
            extent: self.session.size(),
            view: PictureView { viewport: panel.viewport, pixels_per_point: panel.host.drawing_scale() },
            message: panel.host.message(now).map(str::to_owned),
            undo: editor.undo_name().map(str::to_owned),
            redo: editor.redo_name().map(str::to_owned),
            ..PanelData::default()
        };
        self.with_tools(None, |tools, context| tools.update(context, &mut data));
        data
    }

    /// Draws the window anew, with the panel.
    pub(super) fn refresh(&mut self) {
        self.picture.request_show();
        self.clock.hasten(Instant::now() + self.picture.budget());
        self.panel.host.refresh();
    }

    /// Tells the user in the panel, and on standard error.
    pub(super) fn say(&mut self, message: String) {
        tell(&message);
        self.panel.host.say(message);
    }
}
