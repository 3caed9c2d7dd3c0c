//! The parameters of one plugin. A parameter that the plugin does not ask for is reported.

use std::cell::{Cell, RefCell};

use glam::{DAffine3, DVec3};

use super::document::{Document, Element, ElementId};
use super::question::Question;
use super::source::Span;
use super::tags::TagKind;
use super::{transform, value};
use crate::scene::diagnostic::{Finding, FindingKind, SceneError, SceneWarning, shorten};
use crate::scene::suggest;

/// One child of a plugin, with references followed.
struct PluginChild<'d> {
    name: Option<&'d str>,
    element: ElementId,
    /// Place of the child itself (for a `ref`, not of its target).
    span: Span,
    used: Cell<bool>,
}

/// A plugin and its parameters.
pub(crate) struct Params<'d> {
    document: &'d Document,
    pub(crate) id: ElementId,
    children: Vec<PluginChild<'d>>,
    asked: RefCell<Vec<&'static str>>,
    /// Parameters of Mitsuba that change nothing here.
    idle: RefCell<Vec<(&'static str, Span)>>,
    notes: RefCell<Vec<SceneWarning>>,
}

impl<'d> Params<'d> {
    /// Lists the children of a plugin; refuses elements that cannot stand there, names given twice and
    /// references to nothing.
    pub(crate) fn new(document: &'d Document, id: ElementId) -> Result<Self, SceneError> {
        let plugin = document.element(id);
        let mut children: Vec<PluginChild<'d>> = Vec::with_capacity(plugin.children.len());
        let mut names = std::collections::BTreeSet::new();
        for &child in &plugin.children {
            let element = document.element(child);
            let target = match element.tag.kind {
                TagKind::Ref => follow(document, element)?,
                TagKind::Object | TagKind::Value | TagKind::Transform => child,
                _ => {
                    let message = format!("<{}> cannot stand in <{}>", element.tag.name, plugin.tag.name);
                    let found = document.finding(FindingKind::Unknown, element.span, message);
                    let help = match element.tag.kind {
                        TagKind::Edit => "a change stands in the scene itself, after what it changes",
                        _ => "steps of a transform stand in <transform name=\"to_world\">",
                    };
                    return Err(found.help(help).error());
                }
            };
            let name = element.value("name");
            if let Some(name) = name.filter(|n| !names.insert(*n)) {
                let message = format!("`{name}` is given twice");
                let span = element.span_of("name");
                return Err(document.error(FindingKind::Parameter, span, message));
            }
            children.push(PluginChild { name, element: target, span: element.span, used: Cell::new(false) });
        }
        let (asked, idle, notes) = Default::default();
        Ok(Self { document, id, children, asked, idle, notes })
    }

