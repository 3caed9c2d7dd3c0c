//! Expands text to a [`Document`]: XML, `default` and `$name`, `include`, `path`, `alias`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use roxmltree::{Node, ParsingOptions};

use super::document::{Document, Element, ElementId, XmlAttribute};
use super::prescan;
use super::source::Span;
use super::tags::{self, TAGS, Tag, TagKind};
use super::upgrade;
use super::variables::{Unresolved, Variables};
use crate::scene::diagnostic::{Finding, FindingKind, LineAt, SceneError, SceneWarning};
use crate::scene::files::LoadProgress;
use crate::scene::suggest;
use crate::scene::{limits, model};

/// Reads texts into a [`Document`].
pub(crate) struct Expander {
    document: Document,
    warnings: Vec<SceneWarning>,
    variables: Variables,
    /// The text being read is of a version before 2, or does not say of which.
    old: bool,
    /// It was made of a model: a `$` in it is nothing but that.
    literal: bool,
    /// Files being read, outermost first, to see cycles.
    open: Vec<PathBuf>,
    includes: usize,
    bytes: u64,
}

/// The document, with the warnings about it.
pub(crate) type Expanded = (Document, Vec<SceneWarning>);

impl Expander {
    /// A reader with the `-D name=value` of the command line; the last of two with one name counts.
    pub(crate) fn new(overrides: &[(String, String)]) -> Self {
        Self {
            document: Document::default(),
            warnings: Vec::new(),
            variables: Variables::new(overrides),
            old: true,
            literal: false,
            open: Vec::new(),
            includes: 0,
            bytes: 0,
        }
    }

    /// Tells `progress` of every file.
    pub(crate) fn telling(mut self, progress: Arc<LoadProgress>) -> Self {
        self.document.files.progress = progress;
        self
    }

    /// Adds files that are only in memory.
    pub(crate) fn with_files(mut self, files: BTreeMap<PathBuf, Vec<u8>>) -> Self {
        self.document.files.add(files);
        self
    }

    pub(crate) fn file(mut self, path: &Path) -> Result<Expanded, SceneError> {
        self.open.push(canonical(path));
        self.read(path, None, 0, |_, kind, message| unreadable(path, kind, message))?;
        Ok(self.done())
    }

    /// Reads a text in place of a file called `name`.
    pub(crate) fn string(mut self, name: &Path, text: &[u8]) -> Result<Expanded, SceneError> {
        self.open.push(canonical(name));
        self.text(name.to_owned(), text, None, 0)?;
        Ok(self.done())
    }

    fn done(mut self) -> Expanded {
        self.warnings.extend(self.variables.unused());
        (self.document, self.warnings)
    }

    /// Reads a file: a text, or a model, of which one is made. `refuse` makes the error where it cannot be opened.
    fn read(
        &mut self,
        path: &Path,
        parent: Option<ElementId>,
        depth: usize,
        refuse: impl Fn(&Document, FindingKind, String) -> SceneError,
    ) -> Result<(), SceneError> {
        let Some(format) = model::ModelFormat::of(path) else {
            let bytes = self.document.files.read(path, limits::XML_BYTES);
            let bytes = bytes.map_err(|e| refuse(&self.document, e.kind(), e.to_string()))?.into_owned();
            return self.text(path.to_owned(), &bytes, parent, depth);
        };
        let model = model::read(path, format, &self.document.files)?;
        self.document.files.add(model.files);
        model.warnings.into_iter().for_each(|finding| self.warn(finding));
        if model.unframed {
            self.document.unframed.get_or_insert(self.document.sources.paths().len() as u32);
        }
        self.document.srgb_pictures |= model.srgb_pictures;
        let outer = std::mem::replace(&mut self.literal, true);
        let read = self.text(path.to_owned(), model.text.as_bytes(), parent, depth);
        self.literal = outer;
        read
    }

