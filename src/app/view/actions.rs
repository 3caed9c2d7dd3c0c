//! What the user asks for with mouse, keys or the panel: camera moves, selection, edits, files.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use miette::Result;

use crate::app::run_spec::{RunSpec, display_options};
use crate::app::tell;
use crate::app::view::Viewer;
use crate::app::view::screen::Screen;
use crate::client::Settings;
use crate::client::window::action::Action;
use crate::client::window::navigation::Gesture;
use crate::tracer::effects::Effect;

impl Viewer {
    /// Does what was asked for, and takes over what other threads have finished, since the last call.
    pub(super) fn act(&mut self) {
        if self.panel.take_settings_changed() {
            self.controls_changed();
        }
        if self.panel.take_costs() {
            self.refresh();
        }
        for message in self.saves.done() {
            self.say(message);
        }
        self.take_prepared();
        for action in self.panel.take_actions() {
            let camera = matches!(action, Action::Gesture(_) | Action::EndMove | Action::FocusAt(_));
            match self.perform(action) {
                Ok(None) => {}
                Ok(Some(message)) => self.say(message),
                Err(error) => self.say(error.to_string()),
            }
            if !camera {
                self.refresh();
            }
        }
    }

    /// Performs one action; returns a message for the user.
    fn perform(&mut self, action: Action) -> Result<Option<String>> {
        let size = self.session.size();
        match action {
            Action::Gesture(gesture) => self.gesture(gesture),
            Action::EndMove => self.editor.end_change(),
            Action::Pick(at) => {
                let pick = self.editor.pick(self.on_picture(at), size);
                self.editor.select(pick.map(|pick| pick.shape));
            }
            Action::FocusAt(at) => {
                if let Some(pick) = self.editor.pick(self.on_picture(at), size) {
                    self.editor.end_change();
                    self.gesture(Gesture::Focus(pick.position));
                    self.editor.end_change();
                }
            }
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
            Action::SetEffect { name, on } => self.set_effect(name, on)?,
            Action::MeasureCosts => self.panel.measure_costs(&self.session, &self.editor)?,
            Action::ToggleFollowLight => self.panel.controls.follow_light ^= true,
            Action::SetMethod(name) => {
                if self.session.set_method(name) {
                    self.edited();
                }
            }
            Action::SavePng => self.save_picture("png")?,
            Action::SaveExr => self.save_picture("exr")?,
            Action::SaveScene => {
                return self.save_scene().map(|path| Some(format!("saved {}", path.display())));
            }
            Action::CopyCommand => return self.copy_command().map(Some),
            Action::TogglePanel => self.panel.controls.visible ^= true,
            Action::ToggleHelp => self.panel.controls.help ^= true,
            Action::Cancel => {
                if !std::mem::take(&mut self.panel.controls.help) {
                    self.editor.select(None);
                }
            }
            Action::Quit => self.quit = true,
        }
        Ok(None)
    }

    /// The place in the picture that is shown at this place of the window: another one only where the device could not hold a
    /// film of the window's size.
    fn on_picture(&self, at: [f64; 2]) -> [f64; 2] {
        let size = self.session.size();
        let extent = self.picture.screen.as_ref().and_then(Screen::extent).unwrap_or(size);
        [0, 1].map(|i| at[i] * f64::from(size[i]) / f64::from(extent[i].max(1)))
    }

    /// Moves the camera.
    pub(super) fn gesture(&mut self, gesture: Gesture) {
        if self.editor.gesture(gesture, self.session.size()) {
            self.edited();
        }
    }

    /// Shows another state of the history.
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

    /// Draws the window anew, with the panel.
    pub(super) fn refresh(&mut self) {
        self.picture.request_show();
        self.due = self.due.min(Instant::now() + self.picture.budget());
        self.panel.host.refresh();
    }

    /// Tells the user in the panel, and on standard error.
    pub(super) fn say(&mut self, message: String) {
        tell(&message);
        self.panel.host.say(message);
    }

    /// Switches an effect on or off. The files of the picture name the effects that are left out.
    fn set_effect(&mut self, name: &str, on: bool) -> Result<()> {
        match Effect::named(name) {
            Some(effect) => {
                self.editor.switch(effect)?;
                self.session.set_effects(&self.editor);
                self.edited();
            }
            None => self.panel.switch_display_effect(name, on),
        }
        Ok(())
    }

    /// Saves the picture as it is now under a new name; a message follows when the file is complete.
    fn save_picture(&mut self, ending: &str) -> Result<()> {
        let path = self.saves.free_path(&self.options.name, ending)?;
        let mut outcome = self.outcome();
        outcome.prefix &= self.session.run_spec().deterministic;
        let run = self.present_run_spec()?;
        let settings = self.settings_shown();
        let snapshot = self.picture.snapshot(&path, &self.session, &settings)?;
        self.saves.begin(path, move |path| snapshot.write(path, &run, &outcome, &settings))
    }

    /// With what the present picture is shown: the noise filter is among it only where it has filtered it.
    fn settings_shown(&self) -> Settings {
        let settings = &self.panel.controls.settings;
        let denoise = self.picture.filter_shown(self.session.run_spec(), settings);
        Settings { denoise, ..settings.clone() }
    }

    /// What makes the present picture: where camera or scene were changed, a scene file with the changes is saved first.
    pub(super) fn present_run_spec(&mut self) -> Result<RunSpec> {
        let [width, height] = self.session.size();
        let mut run = RunSpec { size: Some((width, height)), ..self.session.run_spec().clone() };
        if !self.editor.edits().is_empty() {
            run.scene = self.save_scene()?;
            run.defines.clear();
        }
        Ok(run)
    }

    fn save_scene(&mut self) -> Result<PathBuf> {
        self.editor.save(&self.options.name, self.session.run_spec())
    }

    /// Puts the command that repeats this picture without a window on the clipboard and on standard output.
    fn copy_command(&mut self) -> Result<String> {
        let (run, paths) = (self.present_run_spec()?, self.picture.counts().paths());
        let options = display_options(&self.settings_shown());
        let command = format!("{} {options}", run.command(0, paths));
        // Standard output may be the figures', or a pipe that nobody reads any more.
        if self.options.json.as_deref() != Some(Path::new("-")) {
            let _ = writeln!(std::io::stdout(), "{command}");
        }
        self.panel.host.copy(command.clone());
        Ok(format!("copied: {command}"))
    }
}
