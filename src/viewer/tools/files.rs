//! Files: scenes to open, pictures, sums and scenes to save, and the command line that renders the picture again.

use std::io::Write;
use std::path::{Path, PathBuf};

use egui::{Context, Ui};
use miette::{IntoDiagnostic, Result};

use crate::client::Settings;
use crate::client::window::action::ActionQueue;
use crate::client::window::keys::{ToolKey, Trigger, tool_key};
use crate::client::window::panel::{FileChooser, PanelData, PictureArea, SectionPlace, ToolPresence, style};
use crate::image::write::check_target;
use crate::render::process;
use crate::render::run_spec::{display_options, quoted};
use crate::viewer::saves::BackgroundSaves;
use crate::viewer::tools::tool::{Tool, ToolContext};

/// File extensions that can be opened.
const SCENES: [&str; 9] = ["xml", "gltf", "glb", "usd", "usda", "usdc", "usdz", "obj", "ply"];

/// What can be saved, and its file extensions.
const SAVED: [(&str, &str); 3] =
    [("Displayed picture", "png"), ("Linear picture", "exr"), ("Changed scene", "xml")];

/// What the user can do with files.
#[derive(Clone, Debug, PartialEq)]
pub enum FileAction {
    /// Opens the dialog for a scene or model.
    AskScene,
    /// Opens this scene or model.
    Open(PathBuf),
    /// Opens the dialog for a file name to save under.
    AskName,
    /// Saves to this path; the extension selects the displayed picture, the sums or the scene.
    SaveAs(PathBuf),
    /// Saves the displayed picture.
    SavePng,
    /// Saves the sums of the film.
    SaveExr,
    /// Saves camera and edits as a scene file that includes the original.
    SaveScene,
    /// Copies the command line that repeats this picture.
    CopyCommand,
}

/// The files that are asked for and written.
#[derive(Default)]
pub struct FileTool {
    open_dialog: FileChooser,
    save_dialog: FileChooser,
    /// Files that are being written.
    pub saves: BackgroundSaves,
    /// Recent scenes, newest first.
    recent: Vec<PathBuf>,
}

impl Tool for FileTool {
    type Action = FileAction;

    fn keys() -> Vec<ToolKey<FileAction>> {
        use Trigger::{Char, Ctrl};
        let (png, scene) = ("save the picture as PNG", "save the scene's changes");
        let command = "copy the command of this picture";
        vec![
            tool_key("P", png, &[Char('p')], FileAction::SavePng).below("save picture or scene as …"),
            tool_key("Ctrl+S", scene, &[Ctrl('s', false)], FileAction::SaveScene)
                .below("save the sums as EXR"),
            tool_key("C", command, &[Char('c')], FileAction::CopyCommand).below(scene),
        ]
    }

