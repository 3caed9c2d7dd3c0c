//! What the user asks for: camera moves, selection, saving.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use miette::{IntoDiagnostic, Result};

use crate::app::outputs::FilmSnapshot;
use crate::app::run_spec::{RunSpec, display_options};
use crate::app::tell;
use crate::app::view::screen::Screen;
use crate::app::view::viewer::Viewer;
use crate::client::window::input::Intent;
use crate::client::window::navigation::Gesture;
use crate::client::window::panel::Action;
use crate::tracer::effects::Effect;

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
        if self.costs.take() {
            self.refresh();
        }
        for message in self.saving.done() {
            self.say(message);
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
            Action::SavePng => self.save_picture("png")?,
            Action::SaveExr => self.save_picture("exr")?,
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
            Action::SetEffect { name, on } => self.set_effect(name, *on)?,
            Action::MeasureCosts => self.measure_costs()?,
            Action::EndMove => self.user.history.end_move(),
            Action::Deselect => self.user.select(None),
        }
        Ok(None)
    }

    /// Switches an effect on or off; of what is left out the picture's file will say so.
    fn set_effect(&mut self, name: &str, on: bool) -> Result<()> {
        let Some(effect) = Effect::named(name) else {
            self.controls.settings.switch(name, on);
            self.settings_changed = true;
            return Ok(());
        };
        self.user.switch(effect)?;
        let run = &mut self.plan.run;
        run.effects = self.user.forced().to_vec();
        run.photons = self.user.desc().integrator.photons;
        self.edited();
        Ok(())
    }

    fn moved(&mut self, change: impl FnOnce(&mut crate::client::window::history::History) -> bool) {
        if change(&mut self.user.history) {
            self.edited();
        }
    }

    /// Saves the picture as it is now under a new name; the file is told of when it is there.
    fn save_picture(&mut self, ending: &str) -> Result<()> {
        let path = self.saving.fresh(&self.plan.name, ending)?;
        let complete = self.session.is_complete();
        let deterministic = self.plan.run.deterministic;
        let prefix = complete && deterministic;
        let run = self.facts_now()?;
        let settings = self.controls.settings.clone();
        let Some(film) = self.screen.as_mut().and_then(Screen::film) else {
            return Err(miette::miette!("there is no picture to save"));
        };
        // In order of index the sums must stay those of whole batches until the last one.
        film.keep_batch(deterministic && !complete);
        let snapshot = FilmSnapshot::take(&path, film, &settings);
        film.keep_batch(false);
        // The window's own picture may have another encoding.
        self.pending.repaint = true;
        let snapshot = snapshot?;
        self.saving.begin(path, move |path| snapshot.write(path, (&run, prefix), &settings))
    }

    /// What makes the present picture: where camera or scene were changed, a scene file that says so is saved first.
    pub fn facts_now(&mut self) -> Result<RunSpec> {
        let mut run =
            RunSpec { size: Some((self.size[0], self.size[1])), film: self.spec(), ..self.plan.run.clone() };
        if !self.user.edits().is_empty() {
            run.scene = self.save_scene()?;
            run.defines.clear();
        }
        Ok(run)
    }

    /// Saves camera and edits as a scene that includes the original, unless that was done already.
    fn save_scene(&mut self) -> Result<PathBuf> {
        let edits = self.user.edits();
        if let Some((saved, path)) = &self.saved_scene
            && *saved == edits
            && path.exists()
        {
            return Ok(path.clone());
        }
        let path = self.saving.fresh(&self.plan.name, "xml")?;
        let run = &self.plan.run;
        edits.write(&path, &run.scene, &run.defines, self.user.original()).into_diagnostic()?;
        self.saved_scene = Some((edits, path.clone()));
        Ok(path)
    }

    /// The command that repeats this picture without a window, on the clipboard and on standard output.
    fn copy_command(&mut self) -> Result<String> {
        let counts = self.counts();
        let run = self.facts_now()?;
        let command =
            format!("{} {}", run.command(0, counts.paths()), display_options(&self.controls.settings));
        // Standard output may be the figures', or a pipe that nobody reads any more.
        if self.plan.json.as_deref() != Some(Path::new("-")) {
            let _ = writeln!(std::io::stdout(), "{command}");
        }
        if let Some(ui) = &mut self.ui {
            ui.copy(command.clone());
        }
        Ok(format!("copied: {command}"))
    }
}
