//! Mitsuba 3 XML to [`SceneDesc`].
//!
//! Two steps. `expand.rs` turns texts into one flat list of elements: XML, includes, `$names`, ids; in files of version 0.6 and
//! older, `upgrade.rs` gives names their present form, so that nothing after it knows of versions.
//! `walk.rs` goes through that list and hands each plugin to the function its group's table names:
//!
//! | group | file | plugins |
//! |---|---|---|
//! | shape | `shape.rs`, files first by `prefetch.rs` | obj, ply, serialized, rectangle, cube, sphere, cylinder, disk, linearcurve, bsplinecurve, merge, shapegroup, instance |
//! | bsdf | `scene/bsdf/`, a smooth plugin and its rough form in a file | diffuse, dielectric, conductor, plastic, the same rough, principled and thin ones, null, blendbsdf, mask, twosided |
//! | emitter | `emitter.rs` | area, constant, envmap, point |
//! | sensor, film, rfilter | `sensor.rs` | perspective, thinlens, orthographic; films and filters |
//! | integrator, sampler | `integrator.rs` | path, ptracer, depth and our own, layers of `aov`, methods that stand for others; any sampler |
//! | texture | `texture.rs` | bitmap, checkerboard, mesh_attribute, product, volume |
//! | volume | `volume.rs` | gridvolume, constvolume, within the texture `volume` |
//! | spectrum | `spectrum.rs` | uniform, d65, srgb, blackbody, regular, irregular |
//! | edit | `edit.rs` | changes saved by the viewer; no element of Mitsuba's |
//!
//! Adding a plugin is one function and one line in its group's table. A plugin asks `params.rs` for each
//! parameter it knows; parameters that nobody asked for are reported, and `documentation/` learns from the questions what
//! `pointillist plugins` prints. What changes light
//! and is not known is an error of [`FindingKind::Plugin`](crate::scene::FindingKind::Plugin), which a lenient run
//! ([`LoadOptions::lenient`]) turns into a warning; what does not, such as a sampler, is a remark.

mod attribute;
mod bsdf;
mod document;
mod documentation;
mod edit;
mod emission;
mod emitter;
mod expand;
mod integrator;
mod params;
mod prefetch;
mod prescan;
mod reader;
mod sensor;
mod shape;
mod sky;
mod source;
mod spectrum;
mod tags;
mod texture;
mod transform;
mod unsupported;
mod upgrade;
mod value;
mod variables;
mod volume;
mod walk;

pub use documentation::{ParameterDoc, PluginDoc, PluginKind, plugins};
pub(crate) use sensor::AXES;
pub use unsupported::UNSUPPORTED;

use std::path::Path;
use std::sync::Arc;

use crate::scene::desc::SceneDesc;
use crate::scene::diagnostic::{SceneError, SceneWarning};
use crate::scene::files::LoadProgress;

/// A scene as read, with warnings for the user.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub desc: SceneDesc,
    /// Warnings and remarks, in the order they were found.
    pub warnings: Vec<SceneWarning>,
}

/// How a scene is read.
#[derive(Clone, Copy, Debug, Default)]
pub struct LoadOptions<'a> {
    /// The `-D name=value` of the command line, as for [`load`].
    pub defines: &'a [(String, String)],
    /// A bsdf that is not supported becomes magenta, such a shape or emitter is left out: a warning each instead of an error.
    pub lenient: bool,
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
    let expander = expand::Expander::new(options.defines).telling(progress.clone());
    walk::read(expander.file(path)?, options.lenient)
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
    let expanded = expand::Expander::new(options.defines).string(Path::new(name), text.as_bytes())?;
    walk::read(expanded, options.lenient)
}