    fn perform(&mut self, action: FileAction, context: &mut ToolContext<'_>) -> Result<Option<String>> {
        match action {
            FileAction::AskScene => {
                let scene = context.session.run_spec().scene.canonicalize().ok();
                let folder = scene.as_deref().and_then(Path::parent).unwrap_or(Path::new("."));
                self.open_dialog.ask_file("Open a scene or a model", folder, ("Scenes and models", &SCENES));
            }
            FileAction::Open(path) => context.opens = Some(path),
            FileAction::AskName => {
                let name = format!("{}.png", context.options.name);
                let folder = std::env::current_dir().into_diagnostic()?;
                let title = "Save as picture (.png, .exr) or scene (.xml)";
                self.save_dialog.ask_name(title, &folder, &name, &SAVED);
            }
            FileAction::SaveAs(path) if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xml")) => {
                context.editor.save_as(&path, context.session.run_spec())?;
                context.preferences.opened(&path, &context.panel.controls.layout);
                return Ok(Some(format!("saved {}", path.display())));
            }
            FileAction::SaveAs(path) => {
                check_target(&path).into_diagnostic()?;
                self.write_picture(path, context)?;
            }
            FileAction::SavePng => self.save_picture("png", context)?,
            FileAction::SaveExr => self.save_picture("exr", context)?,
            FileAction::SaveScene => {
                let path = context.editor.save(&context.options.name, context.session.run_spec())?;
                let mix = if context.picture.mix.is_mixing() { ", without the light mix" } else { "" };
                return Ok(Some(format!("saved {}{mix}", path.display())));
            }
            FileAction::CopyCommand => return copy_command(context).map(Some),
        }
        Ok(None)
    }

    fn poll(&mut self, context: &mut ToolContext<'_>) -> bool {
        for message in self.saves.done() {
            context.say(message);
        }
        if process::take_snapshot_request()
            && let Err(error) = self.save_picture("png", context)
        {
            context.say(error.to_string());
        }
        false
    }

    fn update(&mut self, context: &mut ToolContext<'_>, _: &mut PanelData) {
        self.recent.clone_from(&context.preferences.recent);
    }

    fn section(&mut self, place: SectionPlace, ui: &mut Ui, queue: &mut ActionQueue<FileAction>) {
        match place {
            SectionPlace::FilesTop => save_buttons(ui, queue),
            SectionPlace::FilesEnd => recent_scenes(ui, &self.recent, queue),
            _ => {}
        }
    }

    fn over_picture(&mut self, ctx: &Context, _: PictureArea, queue: &mut ActionQueue<FileAction>) {
        if let Some(path) = self.open_dialog.show(ctx) {
            queue.ask(FileAction::Open(path));
        }
        if let Some(path) = self.save_dialog.show(ctx) {
            queue.ask(FileAction::SaveAs(path));
        }
    }

    fn presence(&self, _: &ToolContext<'_>) -> ToolPresence {
        match self.open_dialog.is_open() || self.save_dialog.is_open() {
            true => ToolPresence::Modal,
            false => ToolPresence::Hidden,
        }
    }

    fn is_busy(&self) -> bool {
        !self.saves.is_empty()
    }
}

impl FileTool {
    /// Saves the present picture under a new name; a message follows when the file is complete.
    fn save_picture(&mut self, ending: &str, context: &mut ToolContext<'_>) -> Result<()> {
        let path = self.saves.free_path(&context.options.name, ending)?;
        self.write_picture(path, context)
    }

    /// Saves the present picture to this file; a message follows when it is complete.
    fn write_picture(&mut self, path: PathBuf, context: &mut ToolContext<'_>) -> Result<()> {
        let in_order = context.session.run_spec().deterministic;
        let outcome = context.picture.outcome(context.session, context.editor);
        let outcome = outcome.with(|end| end.prefix &= in_order);
        let run = context.editor.present_run_spec(&context.options.name, context.session.run_spec())?;
        if run.scene != context.session.run_spec().scene {
            let (picture, scene) = (path.display(), run.scene.display());
            context
                .say(format!("saving {picture}; it comes from the changed scene, which is saved as {scene}"));
        }
        // Another view into a panorama would need another file; the command that C copies shows this one.
        let settings = settings_shown(context).flat();
        if context.panel.looks_around() && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
            context.say(format!("saving {}: the whole panorama, flat", path.display()));
        }
        if run.stereo.is_some() {
            layers_in(&path, &settings).into_iter().for_each(|told| context.say(told));
        }
        let snapshot = context.picture.snapshot(&path, context.session, &settings)?;
        self.saves.begin(path, move |path| snapshot.write(path, &run, &outcome, &settings))
    }
}

/// What the user is told of a PNG file of what the window shows in layers; `None` for other files and layouts.
pub fn layers_in(path: &Path, settings: &Settings) -> Option<String> {
    let file = settings.stereo.in_one_picture();
    let is_png = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png"));
    (is_png && file != settings.stereo).then(|| format!("{} has both eyes {}", path.display(), file.name()))
}

