//! The plugins that are read, and what their readers ask for: `tools/plugins` documents each plugin by it.

use std::path::Path;
use std::sync::{Arc, PoisonError};

use super::expand::Expander;
use super::question::{Question, Questions};
use super::{bsdf, emitter, integrator, medium, phase, sensor, shape, spectrum, texture, volume, walk};
use crate::scene::diagnostic::SceneError;

/// Reads a scene from `text`, as if it stood in the file `path`. Returns the parameters that the reader of the element with this id asked
/// for, each with the question, and why the scene could not be read.
pub fn questions(path: &Path, text: &str, id: &str) -> (Vec<(&'static str, Question)>, Option<SceneError>) {
    let (mut document, warnings) = match Expander::new(&[]).string(path, text.as_bytes()) {
        Ok(expanded) => expanded,
        Err(problem) => return (Vec::new(), Some(problem)),
    };
    let log = Arc::new(Questions::default());
    document.questions = Some(log.clone());
    let asked = document.ids.get(id).copied();
    let problem = walk::read((document, warnings), false, None).err();
    let log = std::mem::take(&mut *log.lock().unwrap_or_else(PoisonError::into_inner));
    let of_it = log.into_iter().filter(|(of, ..)| Some(*of) == asked);
    (of_it.map(|(_, name, question)| (name, question)).collect(), problem)
}

/// The kinds of plugins, and the names of those that are read, in the order of the reader's tables.
pub fn plugin_names() -> Vec<(&'static str, Vec<&'static str>)> {
    fn names<P>(table: &[(&'static str, P)]) -> Vec<&'static str> {
        table.iter().map(|(name, _)| *name).collect()
    }
    vec![
        ("shape", [names(shape::PLUGINS), vec![shape::MERGE, shape::GROUP, shape::INSTANCE]].concat()),
        ("bsdf", [names(bsdf::PLUGINS), names(bsdf::STAND_INS)].concat()),
        ("texture", names(texture::PLUGINS)),
        ("volume", names(volume::PLUGINS)),
        ("medium", names(medium::PLUGINS)),
        ("phase", names(phase::PLUGINS)),
        ("emitter", [emitter::AREA.to_vec(), names(emitter::PLUGINS)].concat()),
        ("sensor", names(sensor::PLUGINS)),
        ("film", sensor::FILMS.to_vec()),
        ("rfilter", [names(sensor::FILTERS), sensor::REPLACED.to_vec()].concat()),
        ("integrator", integrator::ours().chain(names(integrator::FOREIGN)).collect()),
        ("sampler", integrator::SAMPLERS.to_vec()),
        ("spectrum", names(spectrum::PLUGINS)),
    ]
}
