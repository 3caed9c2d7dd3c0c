//! Carries out the user's actions from mouse, keys and panel: camera moves, selection, edits, files.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result, miette};
use winit::window::Fullscreen;

use crate::client::window::action::{Action, UserAction};
use crate::client::window::navigation::Gesture;
use crate::client::window::panel::{PanelData, PanelTab};
use crate::render::figures::human;
use crate::render::process;
use crate::render::process::tell;
use crate::viewer::tools::{ExposureAction, RegionAction, ToolAction, ToolContext, Tools};
use crate::viewer::{AskedPlace, Viewer, preferences};

/// A second request within this time after the warning discards unsaved changes.
const SURE: Duration = Duration::from_secs(10);

/// File extensions that can be opened.
const SCENES: [&str; 9] = ["xml", "gltf", "glb", "usd", "usda", "usdc", "usdz", "obj", "ply"];

/// What can be saved, and its file extensions.
const SAVED: [(&str, &str); 3] =
    [("Displayed picture", "png"), ("Linear picture", "exr"), ("Changed scene", "xml")];

impl Viewer {
    /// Performs all actions queued since the last call and takes over results that other threads have finished.
    pub(super) fn act(&mut self) {
        if self.panel.take_settings_changed() {
            self.controls_changed();
        }
        for message in self.saves.done() {
            self.say(message);
        }
        if process::take_snapshot_request()
            && let Err(error) = self.save_picture("png")
        {
            self.say(error.to_string());
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
            UserAction::Window(Action::AskPlace(asked)) => {
                self.ask_place(AskedPlace::Window(asked));
                Ok(None)
            }
            UserAction::AskPlace(asked) => {
                self.ask_place(AskedPlace::Tool(asked));
                Ok(None)
            }
            UserAction::Window(action) => self.perform_own(action),
            UserAction::Tool(action) => {
                self.with_tools(None, |tools, context| tools.perform(action, context))
            }
            UserAction::ToolAt(action, at) => {
                self.with_tools(Some(at), |tools, context| tools.perform(action, context))
            }
        }
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
        let Self { session, picture, editor, panel, paused, tools, .. } = self;
        let (asks_place, has_edited, redraws) = (self.asked.is_some(), false, false);
        let mut context =
            ToolContext { session, picture, editor, panel, paused, at, asks_place, has_edited, redraws };
        let result = act(tools, &mut context);
        let (has_edited, redraws) = (context.has_edited, context.redraws);
        if has_edited {
            self.edited();
        }
        if redraws {
            self.refresh();
        }
        result
    }

