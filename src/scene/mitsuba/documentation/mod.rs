//! What is supported: every plugin with its parameters, as the readers themselves tell it.
//!
//! Names come from the tables that the reader uses. Parameters come from a documentation run: each plugin is read from an
//! element that has only what it cannot do without, and again with each of the others, while [`Params`](super::Params) notes what its
//! reader asks for ([`Question`]). So a new plugin or parameter is documented by being read. Only what is special about a plugin is
//! written by hand, in `notes.rs`.

mod notes;
mod trial;

use super::question::Question;
use super::{emitter, integrator, sensor, shape, spectrum, texture, volume};
use crate::scene::mitsuba::bsdf;
use trial::DocumentationRun;

/// The plugins of one kind.
#[derive(Clone, Debug)]
pub struct PluginKind {
    /// The name of its element, such as `bsdf`.
    pub name: &'static str,
    /// What holds for the whole kind, as Markdown; empty if nothing is special.
    pub note: String,
    /// Its plugins, in the order of the reader's table.
    pub plugins: Vec<PluginDoc>,
}

/// A plugin and its parameters.
#[derive(Clone, Debug)]
pub struct PluginDoc {
    /// Its `type`.
    pub name: &'static str,
    /// What is special about it, as Markdown; empty if nothing is.
    pub note: String,
    /// Its parameters, in the order in which its reader asks for them.
    pub parameters: Vec<ParameterDoc>,
    /// Why the documentation run did not end with the plugin read: some parameters may be missing here.
    pub problem: Option<String>,
}

/// A parameter of a plugin, or what may be nested in it without a name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ParameterDoc {
    /// Its name, or the tag of what is nested.
    pub name: &'static str,
    /// What it is written as: an element, several by ` or `, or `file`. Empty if its reader does not tell.
    pub value: String,
    /// What it is if it is not given, where its reader tells.
    pub default: Option<String>,
    /// True if the plugin cannot be read without it.
    pub required: bool,
    /// True if it is accepted and changes nothing.
    pub idle: bool,
    /// True for an element within the plugin, whatever its name.
    pub nested: bool,
}

/// How a kind of plugin is found and read.
struct KindTable {
    name: &'static str,
    plugins: fn() -> Vec<&'static str>,
    /// Where it can stand; each is tried.
    places: &'static [PluginPlace],
}

/// A place in a scene where a plugin can stand: what is around it, and the attributes that it has there.
struct PluginPlace {
    before: &'static str,
    attributes: &'static str,
    after: &'static str,
}

const fn place(before: &'static str, attributes: &'static str, after: &'static str) -> PluginPlace {
    PluginPlace { before, attributes, after }
}