    /// Reads one text: the root of the scene, or what an `include` names.
    fn text(
        &mut self,
        path: PathBuf,
        bytes: &[u8],
        parent: Option<ElementId>,
        depth: usize,
    ) -> Result<(), SceneError> {
        let text = String::from_utf8_lossy(bytes);
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        let file = self.document.sources.add(path, text);
        if let Err(e) = std::str::from_utf8(bytes) {
            let at = text.find('\u{fffd}').unwrap_or(e.valid_up_to());
            let found = self.finding(FindingKind::Syntax, Span::new(file, at..at + 3), "this is not UTF-8");
            return Err(found.help("save the file as UTF-8 text").error());
        }
        self.account(text.len(), Span::new(file, 0..1))?;
        if let Err(e) = prescan::check(text) {
            let found = self.finding(FindingKind::Limit, Span::new(file, e.at), e.message);
            return Err(found.help("write the scene without it").error());
        }
        let options = ParsingOptions { nodes_limit: 4 * limits::ELEMENTS as u32, ..Default::default() };
        let xml = match roxmltree::Document::parse_with_options(text, options) {
            Ok(xml) => xml,
            Err(e) => return Err(self.syntax(file, text, &e)),
        };
        let root = xml.root_element();
        let included_by = parent.map(|parent| self.document.element(parent).span);
        let version = root.attribute("version").map(upgrade::is_old);
        if version.unwrap_or_else(|| included_by.is_some_and(|span| self.document.is_old(span))) {
            self.document.old.insert(file);
        }
        let outer = self.old;
        self.old = version.unwrap_or(outer);
        let read = match parent {
            None if root.tag_name().name() != "scene" => {
                let message = format!("a scene starts with <scene>, not with <{}>", root.tag_name().name());
                Err(self.document.error(FindingKind::Syntax, name_span(file, root), message))
            }
            Some(parent) if root.tag_name().name() == "scene" => self.children(file, root, parent, depth),
            parent => self.node(file, root, parent, depth),
        };
        self.old = outer;
        read
    }

    /// Counts text against the limit for a whole scene.
    fn account(&mut self, bytes: usize, at: Span) -> Result<(), SceneError> {
        self.bytes += bytes as u64;
        if self.bytes > limits::TOTAL_XML_BYTES {
            let message = format!("the scene has more than {} bytes of text", limits::TOTAL_XML_BYTES);
            let found = self.finding(FindingKind::Limit, at, message);
            return Err(found.help("includes and `$names` count each time they are used").error());
        }
        Ok(())
    }

    fn syntax(&self, file: u32, text: &str, error: &roxmltree::Error) -> SceneError {
        use roxmltree::Error::{NoRootNode, UnclosedRootNode, UnexpectedEndOfStream};
        let at = match error {
            NoRootNode | UnclosedRootNode | UnexpectedEndOfStream => text.trim_end().len().saturating_sub(1),
            _ => self.document.sources.offset(file, error.pos().row as usize, error.pos().col as usize),
        };
        let mut message = error.to_string();
        if let Some(cut) = message.rfind(" at ") {
            message.truncate(cut); // the place stands beside it
        }
        let found = self.finding(FindingKind::Syntax, Span::new(file, at..at + 1), message);
        found.help("the XML is not well-formed; is something cut off, or not closed?").error()
    }

    /// Reads what stands between the tags of `node` into `parent`.
    fn children(
        &mut self,
        file: u32,
        node: Node<'_, '_>,
        parent: ElementId,
        depth: usize,
    ) -> Result<(), SceneError> {
        for child in node.children() {
            if child.is_element() {
                self.node(file, child, Some(parent), depth + 1)?;
            } else if child.is_text() && child.text().is_some_and(|t| !t.trim().is_empty()) {
                let skip = child.text().map_or(0, |t| t.len() - t.trim_start().len());
                let start = child.range().start;
                let span = Span::new(file, (start + skip).min(child.range().end)..child.range().end);
                let found = self.finding(FindingKind::Unknown, span, "text between elements is not used");
                self.warn(found.help("put values into attributes, or this into a comment").warning());
            }
        }
        Ok(())
    }

