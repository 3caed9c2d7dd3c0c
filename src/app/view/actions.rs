//! What the user asks for: camera moves, selection, saving.

use std::path::{Path, PathBuf};
use std::time::Instant;

use miette::{IntoDiagnostic, Result};

use crate::app::facts::display_options;
use crate::app::outputs::save;
use crate::app::tell;
use crate::app::view::screen::Screen;
use crate::app::view::viewer::Viewer;
use crate::client::window::input::Intent;
use crate::client::window::navigation::Gesture;
use crate::client::window::panel::Action;

impl Viewer {
    /// Does what mouse or keys mean.
    pub fn intend(&mut self, intent: Intent) {
        match intent {
            Intent::Gesture(gesture) => self.gesture(gesture),
            Intent::EndMove => self.user.history.end_move(),
            Intent::Pick(at) => {
                let pick = self.user.pick(at, self.size);
                self.user.select(pick.map(|pick| pick.shape));
                self.refresh();
            }
            Intent::FocusAt(at) => {
                if let Some(pick) = self.user.pick(at, self.size) {
                    self.user.history.end_move();
                    self.gesture(Gesture::Focus(pick.position.as_dvec3()));
                    self.user.history.end_move();
                }
            }
            Intent::Action(action) => self.actions.push(action),
            Intent::TogglePanel => {
                self.controls.visible ^= true;
                self.refresh();
            }
            Intent::ToggleHelp => {
                self.controls.help ^= true;
                self.refresh();
            }
            Intent::Cancel => {
                if !std::mem::take(&mut self.controls.help) {
                    self.user.select(None);
                }
                self.refresh();
            }
            Intent::Quit => self.quit = true,
        }
    }

    /// Moves the camera.
    pub fn gesture(&mut self, gesture: Gesture) {
        if self.user.gesture(gesture, self.size) {
            self.edited();
        }
    }

    /// Draws the window anew, with the panel.
    pub fn refresh(&mut self) {
        (self.pending.show, self.clock.due) =
            (true, self.clock.due.min(Instant::now() + self.pacer.budget()));
        if let Some(ui) = &mut self.ui {
            ui.refresh();
        }
    }

    /// Does what was asked for in the panel or by keys since the last call.
    pub fn act(&mut self) {
        if std::mem::take(&mut self.settings_changed) {
            self.controls_changed();
        }
        for action in std::mem::take(&mut self.actions) {
            match self.perform(&action) {
                Ok(None) => {}
                Ok(Some(message)) => self.say(message),
                Err(error) => self.say(error.to_string()),
            }
            self.refresh();
        }
    }

    /// Tells the user in the panel, and on standard error.
    pub fn say(&mut self, message: String) {
        tell(&message);
        if let Some(ui) = &mut self.ui {
            ui.say(message);
        }
    }

    /// One action; what is to be said about it.
    fn perform(&mut self, action: &Action) -> Result<Option<String>> {
        match action {
            Action::SavePng => return self.save_picture("png").map(Some),
            Action::SaveExr => return self.save_picture("exr").map(Some),
            Action::SaveScene => {
                return self.save_scene().map(|path| Some(format!("saved {}", path.display())));
            }
            Action::CopyCommand => return self.copy_command().map(Some),
            Action::Undo => self.moved(|history| history.undo().is_some()),
            Action::Redo => self.moved(|history| history.redo().is_some()),
            Action::ResetCamera => self.moved(|history| history.reset().is_some()),
            Action::SetFov(fov) => self.moved(|history| history.set_fov(*fov)),
            Action::Edit { index, value } => {
                self.user.edit(*index, *value)?;
                self.edited();
            }
            Action::Deselect => self.user.select(None),
        }
        Ok(None)
    }

    fn moved(&mut self, change: impl FnOnce(&mut crate::client::window::history::History) -> bool) {
        if change(&mut self.user.history) {
            self.edited();
        }
    }

    /// Saves the picture as it is under a new name.
    fn save_picture(&mut self, ending: &str) -> Result<String> {
        let path = fresh(&self.plan.name, ending)?;
        let prefix = self.session.is_complete() && self.plan.facts.deterministic;
        let mut facts = self.plan.facts.clone();
        facts.size = Some((self.size[0], self.size[1]));
        facts.spec = self.spec();
        let settings = self.controls.settings.clone();
        let Some(film) = self.screen.as_mut().and_then(Screen::film) else {
            return Err(miette::miette!("there is no picture to save"));
        };
        save(&path, film, (&facts, prefix), &settings)?;
        Ok(format!("saved {}", path.display()))
    }

    /// Saves camera and edits as a scene that includes the original.
    fn save_scene(&mut self) -> Result<PathBuf> {
        let path = fresh(&self.plan.name, "xml")?;
        let facts = &self.plan.facts;
        let edits = self.user.edits();
        edits.write(&path, &facts.scene, &facts.defines, self.user.original()).into_diagnostic()?;
        Ok(path)
    }

    /// The command that repeats this picture without a window, on the clipboard and on standard output.
    fn copy_command(&mut self) -> Result<String> {
        let counts = self.counts();
        let mut facts = self.plan.facts.clone();
        facts.size = Some((self.size[0], self.size[1]));
        facts.spec = self.spec();
        if !self.user.edits().is_empty() {
            facts.scene = self.save_scene()?;
            facts.defines.clear();
        }
        let command =
            format!("{} {}", facts.command(0, counts.paths()), display_options(&self.controls.settings));
        println!("{command}");
        if let Some(ui) = &mut self.ui {
            ui.copy(command.clone());
        }
        Ok(format!("copied: {command}"))
    }
}

/// `NAME-001.ENDING`, or the next number that is free in the working folder.
fn fresh(name: &str, ending: &str) -> Result<PathBuf> {
    let path = |i: u32| PathBuf::from(format!("{name}-{i:03}.{ending}"));
    let free = |path: &PathBuf| !Path::new(path).exists();
    (1..100_000)
        .map(path)
        .find(free)
        .ok_or_else(|| miette::miette!("no free name {name}-….{ending} in this folder"))
}
