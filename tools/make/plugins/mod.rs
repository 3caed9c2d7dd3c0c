//! The documentation of plugins: every plugin of a scene file with its parameters, as the readers themselves tell it.
//!
//! Names come from the tables that the reader uses. Parameters come from a documentation run: each plugin is read from an
//! element that has only what it cannot do without, and again with each of the others, while the reader records what it
//! asks for ([`Question`]). So a new plugin or parameter is documented by being read. Only what is special about a plugin is
//! written by hand, in `notes.rs`.

pub mod notes;
mod text;
mod trial;

use std::path::{Path, PathBuf};

use pointillist::scene::mitsuba::{Question, plugin_names};

use trial::DocumentationRun;

/// The files that hold the documentation, and the text that belongs into each.
///
/// # Errors
///
/// A documentation run that did not find what the plugin needs.
pub fn files(kinds: &[PluginKind]) -> Result<[(PathBuf, String); 2], Box<dyn std::error::Error>> {
    for (kind, plugin) in kinds.iter().flat_map(|kind| kind.plugins.iter().map(|plugin| (kind.name, plugin)))
    {
        if let Some(problem) = &plugin.problem {
            let name = plugin.name;
            return Err(format!(
                "the {kind} `{name}` could not be read: add to `candidates` in trial.rs: {problem}"
            )
            .into());
        }
    }
    const ABOVE_TABLES: &str = "tools/make/plugins/notes.rs. -->\n";
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = root.join("scenes/README.md");
    let text = std::fs::read_to_string(&readme)?;
    let (head, _) = text.split_once(ABOVE_TABLES).ok_or("the comment above the tables is missing")?;
    let tables = format!("{head}{ABOVE_TABLES}\n{}", text::markdown(kinds));
    Ok([(root.join("src/cmd/plugins.txt"), text::plain(kinds)), (readme, tables)])
}

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

/// A place in a scene where a plugin can stand: what is around it, and the attributes that it has there.
struct PluginPlace {
    before: &'static str,
    attributes: &'static str,
    after: &'static str,
}

const fn place(before: &'static str, attributes: &'static str, after: &'static str) -> PluginPlace {
    PluginPlace { before, attributes, after }
}

/// Where a plugin of this kind can stand; each place is tried.
fn places(kind: &str) -> Vec<PluginPlace> {
    const SENSOR: &str = "<sensor type='perspective'>";
    match kind {
        "texture" | "spectrum" => vec![place("<bsdf type='diffuse'>", "name='reflectance'", "</bsdf>")],
        "volume" => vec![place(
            "<bsdf type='diffuse'><texture type='volume' name='reflectance'>",
            "",
            "</texture></bsdf>",
        )],
        "phase" => vec![place("<medium type='homogeneous'>", "", "</medium>")],
        "emitter" => vec![place("", "", ""), place("<shape type='rectangle'>", "", "</shape>")],
        "sensor" => vec![place("", "", ""), place("<shape type='rectangle'>", "", "</shape>")],
        "film" | "sampler" => vec![place(SENSOR, "", "</sensor>")],
        "rfilter" => vec![place("<sensor type='perspective'><film type='hdrfilm'>", "", "</film></sensor>")],
        _ => vec![place("", "", "")],
    }
}

/// Every plugin that is supported, by kind.
///
/// # Errors
///
/// Small files to read plugins with are written to a temporary folder, which may fail.
pub fn plugins() -> std::io::Result<Vec<PluginKind>> {
    let folder = trial::samples()?;
    let document = |(kind, names): (&'static str, Vec<&'static str>)| {
        let places = &places(kind);
        let plugin = |name| document(&DocumentationRun { kind, places, name, folder: folder.path() });
        PluginKind { name: kind, note: notes::of(kind, ""), plugins: names.into_iter().map(plugin).collect() }
    };
    Ok(plugin_names().into_iter().map(document).collect())
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
    let note = notes::of(run.kind, run.name);
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