/// Settings of the displayed picture. They contain the noise filter only if that has been applied to it.
fn settings_shown(context: &ToolContext<'_>) -> Settings {
    let settings = &context.panel.controls.settings;
    let denoise = context.picture.filter_shown(context.session.run_spec(), settings);
    Settings { denoise, ..settings.clone() }
}

/// Copies the command that renders this picture without a window to the clipboard and to standard output.
fn copy_command(context: &mut ToolContext<'_>) -> Result<String> {
    let name = &context.options.name;
    let run = context.editor.present_run_spec(name, context.session.run_spec())?;
    let options = display_options(&settings_shown(context));
    let mut command = format!("{} {options}", run.command(0, context.picture.counts().paths()));
    if run.stereo.is_some() {
        let layout = context.panel.controls.settings.stereo.in_one_picture().name();
        command = command.replacen("--stereo", &format!("--stereo {layout}"), 1);
    }
    if run.light_groups.is_some() {
        let (exr, mix) = (quoted(&format!("{name}.exr")), context.picture.mix.options());
        command += &format!(" -o {exr}");
        if !mix.is_empty() {
            let shown = quoted(&format!("{name}-mix.png"));
            command += &format!(" && pointillist mix {exr} {mix} -o {shown}");
        }
    }
    // Standard output may be in use for the statistics, or a closed pipe.
    if context.options.json.as_deref() != Some(Path::new("-")) {
        let _ = writeln!(std::io::stdout(), "{command}");
    }
    context.panel.host.copy(command.clone());
    Ok(format!("copied: {command}"))
}

/// Draws the buttons that write files.
fn save_buttons(ui: &mut Ui, queue: &mut ActionQueue<FileAction>) {
    let files = [
        (
            "PNG",
            "Saves the picture as it is shown, without the panel; a panorama flat  P",
            FileAction::SavePng,
        ),
        ("EXR", "Saves the sums of both streams, of two eyes as two views  E", FileAction::SaveExr),
        (
            "Save scene",
            "Saves camera and changes as XML that includes the original  Ctrl+S",
            FileAction::SaveScene,
        ),
        ("Copy command", "Copies the command line that repeats this picture  C", FileAction::CopyCommand),
    ];
    ui.colored_label(style::DIM, "Save in the working folder, under the next free name:");
    ui.horizontal_wrapped(|ui| {
        for (text, hint, action) in files {
            if ui.button(text).on_hover_text(hint).clicked() {
                queue.ask(action);
            }
        }
    });
}

/// Draws the recent scenes.
fn recent_scenes(ui: &mut Ui, recent: &[PathBuf], queue: &mut ActionQueue<FileAction>) {
    ui.colored_label(style::DIM, "Recent scenes:");
    if recent.is_empty() {
        ui.colored_label(style::DIM, "none yet");
    }
    for path in recent {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        let folder = path.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy();
        let name = format!("{folder}/{name}");
        if ui.button(name).on_hover_text(path.display().to_string()).clicked() {
            queue.ask(FileAction::Open(path.clone()));
        }
    }
}

#[cfg(test)]
mod tests {
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;
    use crate::client::window::action::UserAction;

    #[test]
    fn buttons_do_what_they_say() {
        let draw = |ui: &mut Ui, queue: &mut ActionQueue<FileAction>| {
            save_buttons(ui, queue);
            recent_scenes(ui, &["/scenes/kitchen.xml".into(), "/scenes/hall.xml".into()], queue);
        };
        let mut harness = Harness::builder().build_ui_state(draw, ActionQueue::default());
        harness.run_steps(2);
        for (label, action) in [
            ("PNG", FileAction::SavePng),
            ("EXR", FileAction::SaveExr),
            ("Save scene", FileAction::SaveScene),
            ("Copy command", FileAction::CopyCommand),
            ("scenes/hall.xml", FileAction::Open("/scenes/hall.xml".into())),
        ] {
            harness.get_by_label(label).click();
            harness.run_steps(2);
            assert_eq!(harness.state_mut().take(), [UserAction::Tool(action)]);
        }
    }
}
