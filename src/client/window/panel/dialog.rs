//! The dialog that asks for a file: an existing one to read, or a name to save under.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use egui::{Context, Id};
use egui_file_dialog::{DialogState, FileDialog};

/// Files that a dialog offers: their common name, and their extensions.
pub type FileKind<'a> = (&'a str, &'a [&'static str]);

/// Number of dialogs opened so far.
static OPENED: AtomicU64 = AtomicU64::new(0);

/// A dialog that asks for a file. Opening one closes any other.
#[derive(Debug, Default)]
pub struct FileChooser {
    /// The dialog while open, and its number.
    open: Option<(u64, FileDialog)>,
}

impl FileChooser {
    /// Whether it is open.
    pub fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// Asks for a file of this kind, first in this folder.
    pub fn ask_file(&mut self, title: &str, folder: &Path, (name, endings): FileKind<'_>) {
        let dialog = dialog(title, folder).add_file_filter_extensions(name, endings.to_vec());
        self.ask(dialog.default_file_filter(name), FileDialog::pick_file);
    }

    /// Asks for a name to save under, first in this folder under this name. The first of the kinds, which have one extension each, is
    /// selected.
    pub fn ask_name(&mut self, title: &str, folder: &Path, name: &str, kinds: &[(&str, &str)]) {
        let mut dialog = dialog(title, folder).default_file_name(name);
        for (kind, ending) in kinds {
            dialog = dialog.add_save_extension(kind, ending);
        }
        if let Some((kind, _)) = kinds.first() {
            dialog = dialog.default_save_extension(kind);
        }
        self.ask(dialog, FileDialog::save_file);
    }

    fn ask(&mut self, mut dialog: FileDialog, begin: fn(&mut FileDialog)) {
        begin(&mut dialog);
        self.open = Some((OPENED.fetch_add(1, Ordering::Relaxed), dialog));
    }

    /// Draws the dialog if open; returns the chosen file.
    pub fn show(&mut self, ctx: &Context) -> Option<PathBuf> {
        let (number, dialog) = self.open.as_mut()?;
        let newest = ctx.data_mut(|data| {
            let newest = data.get_temp_mut_or(Id::new("newest file dialog"), *number);
            *newest = (*newest).max(*number);
            *newest
        });
        if *number < newest {
            self.open = None;
            return None;
        }
        dialog.update(ctx);
        let path = match dialog.state() {
            DialogState::Open => return None,
            DialogState::Picked(path) => Some(path.clone()),
            _ => None,
        };
        self.open = None;
        path
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