    fn finding(&self, kind: FindingKind, span: Span, message: impl Into<String>) -> Finding {
        self.document.finding(kind, span, message)
    }

    fn warn(&mut self, warning: SceneWarning) {
        if self.warnings.len() < limits::WARNINGS {
            self.warnings.push(warning);
        }
    }

    fn node(
        &mut self,
        file: u32,
        node: Node<'_, '_>,
        parent: Option<ElementId>,
        depth: usize,
    ) -> Result<(), SceneError> {
        let span = name_span(file, node);
        let name = node.tag_name().name();
        let name = if self.old { upgrade::element(name) } else { name };
        let Some(tag) = tags::find(name) else {
            let all: Vec<&str> = TAGS.iter().map(|t| t.name).collect();
            let found = self.finding(FindingKind::Unknown, span, format!("unknown element <{name}>"));
            return Err(found.help(suggest::hint(name, &all)).error());
        };
        if depth > limits::NESTING || self.document.elements.len() >= limits::ELEMENTS {
            let (count, depth) = (limits::ELEMENTS, limits::NESTING);
            let message =
                format!("more than {count} elements, or deeper than {depth}, counted through includes");
            return Err(self.document.error(FindingKind::Limit, span, message));
        }
        if tag.kind == TagKind::Scene && parent.is_some() {
            let message = "a scene cannot stand inside a scene";
            return Err(self.document.error(FindingKind::Syntax, span, message));
        }
        let element =
            Element { tag, span, attributes: self.attributes(file, node, tag)?, children: Vec::new() };
        match (tag.kind, parent) {
            (TagKind::Directive, Some(parent)) => self.directive(&element, parent, depth),
            (TagKind::Directive, None) => Ok(()),
            _ => {
                let id = self.push(element, parent)?;
                self.children(file, node, id, depth)?;
                if self.old && tag.kind == TagKind::Object {
                    upgrade::plugin(&mut self.document, id);
                }
                Ok(())
            }
        }
    }

    fn push(&mut self, element: Element, parent: Option<ElementId>) -> Result<ElementId, SceneError> {
        let id = ElementId(self.document.elements.len() as u32);
        if let (TagKind::Object | TagKind::Value, Some(name)) = (element.tag.kind, element.attribute("id")) {
            self.register(&name.value, id, name.span)?;
        }
        self.document.elements.push(element);
        if let Some(parent) = parent {
            self.document.elements[parent.0 as usize].children.push(id);
        }
        Ok(id)
    }

    fn register(&mut self, name: &str, id: ElementId, span: Span) -> Result<(), SceneError> {
        if self.document.ids.insert(name.to_owned(), id).is_some() {
            let found = self.finding(FindingKind::Reference, span, format!("the id `{name}` is used twice"));
            return Err(found.help("give each element an id of its own").error());
        }
        Ok(())
    }

    fn attributes(
        &mut self,
        file: u32,
        node: Node<'_, '_>,
        tag: &'static Tag,
    ) -> Result<Vec<XmlAttribute>, SceneError> {
        let mut attributes = Vec::with_capacity(node.attributes().len());
        for a in node.attributes() {
            let Some(name) = tag.attributes.iter().find(|n| **n == a.name()) else {
                let span = Span::new(file, a.range());
                let message = format!("<{}> has no attribute `{}`", tag.name, a.name());
                let found = self.finding(FindingKind::Unknown, span, message);
                return Err(found.help(suggest::hint(a.name(), tag.attributes)).error());
            };
            let span = Span::new(file, a.range_value());
            let mut value = self.substitute(a.value(), span)?;
            let named =
                matches!(tag.kind, TagKind::Object | TagKind::Ref | TagKind::Value | TagKind::Transform);
            if self.old && named && a.name() == "name" {
                value = upgrade::snake_case(&value);
            }
            attributes.push(XmlAttribute { name, value, span });
        }
        for required in tag.required {
            if !attributes.iter().any(|a| a.name == *required) {
                let message = format!("<{}> needs the attribute `{required}`", tag.name);
                let span = name_span(file, node);
                return Err(self.document.error(FindingKind::Missing, span, message));
            }
        }
        Ok(attributes)
    }

