//! Opening of scenes, saving of pictures, sums and scenes, and the command line that renders the picture again.

use std::io::Write;
use std::path::{Path, PathBuf};

use miette::{IntoDiagnostic, Result};

use crate::client::Settings;
use crate::image::write::check_target;
use crate::render::run_spec::{RunSpec, display_options, quoted};
use crate::viewer::Viewer;

/// File extensions that can be opened.
const SCENES: [&str; 9] = ["xml", "gltf", "glb", "usd", "usda", "usdc", "usdz", "obj", "ply"];

/// What can be saved, and its file extensions.
const SAVED: [(&str, &str); 3] =
    [("Displayed picture", "png"), ("Linear picture", "exr"), ("Changed scene", "xml")];

impl Viewer {
    /// Asks for a scene or a model to open, first in the folder of the open one.
    pub(super) fn ask_scene(&mut self) {
        let scene = &self.source.args.scene;
        let folder = scene.canonicalize().ok().and_then(|scene| scene.parent().map(Path::to_path_buf));
        let folder = folder.unwrap_or_else(|| PathBuf::from("."));
        let dialog = &mut self.panel.controls.open_dialog;
        dialog.ask_file("Open a scene or a model", &folder, ("Scenes and models", &SCENES));
    }

    /// Asks for a name to save under, first in the working folder.
    pub(super) fn ask_name(&mut self) -> Result<()> {
        let name = format!("{}.png", self.options.name);
        let folder = std::env::current_dir().into_diagnostic()?;
        let title = "Save as picture (.png, .exr) or scene (.xml)";
        self.panel.controls.save_dialog.ask_name(title, &folder, &name, &SAVED);
        Ok(())
    }

    /// Saves camera and edits as a scene file; returns a message.
    pub(super) fn save_changes(&mut self) -> Result<String> {
        let mix = if self.picture.mix.is_mixing() { ", without the light mix" } else { "" };
        self.save_scene().map(|path| format!("saved {}{mix}", path.display()))
    }

    /// Saves to a path of the user's choice; its extension selects the displayed picture, the sums or the scene.
    pub(super) fn save_as(&mut self, path: PathBuf) -> Result<Option<String>> {
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("xml")) {
            self.editor.save_as(&path, self.session.run_spec())?;
            self.preferences.opened(&path, &self.panel.controls.layout);
            return Ok(Some(format!("saved {}", path.display())));
        }
        check_target(&path).into_diagnostic()?;
        self.write_picture(path).map(|()| None)
    }

    /// Saves the present picture under a new name; a message follows when the file is complete.
    pub(super) fn save_picture(&mut self, ending: &str) -> Result<()> {
        let path = self.saves.free_path(&self.options.name, ending)?;
        self.write_picture(path)
    }

    /// Saves the present picture to this file; a message follows when it is complete.
    fn write_picture(&mut self, path: PathBuf) -> Result<()> {
        let mut outcome = self.outcome();
        outcome.prefix &= self.session.run_spec().deterministic;
        let run = self.present_run_spec()?;
        if run.scene != self.session.run_spec().scene {
            let (picture, scene) = (path.display(), run.scene.display());
            self.say(format!("saving {picture}; it comes from the changed scene, which is saved as {scene}"));
        }
        let settings = self.settings_shown();
        let snapshot = self.picture.snapshot(&path, &self.session, &settings)?;
        self.saves.begin(path, move |path| snapshot.write(path, &run, &outcome, &settings))
    }

    /// Settings of the displayed picture. They contain the noise filter only if that has been applied to it.
    fn settings_shown(&self) -> Settings {
        let settings = &self.panel.controls.settings;
        let denoise = self.picture.filter_shown(self.session.run_spec(), settings);
        Settings { denoise, ..settings.clone() }
    }

    /// Specification of the present render. If camera or scene were changed, a scene file with the changes is saved first.
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

    /// Copies the command that renders this picture without a window to the clipboard and to standard output.
    pub(super) fn copy_command(&mut self) -> Result<String> {
        let (run, paths) = (self.present_run_spec()?, self.picture.counts().paths());
        let options = display_options(&self.settings_shown());
        let mut command = format!("{} {options}", run.command(0, paths));
        if run.light_groups.is_some() {
            let (name, mix) = (quoted(&format!("{}.exr", self.options.name)), self.picture.mix.options());
            command += &format!(" -o {name}");
            if !mix.is_empty() {
                let shown = quoted(&format!("{}-mix.png", self.options.name));
                command += &format!(" && pointillist mix {name} {mix} -o {shown}");
            }
        }
        // Standard output may be in use for the statistics, or a closed pipe.
        if self.options.json.as_deref() != Some(Path::new("-")) {
            let _ = writeln!(std::io::stdout(), "{command}");
        }
        self.panel.host.copy(command.clone());
        Ok(format!("copied: {command}"))
    }
}
