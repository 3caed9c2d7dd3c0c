//! The file dialog: a scene to open, a name to save under, a picture to compare with.

use std::path::Path;

use egui::Context;
use egui_file_dialog::{DialogState, FileDialog};

use crate::client::window::action::Action;

/// File extensions that can be opened.
const SCENES: [&str; 9] = ["xml", "gltf", "glb", "usd", "usda", "usdc", "usdz", "obj", "ply"];

/// File extensions of example pictures for the light mix.
const IMAGES: [&str; 10] = ["png", "exr", "jpg", "jpeg", "hdr", "pfm", "bmp", "tga", "webp", "ktx2"];

/// Purpose of the dialog.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Purpose {
    Open,
    Save,
    Compare,
    Mix,
}

/// The file dialog and its purpose while open.
#[derive(Debug, Default)]
pub struct FileChooser {
    open: Option<(Purpose, FileDialog)>,
}

impl FileChooser {
    /// Whether it is open.
    pub fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// Asks for a scene or a model, first in this folder.
    pub fn ask_scene(&mut self, folder: &Path) {
        let dialog = dialog("Open a scene or a model", folder)
            .add_file_filter_extensions("Scenes and models", SCENES.to_vec())
            .default_file_filter("Scenes and models");
        self.ask(Purpose::Open, dialog, FileDialog::pick_file);
    }

    /// Asks for a name to save under, first in this folder under this name.
    pub fn ask_name(&mut self, folder: &Path, name: &str) {
        let dialog = dialog("Save as picture (.png, .exr) or scene (.xml)", folder)
            .default_file_name(name)
            .add_save_extension("Displayed picture", "png")
            .add_save_extension("Linear picture", "exr")
            .add_save_extension("Changed scene", "xml")
            .default_save_extension("Displayed picture");
        self.ask(Purpose::Save, dialog, FileDialog::save_file);
    }

    /// Asks for a picture to compare with, first in this folder.
    pub fn ask_picture(&mut self, folder: &Path) {
        let dialog = dialog("Compare with a picture", folder)
            .add_file_filter_extensions("OpenEXR pictures", vec!["exr"])
            .default_file_filter("OpenEXR pictures");
        self.ask(Purpose::Compare, dialog, FileDialog::pick_file);
    }

    /// Asks for a picture that the light mix is to look like, first in this folder.
    pub fn ask_example(&mut self, folder: &Path) {
        let dialog = dialog("Match an image", folder)
            .add_file_filter_extensions("Images", IMAGES.to_vec())
            .default_file_filter("Images");
        self.ask(Purpose::Mix, dialog, FileDialog::pick_file);
    }

    fn ask(&mut self, purpose: Purpose, mut dialog: FileDialog, begin: fn(&mut FileDialog)) {
        begin(&mut dialog);
        self.open = Some((purpose, dialog));
    }

    /// Draws the dialog if open; returns the action for the chosen file.
    pub(super) fn show(&mut self, ctx: &Context) -> Option<Action> {
        let (purpose, dialog) = self.open.as_mut()?;
        dialog.update(ctx);
        let action = match dialog.state() {
            DialogState::Open => return None,
            DialogState::Picked(path) => Some(match purpose {
                Purpose::Open => Action::Open(path.clone()),
                Purpose::Save => Action::SaveAs(path.clone()),
                Purpose::Compare => Action::CompareWith(path.clone()),
                Purpose::Mix => Action::MixLike(path.clone()),
            }),
            _ => None,
        };
        self.open = None;
        action
    }
}

/// A dialog that fits the window.
fn dialog(title: &str, folder: &Path) -> FileDialog {
    FileDialog::new()
        .title(title)
        .initial_directory(folder.to_path_buf())
        .default_size([520.0, 360.0])
        .min_size([280.0, 200.0])
        .show_new_folder_button(true)
}
