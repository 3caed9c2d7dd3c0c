//! Mitsuba 3 XML to [`SceneDesc`].
//!
//! Two steps. `expand.rs` turns texts into one flat list of elements: XML, includes, `$names`, ids.
//! `walk.rs` goes through that list and hands each plugin to the function its group's table names:
//!
//! | group | file | plugins |
//! |---|---|---|
//! | shape | `shape.rs` | obj, rectangle, cube, sphere, disk, shapegroup, instance |
//! | bsdf | `scene/bsdf/`, a smooth plugin and its rough form in a file | diffuse, dielectric, conductor, plastic, the same rough, twosided |
//! | emitter | `emitter.rs` | area, constant, envmap, point |
//! | sensor, film, rfilter | `sensor.rs` | perspective, thinlens; films and filters |
//! | integrator, sampler | `integrator.rs` | path, ptracer and our own; any sampler |
//! | spectrum | `spectrum.rs` | uniform, d65, regular, irregular |
//! | edit | `edit.rs` | changes saved by the viewer; no element of Mitsuba's |
//!
//! Adding a plugin is one function and one line in its group's table . A plugin asks `params.rs` for each
//! parameter it knows; parameters that nobody asked for are reported.

mod document;
mod edit;
mod emitter;
mod expand;
mod integrator;
mod params;
mod prescan;
mod reader;
mod sensor;
mod shape;
mod source;
mod spectrum;
mod suggest;
mod tags;
mod transform;
mod value;
mod variables;
mod walk;

pub(crate) use document::ElementId;
pub(crate) use params::Params;
pub(crate) use reader::{PluginTable, Reader, Role};
pub(crate) use sensor::{AXES, FILTERS};
pub(crate) use spectrum::read as read_spectrum;
pub(crate) use value::shorten;

use std::path::Path;

use crate::scene::desc::SceneDesc;
use crate::scene::diagnostic::{SceneError, SceneWarning};

/// A scene as read, with warnings for the user.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub desc: SceneDesc,
    /// Warnings and remarks, in the order they were found.
    pub warnings: Vec<SceneWarning>,
}

/// Reads the scene file at `path` and every file it names.
///
/// `overrides` are the `-D name=value` of the command line: they win over `default`, and one the
/// scene does not use is a warning.
///
/// # Errors
///
/// [`SceneError`] with file, line, column and source line, at the first thing that prevents a picture.
pub fn load(path: &Path, overrides: &[(String, String)]) -> Result<Loaded, SceneError> {
    walk::read(expand::Expander::new(overrides).file(path)?)
}

/// Reads a scene from `text`; messages call it `name`, and files it names are looked for beside `name`.
///
/// # Errors
///
/// The errors of [`load`].
pub fn load_str(name: &str, text: &str, overrides: &[(String, String)]) -> Result<Loaded, SceneError> {
    walk::read(expand::Expander::new(overrides).string(Path::new(name), text.as_bytes())?)
}