    /// The value of an attribute with its `$names` replaced.
    fn substitute(&mut self, value: &str, span: Span) -> Result<String, SceneError> {
        if self.literal || !value.contains('$') {
            return Ok(value.to_owned());
        }
        match self.variables.substitute(value) {
            Ok(value) => self.account(value.len(), span).map(|()| value),
            Err(Unresolved::TooLong) => {
                let message = format!("a value grows beyond {} bytes", limits::SUBSTITUTED_BYTES);
                Err(self.document.error(FindingKind::Limit, span, message))
            }
            Err(Unresolved::Unknown(name)) => {
                let found = self.finding(FindingKind::Reference, span, format!("`${name}` has no value"));
                let help = format!("add <default name=\"{name}\" value=\"…\"/> before it, or -D {name}=…");
                Err(found.help(help).error())
            }
        }
    }

    fn directive(&mut self, element: &Element, parent: ElementId, depth: usize) -> Result<(), SceneError> {
        let value = |name| element.value(name).unwrap_or_default();
        match element.tag.name {
            "default" => {
                self.variables.set_default(value("name"), value("value"));
                Ok(())
            }
            "path" => {
                let folder = self.document.resolve(value("value"), element.span);
                if !folder.is_dir() {
                    let message = format!("there is no folder {}", folder.display());
                    let found = self.finding(FindingKind::File, element.span_of("value"), message);
                    self.warn(found.help("paths are relative to the file that names them").warning());
                }
                if self.document.search.len() >= limits::SEARCH_PATHS {
                    let message = format!("more than {} search paths", limits::SEARCH_PATHS);
                    return Err(self.document.error(FindingKind::Limit, element.span, message));
                }
                if !self.document.search.contains(&folder) {
                    self.document.search.push(folder);
                }
                Ok(())
            }
            "alias" => {
                let Some(&target) = self.document.ids.get(value("id")) else {
                    let message = format!("there is no `{}` above this alias", value("id"));
                    let found = self.finding(FindingKind::Reference, element.span_of("id"), message);
                    return Err(found.help("an alias stands after what it renames").error());
                };
                self.register(value("as"), target, element.span_of("as"))
            }
            _ => self.include(element, parent, depth),
        }
    }

    fn include(&mut self, element: &Element, parent: ElementId, depth: usize) -> Result<(), SceneError> {
        let span = element.span_of("filename");
        let refuse = |d: &Document, kind, message: String| Err(d.finding(kind, span, message).error());
        let path = self.document.resolve(element.value("filename").unwrap_or_default(), span);
        let real = canonical(&path);
        if self.open.contains(&real) {
            let message = format!("{} includes itself", path.display());
            return refuse(&self.document, FindingKind::Reference, message);
        }
        self.includes += 1;
        if self.open.len() > limits::INCLUDE_DEPTH || self.includes > limits::INCLUDES {
            let (depth, count) = (limits::INCLUDE_DEPTH, limits::INCLUDES);
            let message = format!("more than {count} includes, or more than {depth} within each other");
            return refuse(&self.document, FindingKind::Limit, message);
        }
        self.open.push(real);
        self.read(&path, Some(parent), depth, |d, kind, message| d.finding(kind, span, message).error())?;
        self.open.pop();
        Ok(())
    }
}

/// A path that is the same however a file is named.
fn canonical(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}

/// The opening `<tag` of a node.
fn name_span(file: u32, node: Node<'_, '_>) -> Span {
    let start = node.range().start;
    Span::new(file, start..start + 1 + node.tag_name().name().len())
}

fn unreadable(path: &Path, kind: FindingKind, message: String) -> SceneError {
    let file = path.to_string_lossy();
    let at = LineAt { file: &file, text: "", line: 1, column: 1, range: (0, 0) };
    Finding::new(kind, at, message).help("give the path of a scene file").error()
}