fn names<P>(table: &[(&'static str, P)]) -> Vec<&'static str> {
    table.iter().map(|(name, _)| *name).collect()
}

const TOP: &[PluginPlace] = &[place("", "", "")];
const IN_BSDF: &[PluginPlace] = &[place("<bsdf type='diffuse'>", "name='reflectance'", "</bsdf>")];

const IN_TEXTURE: &[PluginPlace] =
    &[place("<bsdf type='diffuse'><texture type='volume' name='reflectance'>", "", "</texture></bsdf>")];

/// Every kind of plugin.
const KINDS: &[KindTable] = &[
    KindTable {
        name: "shape",
        plugins: || [names(shape::PLUGINS), vec![shape::MERGE, shape::GROUP, shape::INSTANCE]].concat(),
        places: TOP,
    },
    KindTable {
        name: "bsdf",
        plugins: || [names(bsdf::PLUGINS), names(bsdf::STAND_INS)].concat(),
        places: TOP,
    },
    KindTable { name: "texture", plugins: || names(texture::PLUGINS), places: IN_BSDF },
    KindTable { name: "volume", plugins: || names(volume::PLUGINS), places: IN_TEXTURE },
    KindTable {
        name: "emitter",
        plugins: || [emitter::AREA.to_vec(), names(emitter::PLUGINS)].concat(),
        places: &[place("", "", ""), place("<shape type='rectangle'>", "", "</shape>")],
    },
    KindTable { name: "sensor", plugins: || names(sensor::PLUGINS), places: TOP },
    KindTable {
        name: "film",
        plugins: || sensor::FILMS.to_vec(),
        places: &[place("<sensor type='perspective'>", "", "</sensor>")],
    },
    KindTable {
        name: "rfilter",
        plugins: || [names(sensor::FILTERS), sensor::REPLACED.to_vec()].concat(),
        places: &[place("<sensor type='perspective'><film type='hdrfilm'>", "", "</film></sensor>")],
    },
    KindTable {
        name: "integrator",
        plugins: || integrator::ours().chain(names(integrator::FOREIGN)).collect(),
        places: TOP,
    },
    KindTable {
        name: "sampler",
        plugins: || integrator::SAMPLERS.to_vec(),
        places: &[place("<sensor type='perspective'>", "", "</sensor>")],
    },
    KindTable { name: "spectrum", plugins: || names(spectrum::PLUGINS), places: IN_BSDF },
];

/// Every plugin that is supported, by kind.
///
/// # Errors
///
/// Small files to read plugins with are written to a temporary folder, which may fail.
pub fn plugins() -> std::io::Result<Vec<PluginKind>> {
    let folder = trial::samples()?;
    let document = |kind: &'static KindTable| {
        let plugin = |name| document(&DocumentationRun { kind, name, folder: folder.path() });
        let plugins = (kind.plugins)().into_iter().map(plugin).collect();
        PluginKind { name: kind.name, note: notes::of(kind.name, ""), plugins }
    };
    Ok(KINDS.iter().map(document).collect())
}

fn document(run: &DocumentationRun<'_>) -> PluginDoc {
    let learned = run.learn();
    let mut parameters: Vec<ParameterDoc> = Vec::new();
    for (name, question) in learned.questions {
        let nested = question == Question::Nested;
        let known = parameters.iter().position(|p| p.name == name && p.nested == nested);
        let at = known.unwrap_or_else(|| {
            let required = learned.required.iter().any(|(n, of)| *n == name && *of == nested);
            parameters.push(ParameterDoc { name, nested, required, ..Default::default() });
            parameters.len() - 1
        });
        let parameter = &mut parameters[at];
        match question {
            Question::File(_) => parameter.value = "file".to_owned(),
            Question::Value(tags) if parameter.value.is_empty() => parameter.value = value(tags),
            Question::Default(default) if parameter.default.is_none() => parameter.default = Some(default),
            Question::Idle => parameter.idle = true,
            _ => {}
        }
    }
    let note = notes::of(run.kind.name, run.name);
    PluginDoc { name: run.name, note, parameters, problem: learned.problem }
}

/// The elements that a value is written as. What takes a float takes an integer, and points and vectors are the same.
fn value(tags: &[&str]) -> String {
    match tags {
        ["float", "integer"] => "float".to_owned(),
        ["point", "vector"] => "point".to_owned(),
        tags => tags.join(" or "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_plugin_can_be_read() {
        for kind in plugins().expect("a temporary folder") {
            assert!(!kind.plugins.is_empty(), "{}", kind.name);
            for plugin in kind.plugins {
                let (kind, name) = (kind.name, plugin.name);
                assert_eq!(
                    plugin.problem, None,
                    "the documentation run of the {kind} `{name}` did not find what it needs: add to `candidates` in trial.rs"
                );
            }
        }
    }

    #[test]
    fn notes_are_about_plugins_that_exist() {
        for (kind, name, _) in notes::NOTES {
            let known = KINDS.iter().find(|k| k.name == *kind).expect("a kind");
            assert!(name.is_empty() || (known.plugins)().contains(name), "{kind} `{name}` does not exist");
        }
    }

    /// What a few readers are known to ask for: required, by default, without effect, nested, and only if another one is given.
    #[test]
    fn parameters_are_what_readers_ask_for() {
        let all = plugins().expect("a temporary folder");
        let find = |kind: &str, plugin: &str, name: &str| {
            let kind = all.iter().find(|k| k.name == kind).expect("a kind");
            let plugin = kind.plugins.iter().find(|p| p.name == plugin).expect("a plugin");
            plugin.parameters.iter().find(|p| p.name == name).cloned().unwrap_or_default()
        };
        let radius = find("shape", "sphere", "radius");
        assert_eq!((radius.value.as_str(), radius.default.as_deref()), ("float", Some("1")));
        let file = find("shape", "obj", "filename");
        assert!(file.required && file.value == "file", "{file:?}");
        assert!(find("bsdf", "blendbsdf", "weight").required);
        let inner = find("bsdf", "blendbsdf", "bsdf");
        assert!(inner.nested && inner.required, "{inner:?}");
        let axis = find("sensor", "perspective", "fov_axis");
        assert!(axis.value == "string" && !axis.required, "{axis:?}");
        assert!(find("film", "hdrfilm", "banner").idle);
        assert_eq!(find("shape", "sphere", "filename"), ParameterDoc::default());
        assert!(find("emitter", "area", "radiance").value.contains("spectrum"));
    }
}
