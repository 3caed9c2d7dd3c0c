//! Loads scenes: reads a scene file or a model, then makes the changes that the viewer has saved in it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::scene::desc::SceneDesc;
use crate::scene::diagnostic::{SceneError, SceneWarning};
use crate::scene::edit::saved;
use crate::scene::files::LoadProgress;
use crate::scene::mitsuba::{self, Document, LoadOptions, ReadElements, SceneWithEdits};

/// A scene as read, with warnings for the user.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub desc: SceneDesc,
    /// Warnings and remarks, in the order they were found.
    pub warnings: Vec<SceneWarning>,
}

/// Reads the scene file at `path` and every file it names. A model ([`ModelFormat`](crate::scene::model::ModelFormat)) is a
/// scene, too.
///
/// `overrides` are the `-D name=value` of the command line: they win over `default`, and one the
/// scene does not use is a warning.
///
/// # Errors
///
/// [`SceneError`] with file, line, column and source line, at the first thing that prevents a picture.
pub fn load(path: &Path, overrides: &[(String, String)]) -> Result<Loaded, SceneError> {
    load_with(path, &LoadOptions { defines: overrides, lenient: false })
}

/// Reads the scene file at `path` as [`load`] does, with options.
///
/// # Errors
///
/// The errors of [`load`]; in a lenient run, plugins that are not supported are none.
pub fn load_with(path: &Path, options: &LoadOptions<'_>) -> Result<Loaded, SceneError> {
    load_telling(path, options, &Arc::default())
}

/// Reads the scene file at `path` as [`load_with`] does, and tells `progress` of every file meanwhile.
///
/// # Errors
///
/// The errors of [`load_with`].
pub fn load_telling(
    path: &Path,
    options: &LoadOptions<'_>,
    progress: &Arc<LoadProgress>,
) -> Result<Loaded, SceneError> {
    with_edits(mitsuba::read_file(path, options, progress, None)?)
}

/// Reads the scene file at `path` as [`load_telling`] does. If its textures take long to decode, `preview` is called before that with the
/// scene in which each large picture is replaced by a single texel: a medium grey, and for raw values a normal that points away from
/// the surface.
///
/// # Errors
///
/// The errors of [`load_with`]; after a preview only those of large pictures.
pub fn load_previewing(
    path: &Path,
    options: &LoadOptions<'_>,
    progress: &Arc<LoadProgress>,
    preview: &mut dyn FnMut(SceneDesc),
) -> Result<Loaded, SceneError> {
    let mut take = |ReadElements { mut desc, edits, .. }: ReadElements, document: &Document| {
        // Edits that are in error are told when the whole scene is read.
        if saved::apply(document, &mut desc, &edits).is_ok() {
            preview(desc);
        }
    };
    with_edits(mitsuba::read_file(path, options, progress, Some(&mut take))?)
}

/// Reads a scene from `text`; messages call it `name`, and files it names are looked for beside `name`.
///
/// # Errors
///
/// The errors of [`load`].
pub fn load_str(name: &str, text: &str, overrides: &[(String, String)]) -> Result<Loaded, SceneError> {
    load_str_with(name, text, &LoadOptions { defines: overrides, lenient: false })
}

/// Reads a scene from `text` as [`load_str`] does, with options.
///
/// # Errors
///
/// The errors of [`load_with`].
pub fn load_str_with(name: &str, text: &str, options: &LoadOptions<'_>) -> Result<Loaded, SceneError> {
    load_str_with_files(name, text, BTreeMap::new(), options)
}

/// Reads a scene from `text` as [`load_str_with`] does. A file that it names is taken from `files`, the bytes by their paths, if it is there:
/// the path is relative to the folder of `name`.
///
/// # Errors
///
/// The errors of [`load_with`].
pub fn load_str_with_files(
    name: &str,
    text: &str,
    files: BTreeMap<PathBuf, Vec<u8>>,
    options: &LoadOptions<'_>,
) -> Result<Loaded, SceneError> {
    with_edits(mitsuba::read_text(name, text, files, options)?)
}

/// The scene after its edits, in their order.
fn with_edits(read: SceneWithEdits) -> Result<Loaded, SceneError> {
    let SceneWithEdits { mut desc, warnings, document, edits } = read;
    saved::apply(&document, &mut desc, &edits)?;
    Ok(Loaded { desc, warnings })
}
