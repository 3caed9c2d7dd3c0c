//! `<edit>`: one changed value of an object, as [`Edits::write`](crate::scene::edit::Edits::write) saves it.
//!
//! ```xml
//! <edit object="shape" id="lamp" name="emission_scale" value="2.0"/>
//! <edit object="shape" id="ball" name="to_world" value="1 0 0 2  0 1 0 0  0 0 1 0  0 0 0 1"/>
//! <edit object="medium" id="fog" name="density_scale" value="0.5"/>
//! <edit object="bsdf" index="3" count="5" type="diffuse" name="reflectance" value="0.1, 0.2, 0.3"/>
//! ```
//!
//! An object is named by its `id`; one without by its index among all of its sort, together with how many there are
//! and its plugin, so that a change of the original is noticed instead of another object being changed. Edits act in
//! their order, after everything is read. Mitsuba refuses the element, rather than showing the scene unedited.

use std::collections::{BTreeMap, BTreeSet};

use super::objects::address;
use super::parameters::parameters;
use super::target::{EditError, EditableParameter, ObjectKind};
use crate::scene::desc::SceneDesc;
use crate::scene::diagnostic::{FindingKind, SceneError, shorten};
use crate::scene::mitsuba::{Document, Element, ElementId, integer, numbers};
use crate::scene::suggest;

/// Objects with an id, by sort and id.
type Ids = BTreeMap<(&'static str, String), u32>;

/// Applies all edits of a scene to its description.
pub(crate) fn apply(
    document: &Document,
    desc: &mut SceneDesc,
    edits: &[ElementId],
) -> Result<(), SceneError> {
    if edits.is_empty() {
        return Ok(());
    }
    let ids = ids(desc);
    let mut done = BTreeSet::new();
    for &id in edits {
        let edit = Edit { document, element: document.element(id), desc };
        let (parameter, index) = edit.target(&ids)?;
        let span = edit.element.span;
        // A file that includes an edited scene may edit it further; one file that says two things is a mistake.
        if !done.insert((span.file, parameter.object.tag(), parameter.name, index)) {
            let found =
                document.finding(FindingKind::Reference, span, "this value is edited twice in this file");
            return Err(found.help("keep one of the two edits").error());
        }
        let given = numbers(edit.element.value("value").unwrap_or_default());
        let (value_span, name_span) = (edit.element.span_of("value"), edit.element.span_of("name"));
        let at = |message| document.error(FindingKind::Value, value_span, message);
        let given = given.map_err(at)?;
        let wrong =
            || at(format!("`{}` cannot have these numbers: {}", parameter.name, parameter.range.wanted()));
        let value = parameter.range.value(&given).ok_or_else(wrong)?;
        (parameter.target)(index).set(desc, value).map_err(|e| {
            let (kind, span) = match &e {
                EditError::NoTarget { .. } => (FindingKind::Reference, name_span),
                EditError::Value { .. } => (FindingKind::Value, value_span),
            };
            document.error(kind, span, e.to_string())
        })?;
    }
    Ok(())
}

/// Every object that has an id. The ids of a file are unique.
fn ids(desc: &SceneDesc) -> Ids {
    let mut ids = Ids::new();
    for object in ObjectKind::ALL {
        let all = (0..).map_while(|i| address(desc, object, i));
        for (i, found) in all.enumerate() {
            if let Some(id) = found.id {
                ids.entry((object.tag(), id.to_owned())).or_insert(i as u32);
            }
        }
    }
    ids
}

/// An edit on its way to a target.
struct Edit<'a> {
    document: &'a Document,
    element: &'a Element,
    desc: &'a SceneDesc,
}

