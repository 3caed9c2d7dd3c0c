//! The elements of the format and their attributes.

/// The kind of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TagKind {
    /// The root.
    Scene,
    /// Acts on the reader itself and leaves no element.
    Directive,
    /// A plugin.
    Object,
    /// Another element by its id.
    Ref,
    /// A named value.
    Value,
    /// A named transform.
    Transform,
    /// A step of a transform.
    Step,
    /// A change to an object of the scene, saved by the viewer; not part of Mitsuba's format.
    Edit,
}

/// An element of the format.
#[derive(Debug)]
pub(crate) struct Tag {
    pub(crate) name: &'static str,
    pub(crate) kind: TagKind,
    /// Attributes it may have.
    pub(crate) attributes: &'static [&'static str],
    /// Attributes it must have.
    pub(crate) required: &'static [&'static str],
}

/// `version` stands in the root of an included file, which may be a plugin.
const PLUGIN: &[&str] = &["type", "id", "name", "version"];
const NAMED: &[&str] = &["name", "value"];
/// `intent` is of version 0.6, where it said what the role of a parameter says here.
const COLOR: &[&str] = &["name", "value", "intent"];
const EDIT: &[&str] = &["object", "id", "index", "count", "type", "name", "value"];
const XYZ: &[&str] = &["name", "value", "x", "y", "z"];

const fn tag(
    name: &'static str,
    kind: TagKind,
    attributes: &'static [&'static str],
    required: &'static [&'static str],
) -> Tag {
    Tag { name, kind, attributes, required }
}

const fn plugin(name: &'static str) -> Tag {
    tag(name, TagKind::Object, PLUGIN, &["type"])
}

const fn value(name: &'static str) -> Tag {
    tag(name, TagKind::Value, NAMED, NAMED)
}

/// Every element of the format. An element that is not here is an error.
pub(crate) const TAGS: &[Tag] = &[
    tag("scene", TagKind::Scene, &["version", "type", "id", "name"], &[]),
    tag("default", TagKind::Directive, NAMED, NAMED),
    tag("include", TagKind::Directive, &["filename"], &["filename"]),
    tag("path", TagKind::Directive, &["value"], &["value"]),
    tag("alias", TagKind::Directive, &["id", "as"], &["id", "as"]),
    tag("edit", TagKind::Edit, EDIT, &["object", "name", "value"]),
    tag("ref", TagKind::Ref, &["id", "name"], &["id"]),
    plugin("shape"),
    plugin("bsdf"),
    plugin("emitter"),
    plugin("sensor"),
    plugin("film"),
    plugin("rfilter"),
    plugin("integrator"),
    plugin("sampler"),
    plugin("texture"),
    plugin("medium"),
    plugin("phase"),
    plugin("volume"),
    plugin("subsurface"),
    value("float"),
    value("integer"),
    value("boolean"),
    value("string"),
    tag("rgb", TagKind::Value, COLOR, NAMED),
    tag("srgb", TagKind::Value, COLOR, NAMED),
    tag("spectrum", TagKind::Value, &["name", "value", "filename", "type", "id", "intent"], &[]),
    tag("blackbody", TagKind::Value, &["name", "temperature", "scale"], &["name", "temperature"]),
    tag("point", TagKind::Value, XYZ, &["name"]),
    tag("vector", TagKind::Value, XYZ, &["name"]),
    tag("transform", TagKind::Transform, &["name"], &["name"]),
    tag("translate", TagKind::Step, &["value", "x", "y", "z"], &[]),
    tag("scale", TagKind::Step, &["value", "x", "y", "z"], &[]),
    tag("rotate", TagKind::Step, &["value", "x", "y", "z", "angle"], &["angle"]),
    tag("lookat", TagKind::Step, &["origin", "target", "up"], &["origin", "target"]),
    tag("matrix", TagKind::Step, &["value"], &["value"]),
];

pub(crate) fn find(name: &str) -> Option<&'static Tag> {
    TAGS.iter().find(|t| t.name == name)
}
