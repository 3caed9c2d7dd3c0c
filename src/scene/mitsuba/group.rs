//! Groups of shapes, and the instances that show them.

use std::collections::BTreeSet;

use super::document::ElementId;
use super::params::Params;
use super::reader::Reader;
use super::shape;
use super::source::Span;
use crate::scene::desc::{BsdfId, GroupDesc, GroupId, ShapeDesc, ShapeKind};
use crate::scene::diagnostic::{FindingKind, SceneError};

/// The plugin of a group.
pub(crate) const GROUP: &str = "shapegroup";

/// The plugin of an instance.
pub(crate) const INSTANCE: &str = "instance";

/// Reads a group; once, wherever it stands and however often it is shown.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<GroupId, SceneError> {
    if let Some(&known) = reader.known_groups.get(&id) {
        return Ok(known);
    }
    let params = Params::new(reader.document, id)?;
    refuse(
        reader,
        &params,
        "a group has no material or light of its own",
        "put it into the shapes of the group",
    )?;
    let parts = params.objects("shape");
    if parts.is_empty() {
        let found = reader.document.finding(FindingKind::Missing, params.span(), "a group without shapes");
        return Err(found.help("put a <shape> into it").error());
    }
    let shapes = parts.into_iter().map(|part| member(reader, part)).collect::<Result<_, _>>()?;
    let name = params.element().value("id").map(str::to_owned);
    reader.groups.push(GroupDesc { id: name, place: reader.place(params.span()), shapes });
    let new = GroupId(reader.groups.len() as u32 - 1);
    reader.known_groups.insert(id, new);
    reader.finish(params);
    Ok(new)
}

/// One shape of a group; `span` is where the group names it.
fn member(reader: &mut Reader<'_>, (id, span): (ElementId, Span)) -> Result<ShapeDesc, SceneError> {
    let wrong = |reader: &Reader<'_>, span, message: &str, help: &str| {
        Err(reader.document.finding(FindingKind::Plugin, span, message).help(help).error())
    };
    match reader.document.element(id).value("type") {
        Some(GROUP) => return wrong(reader, span, "a group in a group", "put its shapes into this one"),
        Some(INSTANCE) => {
            let help = "put the shapes that it shows into the group";
            return wrong(reader, span, "an instance in a group", help);
        }
        _ => {}
    }
    let shape = shape::single(reader, id)?;
    if shape.emission.is_some() {
        let children = reader.document.element(id).children.iter().map(|c| reader.document.element(*c));
        let emitter = children.into_iter().find(|c| c.tag.name == "emitter").map_or(span, |e| e.span);
        let help = "what shines is a shape of the scene itself: move it out of the group";
        return wrong(reader, emitter, "a light in a group", help);
    }
    Ok(shape)
}

/// Reads an instance.
pub(crate) fn instance(reader: &mut Reader<'_>, id: ElementId) -> Result<ShapeDesc, SceneError> {
    let params = Params::new(reader.document, id)?;
    let help = "give it to the shapes of the group";
    refuse(reader, &params, "an instance has no material or light of its own", help)?;
    let groups = params.objects("shape");
    let wrong = |kind, span, message: String, help: &str| {
        Err(reader.document.finding(kind, span, message).help(help).error())
    };
    let (group, span) = match groups.as_slice() {
        [one] => *one,
        [] => {
            let help = "add <ref id=\"…\"/> with the id of a <shape type=\"shapegroup\">";
            let message = "an instance shows a group, and this one names none".to_owned();
            return wrong(FindingKind::Missing, params.span(), message, help);
        }
        [_, (_, second), ..] => {
            let message = "an instance shows one group, and this is a second one".to_owned();
            return wrong(FindingKind::Parameter, *second, message, "make another instance for it");
        }
    };
    let target = reader.document.element(group);
    if target.value("type") != Some(GROUP) {
        let plugin: String = target.value("type").unwrap_or_default().chars().take(64).collect();
        let message = format!("an instance shows a `{GROUP}`, and this is the shape `{plugin}`");
        let help = "put the shape into a <shape type=\"shapegroup\"> and refer to that";
        return wrong(FindingKind::Reference, span, message, help);
    }
    let group = read(reader, group)?;
    let shape = ShapeDesc {
        id: params.element().value("id").map(str::to_owned),
        place: reader.place(params.span()),
        kind: ShapeKind::Instance(group),
        to_world: params.to_world()?,
        flip_normals: false,
        bsdf: BsdfId::NONE,
        emission: None,
    };
    reader.finish(params);
    Ok(shape)
}

/// Refuses materials and lights among the children of a group or an instance.
fn refuse(reader: &Reader<'_>, params: &Params<'_>, message: &str, help: &str) -> Result<(), SceneError> {
    let found = ["bsdf", "emitter"].into_iter().find_map(|tag| params.objects(tag).first().copied());
    let at = |span| reader.document.finding(FindingKind::Parameter, span, message).help(help).error();
    found.map_or(Ok(()), |(_, span)| Err(at(span)))
}

/// Remarks on groups that no instance shows.
pub(crate) fn unseen(reader: &mut Reader<'_>) {
    let shown: BTreeSet<u32> =
        reader.shapes.iter().filter_map(|s| instance_of(&s.kind)).map(|g| g.0).collect();
    for (id, group) in std::mem::take(&mut reader.known_groups) {
        if !shown.contains(&group.0) {
            let span = reader.document.element(id).span;
            let found = reader.document.finding(FindingKind::Parameter, span, "no instance shows this group");
            reader.warn(found.help("it is not seen: add a <shape type=\"instance\"> for it").advice());
        }
    }
}

fn instance_of(kind: &ShapeKind) -> Option<GroupId> {
    match kind {
        ShapeKind::Instance(id) => Some(*id),
        _ => None,
    }
}