impl Edit<'_> {
    /// Finds the value that is changed, and the index of its object.
    fn target(&self, ids: &Ids) -> Result<(&'static EditableParameter, u32), SceneError> {
        let text = |name: &str| self.element.value(name).unwrap_or_default();
        if let Some(&child) = self.element.children.first() {
            let span = self.document.element(child).span;
            return Err(self.document.error(FindingKind::Unknown, span, "an edit has attributes only"));
        }
        let Some(object) = ObjectKind::ALL.into_iter().find(|o| o.tag() == text("object")) else {
            let found = self.document.finding(
                FindingKind::Value,
                self.element.span_of("object"),
                "no such sort of object",
            );
            return Err(found.help("an edit changes a shape, a bsdf, an emitter or a medium").error());
        };
        let known = || parameters().filter(move |p| p.object == object);
        let Some(parameter) = known().find(|p| p.name == text("name")) else {
            let message = format!("a {} has no value of this name to edit", object.tag());
            let names: Vec<&str> = known().map(|p| p.name).collect();
            let found = self.document.finding(FindingKind::Unknown, self.element.span_of("name"), message);
            return Err(found.help(suggest::hint(text("name"), &names)).error());
        };
        let index = match self.element.value("id") {
            Some(id) => self.by_id(object, id, ids)?,
            None => self.by_index(object)?,
        };
        Ok((parameter, index))
    }

    fn by_id(&self, object: ObjectKind, id: &str, ids: &Ids) -> Result<u32, SceneError> {
        if let Some(extra) = ["index", "count", "type"].iter().find_map(|n| self.element.attribute(n)) {
            let message = "an edit names its object by `id`, or by `index`, `count` and `type`";
            return Err(self.document.error(FindingKind::Parameter, extra.span, message));
        }
        ids.get(&(object.tag(), id.to_owned())).copied().ok_or_else(|| {
            let message = format!("there is no {} with the id `{}`", object.tag(), shorten(id));
            let names: Vec<&str> =
                ids.keys().filter(|k| k.0 == object.tag()).map(|k| k.1.as_str()).take(1000).collect();
            let found = self.document.finding(FindingKind::Reference, self.element.span_of("id"), message);
            found.help(suggest::nearest_or(id, names, CHANGED)).error()
        })
    }

    /// The object of this index, if the scene has as many as it had and it is of the same kind.
    fn by_index(&self, object: ObjectKind) -> Result<u32, SceneError> {
        let [index, count] = [self.natural("index")?, self.natural("count")?];
        let Some(kind) = self.element.value("type") else {
            let message = "an edit of an object without `id` says its `index`, `count` and `type`";
            return Err(self.document.error(FindingKind::Missing, self.element.span, message));
        };
        let first = address(self.desc, object, 0).map_or(0, |a| a.count);
        if first as u64 != u64::from(count) {
            let message = format!("the scene has {first} of <{}>, not {count}", object.tag());
            return Err(self.changed("count", message));
        }
        let Some(found) = address(self.desc, object, index) else {
            let message =
                format!("there is no <{}> {index}: they are 0 to {}", object.tag(), count.saturating_sub(1));
            return Err(self.document.error(FindingKind::Reference, self.element.span_of("index"), message));
        };
        if found.kind != kind {
            let message = format!("<{}> {index} is `{}`, not `{}`", object.tag(), found.kind, shorten(kind));
            return Err(self.changed("type", message));
        }
        Ok(index)
    }

    /// The error of an attribute that fits the original no longer.
    fn changed(&self, name: &str, message: String) -> SceneError {
        let span = self.element.span_of(name);
        self.document.finding(FindingKind::Reference, span, message).help(CHANGED).error()
    }

    fn natural(&self, name: &'static str) -> Result<u32, SceneError> {
        let Some(a) = self.element.attribute(name) else {
            let message = format!("an edit of an object without `id` says its `{name}`");
            return Err(self.document.error(FindingKind::Missing, self.element.span, message));
        };
        let wrong = |m: String| self.document.error(FindingKind::Value, a.span, m);
        let v = integer(&a.value).map_err(wrong)?;
        u32::try_from(v).map_err(|_| wrong(format!("{v} is not from 0 to {}", u32::MAX)))
    }
}

/// Advice about an edit that does not fit.
const CHANGED: &str =
    "the included scene was changed since; make the edit anew, and give the object an id to be safe";