    /// Performs an action of the window itself; returns a message for the user.
    fn perform_own(&mut self, action: Action) -> Result<Option<String>> {
        let size = self.session.size();
        match action {
            Action::Gesture(gesture) => self.gesture(gesture),
            Action::EndMove => self.editor.end_change(),
            // Asked for in `perform`.
            Action::AskPlace(_) => {}
            Action::FocusLensAt(at) => {
                let Some(pick) = self.editor.pick(self.panel.on_picture(at)?, size) else {
                    return Err(miette!("there is nothing here to focus on"));
                };
                if self.editor.focus_at(pick.position)? {
                    self.edited();
                }
                return Ok(Some("focused".to_owned()));
            }
            Action::Pick(at) => {
                let place = self.panel.on_picture(at).ok();
                let pick = place.and_then(|place| self.editor.pick(place, size));
                self.editor.select(pick.map(|pick| pick.shape));
                let layout = &self.panel.controls.layout;
                let hint =
                    layout.is_open && !layout.shows(PanelTab::Scene) && !layout.shows(PanelTab::Inspect);
                if let Some(selection) =
                    self.editor.selection().filter(|selection| hint && selection.selected)
                {
                    self.panel.host.say(format!("{} is selected: the tab Scene changes it", selection.name));
                }
                if let Some(place) = place {
                    self.with_tools(None, |tools, context| tools.click(place, context))?;
                }
            }
            Action::FocusAt(at) => {
                if let Some(pick) = self.editor.pick(self.panel.on_picture(at)?, size) {
                    self.editor.end_change();
                    self.gesture(Gesture::Focus(pick.position));
                    self.editor.end_change();
                }
            }
            Action::DragRegion(places) => return self.perform_region(RegionAction::Drag(places)),
            Action::TraceRegion(places) => return self.perform_region(RegionAction::Trace(places)),
            Action::Deselect => self.editor.select(None),
            Action::Undo => {
                let undone = self.editor.undo().map(|change| format!("Undo {change}"));
                return self.restored().map(|()| undone);
            }
            Action::Redo => {
                let redone = self.editor.redo().map(|change| format!("Redo {change}"));
                return self.restored().map(|()| redone);
            }
            Action::ResetCamera => {
                if self.editor.reset_camera() {
                    self.edited();
                }
            }
            Action::SetFov(fov) => {
                if self.editor.set_fov(fov) {
                    self.edited();
                }
            }
            Action::Edit { index, value } => {
                if self.editor.edit(index, value)? {
                    self.edited();
                }
            }
            Action::SetMethod(name) => {
                if self.session.set_method(name) {
                    self.edited();
                }
            }
            Action::SavePng => self.save_picture("png")?,
            Action::SaveExr => self.save_picture("exr")?,
            Action::SaveScene => {
                let mix = if self.picture.mix.is_mixing() { ", without the light mix" } else { "" };
                return self.save_scene().map(|path| Some(format!("saved {}{mix}", path.display())));
            }
            Action::CopyCommand => return self.copy_command().map(Some),
            Action::Expose(steps) => {
                return self.perform(UserAction::Tool(ToolAction::Exposure(ExposureAction::Step(steps))));
            }
            Action::ZoomAt(at, steps) => _ = self.panel.viewport.zoom_at(at.into(), steps),
            Action::PanView(by) => _ = self.panel.viewport.pan(by.into()),
            Action::ResetView => _ = self.panel.viewport.reset(),
            Action::ShowPixels(at) => _ = self.panel.viewport.show_pixels(at.into()),
            Action::SetPictureSize(wanted) => return Ok(self.change_picture_size(wanted)),
            Action::FillWindow => {
                let wanted = self.picture_area().unwrap_or(size);
                return Ok(self.change_picture_size(wanted));
            }
            Action::OpenDialog => {
                let folder = self.scene_folder();
                let dialog = &mut self.panel.controls.open_dialog;
                dialog.ask_file("Open a scene or a model", &folder, ("Scenes and models", &SCENES));
            }
            Action::Open(path) => {
                if self.may_discard("opening another scene") {
                    self.open_file(path);
                }
            }
            Action::SaveDialog => {
                let name = format!("{}.png", self.options.name);
                let folder = std::env::current_dir().into_diagnostic()?;
                let title = "Save as picture (.png, .exr) or scene (.xml)";
                self.panel.controls.save_dialog.ask_name(title, &folder, &name, &SAVED);
            }
            Action::SaveAs(path) => return self.save_as(path),
            Action::TogglePause if self.paused.is_some() => self.go_on(),
            Action::TogglePause => {
                self.paused = Some(Instant::now());
                return Ok(Some("paused: Space goes on, and so does every change".to_owned()));
            }
            Action::ToggleFullscreen => self.toggle_fullscreen(),
            Action::ScaleText(steps) => {
                let layout = &mut self.panel.controls.layout;
                layout.font_scale = preferences::scaled(layout.font_scale, steps);
                self.panel.host.scale_text(layout.font_scale);
                self.keep_picture();
            }
            Action::ShowTab(tab) => {
                if !self.panel.controls.layout.is_open {
                    self.toggle_panel();
                }
                self.panel.controls.layout.bring(tab);
            }
            Action::EnterPanel => {
                if !self.panel.controls.layout.is_open {
                    self.toggle_panel();
                }
                self.panel.controls.enters = true;
            }
            Action::TogglePalette => self.panel.controls.palette.toggle(),
            Action::TogglePanel => self.toggle_panel(),
            Action::ToggleHelp => self.panel.controls.help ^= true,
            Action::Cancel => {
                let drags = self.panel.input.asks_region() || self.tools.region.stop_drag();
                let asked = self.asked.take().is_some() || drags;
                self.panel.input.cancel_region();
                if asked {
                    self.panel.host.say("nothing was done".to_owned());
                }
                if !asked && !std::mem::take(&mut self.panel.controls.help) {
                    if self.session.is_in_region() {
                        return self.perform_region(RegionAction::Release);
                    }
                    self.editor.select(None);
                }
            }
            Action::Quit => self.quit = self.may_discard("closing the window"),
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

    fn perform_region(&mut self, action: RegionAction) -> Result<Option<String>> {
        self.perform(UserAction::Tool(ToolAction::Region(action)))
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

    /// The folder of the open scene.
    fn scene_folder(&self) -> PathBuf {
        let scene = &self.source.args.scene;
        let folder = scene.canonicalize().ok().and_then(|scene| scene.parent().map(Path::to_path_buf));
        folder.unwrap_or_else(|| PathBuf::from("."))
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
        let Self { session, picture, editor, metrics, panel, .. } = self;
        let mut data = panel.data(session, picture, editor, metrics, now);
        (data.undo, data.redo) =
            (editor.undo_name().map(str::to_owned), editor.redo_name().map(str::to_owned));
        data.recent = self.preferences.recent.clone();
        data.is_paused = self.paused.is_some();
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
