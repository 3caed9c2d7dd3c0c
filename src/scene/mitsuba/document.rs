//! A scene as a flat list of elements, after includes and `$names` are resolved.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::question::Questions;
use super::source::{Sources, Span};
use super::tags::Tag;
use crate::scene::diagnostic::{Finding, FindingKind, SceneError};
use crate::scene::files::SceneFiles;

/// Index of an [`Element`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ElementId(pub(crate) u32);

/// One attribute, its value after substitution.
#[derive(Debug)]
pub(crate) struct XmlAttribute {
    pub(crate) name: &'static str,
    /// The value after substitution.
    pub(crate) value: String,
    /// The value in the file.
    pub(crate) span: Span,
}

/// One element.
#[derive(Debug)]
pub(crate) struct Element {
    /// Its kind and attributes in the format.
    pub(crate) tag: &'static Tag,
    /// Its opening `<tag`.
    pub(crate) span: Span,
    pub(crate) attributes: Vec<XmlAttribute>,
    pub(crate) children: Vec<ElementId>,
}

impl Element {
    pub(crate) fn attribute(&self, name: &str) -> Option<&XmlAttribute> {
        self.attributes.iter().find(|a| a.name == name)
    }

    /// The value of an attribute, or nothing.
    pub(crate) fn value(&self, name: &str) -> Option<&str> {
        self.attribute(name).map(|a| a.value.as_str())
    }

    /// The place of an attribute, or of the element if the attribute is not there.
    pub(crate) fn span_of(&self, name: &str) -> Span {
        self.attribute(name).map_or(self.span, |a| a.span)
    }
}

/// A scene file and all it includes. Element 0 is the root.
#[derive(Debug, Default)]
pub(crate) struct Document {
    pub(crate) sources: Sources,
    /// The files of versions before 2.
    pub(crate) old: BTreeSet<u32>,
    /// All elements; children come after their parents.
    pub(crate) elements: Vec<Element>,
    /// Elements with an `id`, and their aliases.
    pub(crate) ids: BTreeMap<String, ElementId>,
    /// Folders named by `path`.
    pub(crate) search: Vec<PathBuf>,
    /// Where readers of plugins record what they ask for, if it is wanted.
    pub(crate) questions: Option<Arc<Questions>>,
    /// The files that the scene is read from.
    pub(crate) files: SceneFiles,
    /// The text of a model that has no camera: its own stands for one that sees all of the model.
    pub(crate) unframed: Option<u32>,
    /// Whether picture files count as sRGB, whatever their own colour space.
    pub(crate) srgb_pictures: bool,
}

impl Document {
    pub(crate) fn element(&self, id: ElementId) -> &Element {
        &self.elements[id.0 as usize]
    }

    /// True for what stands in a file of a version before 2. A file that does not say of which is as the one that includes it.
    pub(crate) fn is_old(&self, span: Span) -> bool {
        self.old.contains(&span.file)
    }

    pub(crate) fn finding(&self, kind: FindingKind, span: Span, message: impl Into<String>) -> Finding {
        self.sources.finding(kind, span, message)
    }

    /// An error about a span, without advice.
    pub(crate) fn error(&self, kind: FindingKind, span: Span, message: impl Into<String>) -> SceneError {
        self.finding(kind, span, message).error()
    }

    /// Finds a file named in the scene: beside the file that names it, beside the root, then along each `path`.
    /// A file that does not exist anywhere is returned relative to the file that names it. `\` separates folders, too.
    pub(crate) fn resolve(&self, name: &str, from: Span) -> PathBuf {
        let name = &name.replace('\\', "/");
        let beside = |file| self.sources.path(file).parent().unwrap_or(Path::new("")).join(name);
        let (here, root) = (beside(from.file), beside(0));
        let mut others = std::iter::once(root).chain(self.search.iter().map(|p| p.join(name)));
        if here.exists() { here } else { others.find(|p| p.exists()).unwrap_or(here) }
    }
}
