//! Mitsuba 3 XML to [`SceneDesc`](crate::scene::SceneDesc).
//!
//! Two steps. `expand.rs` turns texts into one flat list of elements: XML, includes, `$names`, ids; in files of version 0.6 and
//! older, `upgrade.rs` gives names their present form, so that nothing after it knows of versions.
//! `walk.rs` goes through that list and hands each plugin to the function its group's table names:
//!
//! | group | file |
//! |---|---|
//! | shape | `shape.rs`, files first by `prefetch.rs` |
//! | bsdf | `bsdf/`, a smooth plugin and its rough form in one file |
//! | emitter | `emitter.rs` |
//! | sensor, film, rfilter | `sensor.rs` |
//! | integrator, sampler | `integrator.rs`: also names of methods that stand for ours |
//! | texture | `texture.rs` |
//! | medium, phase | `medium.rs`, `phase.rs`; `subsurface.rs`: the `dipole` of version 0.6 as a medium |
//! | volume | `volume.rs`, within the texture `volume` or as a coefficient of a medium |
//! | spectrum | `spectrum.rs` |
//!
//! `pointillist plugins` lists the plugins of each group.
//!
//! Adding a plugin is one function and one line in its group's table. The function asks `Params` (`params.rs`) for each parameter that
//! the plugin has: parameters that nobody asked for are reported, and `tools/plugins` learns from the questions what
//! `pointillist plugins` prints. An unknown plugin that changes light is an error of
//! [`FindingKind::Plugin`](crate::scene::FindingKind::Plugin), which a lenient run ([`LoadOptions::lenient`]) turns into a warning; any
//! other, such as a sampler, is a remark.
//!
//! `<edit>` elements, changes that the viewer has saved, are handed on to `scene/edit/saved.rs`: they are no element of Mitsuba's.

mod attribute;
mod bsdf;
mod document;
mod emission;
mod emitter;
mod expand;
mod grid_file;
mod integrator;
mod medium;
mod params;
mod phase;
mod plugin_list;
mod prefetch;
mod prefetched;
mod prescan;
mod projection;
mod question;
mod reader;
mod sensor;
mod shape;
mod sky;
mod source;
mod spectrum;
mod subsurface;
mod tags;
mod texture;
mod transform;
mod unsupported;
mod upgrade;
mod value;
mod variables;
mod volume;
mod walk;

pub(super) use document::{Document, Element, ElementId};
pub use integrator::FOREIGN as FOREIGN_INTEGRATORS;
pub use plugin_list::{plugin_names, questions};
pub(super) use projection::{EYES, LAYOUTS, MAPPINGS, PRISM, RADIAL, TANGENTIAL};
pub use question::Question;
pub(super) use sensor::AXES;
pub use unsupported::UNSUPPORTED;
pub(super) use value::{integer, numbers};
pub(super) use walk::{ReadElements, SceneWithEdits, TakePreview};

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::scene::diagnostic::SceneError;
use crate::scene::files::LoadProgress;

/// How a scene is read.
#[derive(Clone, Copy, Debug, Default)]
pub struct LoadOptions<'a> {
    /// The `-D name=value` of the command line, as for [`load`](crate::scene::load).
    pub defines: &'a [(String, String)],
    /// A bsdf that is not supported becomes magenta, such a shape or emitter is left out: a warning each instead of an error.
    pub lenient: bool,
}

/// Reads the scene file at `path`, and tells `progress` of every file meanwhile. If large pictures take long to read, `preview` gets
/// the scene before.
pub(super) fn read_file(
    path: &Path,
    options: &LoadOptions<'_>,
    progress: &Arc<LoadProgress>,
    preview: Option<TakePreview<'_>>,
) -> Result<SceneWithEdits, SceneError> {
    let expander = expand::Expander::new(options.defines).telling(progress.clone());
    walk::read(expander.file(path)?, options.lenient, preview)
}

/// Reads a scene from `text`; messages call it `name`, and files it names are looked for beside `name`, first among those in memory.
pub(super) fn read_text(
    name: &str,
    text: &str,
    files: BTreeMap<PathBuf, Vec<u8>>,
    options: &LoadOptions<'_>,
) -> Result<SceneWithEdits, SceneError> {
    let expander = expand::Expander::new(options.defines).with_files(files);
    let expanded = expander.string(Path::new(name), text.as_bytes())?;
    walk::read(expanded, options.lenient, None)
}