    pub(crate) fn element(&self) -> &'d Element {
        self.document.element(self.id)
    }

    pub(crate) fn plugin(&self) -> &'d str {
        self.element().value("type").unwrap_or_default()
    }

    pub(crate) fn span(&self) -> Span {
        self.element().span
    }

    /// The child of this name, now counted as used.
    pub(crate) fn get(&self, name: &'static str) -> Option<&'d Element> {
        self.find(name).map(|e| self.document.element(e.element))
    }

    /// The id of the child of this name, now counted as used.
    pub(crate) fn get_id(&self, name: &'static str) -> Option<ElementId> {
        self.find(name).map(|e| e.element)
    }

    /// Records a question, if the document wants it.
    pub(crate) fn ask(&self, name: &'static str, question: impl FnOnce() -> Question) {
        if let Some(questions) = &self.document.questions
            && let Ok(mut questions) = questions.lock()
        {
            questions.push((self.id, name, question()));
        }
    }

    /// Tells documentation what a parameter is if it is not given. The methods with a default do so by themselves.
    pub(crate) fn default(&self, name: &'static str, default: impl std::fmt::Display) {
        self.ask(name, || Question::Default(default.to_string()));
    }

    fn find(&self, name: &'static str) -> Option<&PluginChild<'d>> {
        self.ask(name, || Question::Given);
        if !self.asked.borrow().contains(&name) {
            self.asked.borrow_mut().push(name);
        }
        let found = self.children.iter().find(|e| e.name == Some(name));
        found.inspect(|e| e.used.set(true))
    }

    /// True when the parameter stands in the file; counts as asking for it.
    pub(crate) fn has(&self, name: &'static str) -> bool {
        self.find(name).is_some()
    }

    /// A finding about the plugin as a whole.
    pub(crate) fn fault(&self, kind: FindingKind, message: impl Into<String>) -> Finding {
        self.document.finding(kind, self.span(), message)
    }

    /// A finding about the plugin's `type`.
    pub(crate) fn type_fault(&self, message: impl Into<String>) -> Finding {
        self.document.finding(FindingKind::Plugin, self.element().span_of("type"), message)
    }

    /// The required name of a file with this ending.
    pub(crate) fn filename(&self, what: &str, ending: &str) -> Result<String, SceneError> {
        self.ask("filename", || Question::File(ending.to_owned()));
        self.string("filename")?.ok_or_else(|| {
            let found = self.fault(FindingKind::Missing, format!("{what} needs `filename`"));
            found.help(format!("add <string name=\"filename\" value=\"….{ending}\"/>")).error()
        })
    }

    /// An error at a parameter's value, or at the plugin if the parameter is not there.
    pub(crate) fn error(&self, name: &'static str, message: impl Into<String>) -> Finding {
        let child = self.children.iter().find(|e| e.name == Some(name));
        let span = child.map_or(self.span(), |e| self.document.element(e.element).span_of("value"));
        self.document.finding(FindingKind::Value, span, message)
    }

    /// Keeps a warning or a remark until [`Params::finish`].
    pub(crate) fn note(&self, warning: SceneWarning) {
        self.notes.borrow_mut().push(warning);
    }

    fn typed<T>(
        &self,
        name: &'static str,
        tags: &'static [&'static str],
        parse: impl Fn(&Element) -> Result<T, (Span, String)>,
    ) -> Result<Option<T>, SceneError> {
        self.ask(name, || Question::Value(tags));
        let Some(element) = self.get(name) else { return Ok(None) };
        if !tags.contains(&element.tag.name) {
            let message = format!("`{name}` is a <{}>, not a <{}>", tags.join("> or <"), element.tag.name);
            return Err(self.document.error(FindingKind::Parameter, element.span, message));
        }
        let at = |(span, message)| self.document.error(FindingKind::Value, span, message);
        parse(element).map(Some).map_err(at)
    }

    pub(crate) fn float(&self, name: &'static str) -> Result<Option<f64>, SceneError> {
        let exact = |text: &str| value::integer(text).map(|n| n as f64);
        self.typed(name, &["float", "integer"], |e| match e.tag.name {
            "integer" => plain(e, exact),
            _ => plain(e, value::number),
        })
    }

    pub(crate) fn float_or(&self, name: &'static str, default: f64) -> Result<f64, SceneError> {
        self.default(name, default);
        Ok(self.float(name)?.unwrap_or(default))
    }

    pub(crate) fn integer(&self, name: &'static str) -> Result<Option<i64>, SceneError> {
        self.typed(name, &["integer"], |e| plain(e, value::integer))
    }

    pub(crate) fn integer_or(&self, name: &'static str, default: i64) -> Result<i64, SceneError> {
        self.default(name, default);
        Ok(self.integer(name)?.unwrap_or(default))
    }

    pub(crate) fn boolean(&self, name: &'static str, default: bool) -> Result<bool, SceneError> {
        self.default(name, default);
        Ok(self.typed(name, &["boolean"], |e| plain(e, value::boolean))?.unwrap_or(default))
    }

    pub(crate) fn string(&self, name: &'static str) -> Result<Option<String>, SceneError> {
        self.typed(name, &["string"], |e| Ok(e.value("value").unwrap_or_default().to_owned()))
    }

    /// A colour in linear RGB.
    pub(crate) fn rgb(&self, name: &'static str) -> Result<Option<[f64; 3]>, SceneError> {
        self.typed(name, &["rgb"], |e| plain(e, value::rgb))
    }

    pub(crate) fn point_or(&self, name: &'static str, default: DVec3) -> Result<DVec3, SceneError> {
        self.default(name, format!("{}, {}, {}", default.x, default.y, default.z));
        Ok(self.point(name)?.unwrap_or(default))
    }

    pub(crate) fn point(&self, name: &'static str) -> Result<Option<DVec3>, SceneError> {
        self.typed(name, &["point", "vector"], |e| transform::components(e, None))
    }

    /// `to_world`: the identity unless given; invertible.
    pub(crate) fn to_world(&self) -> Result<DAffine3, SceneError> {
        self.transform("to_world")
    }

    /// A transform: the identity unless given; invertible.
    pub(crate) fn transform(&self, name: &'static str) -> Result<DAffine3, SceneError> {
        let matrix = self.typed(name, &["transform"], |e| transform::parse(self.document, e))?;
        if let Some(element) = self.get(name)
            && let Some(span) = transform::axis_of_other_length(self.document, element)
        {
            let message = "the axis of this rotation has not the length 1: its direction is used";
            let found = self.document.finding(FindingKind::Value, span, message);
            self.note(
                found.help("Mitsuba 3 shears what it turns about such an axis; give a unit vector").warning(),
            );
        }
        Ok(matrix.unwrap_or(DAffine3::IDENTITY))
    }

    /// All children with this tag (references followed), now counted as used.
    pub(crate) fn objects(&self, tag: &'static str) -> Vec<(ElementId, Span)> {
        self.ask(tag, || Question::Nested);
        let of_tag = self.children.iter().filter(|e| self.document.element(e.element).tag.name == tag);
        of_tag.inspect(|e| e.used.set(true)).map(|e| (e.element, e.span)).collect()
    }

    /// The only child with this tag, if there is one. A second is an error.
    pub(crate) fn object(&self, tag: &'static str) -> Result<Option<ElementId>, SceneError> {
        match self.objects(tag).as_slice() {
            [] => Ok(None),
            [(id, _)] => Ok(Some(*id)),
            [_, (_, span), ..] => {
                let message =
                    format!("a second <{tag}>; only one can stand in a <{}>", self.element().tag.name);
                Err(self.document.error(FindingKind::Parameter, *span, message))
            }
        }
    }

    /// Parameters that exist in Mitsuba but change nothing here: one remark for all of them, no warning.
    pub(crate) fn without_effect(&self, names: &[&'static str]) {
        names.iter().for_each(|name| self.ask(name, || Question::Idle));
        let given = names.iter().filter_map(|name| self.find(name).map(|child| (*name, child.span)));
        self.idle.borrow_mut().extend(given);
    }

    /// Children with this tag that change nothing here, whatever their names: a remark on the first.
    pub(crate) fn tag_without_effect(&self, tag: &str, message: &str) {
        let of_tag = self.children.iter().filter(|e| self.document.element(e.element).tag.name == tag);
        if let Some(first) = of_tag.inspect(|e| e.used.set(true)).map(|e| e.span).reduce(|first, _| first) {
            self.note(self.document.finding(FindingKind::Parameter, first, message).advice());
        }
    }

    /// One remark on all children that were not asked for: those of a plugin whose place another one takes.
    pub(crate) fn rest_without_effect(&self) {
        let rest = self.children.iter().filter(|e| !e.used.replace(true));
        let names: Vec<String> = rest.filter_map(|e| e.name).map(|n| format!("`{}`", shorten(n))).collect();
        let what = match names.as_slice() {
            [] => return,
            [one] => format!("{one} has no effect"),
            [first, rest @ ..] => format!("{first} and {} more parameters have no effect", rest.len()),
        };
        let message =
            format!("{what} in this program, which renders `{}` in its own way", shorten(self.plugin()));
        self.note(self.fault(FindingKind::Parameter, message).advice());
    }

    /// Warns about every child that was not asked for, and returns all warnings of this plugin. What a film or a sampler
    /// does not know changes no light: that is a remark.
    pub(crate) fn finish(self) -> Vec<SceneWarning> {
        let asked = self.asked.into_inner();
        let mut notes = self.notes.into_inner();
        if let [(_, first), others @ ..] = self.idle.borrow().as_slice() {
            let names: Vec<String> = self.idle.borrow().iter().map(|(name, _)| format!("`{name}`")).collect();
            let have = if others.is_empty() { "has" } else { "have" };
            let message = format!("{} {have} no effect in this program", names.join(", "));
            notes.push(self.document.finding(FindingKind::Parameter, *first, message).advice());
        }
        let plugin = self.document.element(self.id);
        let (group, kind) = (plugin.tag.name, plugin.value("type").unwrap_or_default());
        for e in self.children.iter().filter(|e| !e.used.get()) {
            let what = self.document.element(e.element).tag.name;
            let message = match e.name {
                Some(name) => format!("the {group} `{kind}` has no `{name}`"),
                None => format!("this {what} has no use in the {group} `{kind}`"),
            };
            let found = self.document.finding(FindingKind::Parameter, e.span, message);
            let help = match e.name {
                _ if (group, what) == ("shape", "medium") => {
                    "a medium of a shape has the name `interior` or `exterior`".into()
                }
                Some(name) if !asked.is_empty() => suggest::hint(name, &asked),
                _ => "it is not used: remove it".into(),
            };
            let found = found.help(help).label("not used");
            let detail = matches!(group, "film" | "rfilter" | "sampler");
            notes.push(if detail { found.advice() } else { found.warning() });
        }
        notes
    }
}

fn plain<T>(element: &Element, parse: impl Fn(&str) -> Result<T, String>) -> Result<T, (Span, String)> {
    parse(element.value("value").unwrap_or_default()).map_err(|message| (element.span_of("value"), message))
}

/// The element a `ref` names.
pub(crate) fn follow(document: &Document, reference: &Element) -> Result<ElementId, SceneError> {
    let id = reference.value("id").unwrap_or_default();
    document.ids.get(id).copied().ok_or_else(|| {
        let names: Vec<&str> = document.ids.keys().map(String::as_str).take(1000).collect();
        let message = format!("there is no element with the id `{}`", shorten(id));
        let found = document.finding(FindingKind::Reference, reference.span_of("id"), message);
        found.help(suggest::nearest_or(id, names, "give the element meant an id")).error()
    })
}
