//! Shapes, groups of shapes, and the instances that show groups.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::attribute;
use super::document::{Document, ElementId};
use super::emitter::{self, AreaEmission};
use super::params::Params;
use super::reader::{MeteredShape, Reader};
use super::source::Span;
use super::subsurface;
use crate::scene::desc::emission_texture::EmissionProfile;
use crate::scene::desc::{
    BsdfId, CurveBasis, GroupDesc, GroupId, MediumInterface, MeshId, Name, ShapeDesc, ShapeKind,
};
use crate::scene::diagnostic::{FindingKind, SceneError, shorten};
use crate::scene::limits;
use crate::scene::mesh::curves;
use crate::scene::mesh::{self, MeshFormat, MeshOptions};

/// Reader of one shape's geometry, given its `to_world`.
pub(super) type ShapePlugin = fn(&mut Reader<'_>, &Params<'_>, &DAffine3) -> Result<ShapeKind, SceneError>;

/// Every shape with geometry of its own.
pub(super) const PLUGINS: &[(&str, ShapePlugin)] = &[
    ("obj", |reader, params, to_world| mesh(reader, params, to_world, MeshFormat::Obj)),
    ("ply", |reader, params, to_world| mesh(reader, params, to_world, MeshFormat::Ply)),
    ("serialized", |reader, params, to_world| mesh(reader, params, to_world, MeshFormat::Serialized)),
    ("rectangle", |_, params, _| faceted(params, ShapeKind::Rectangle)),
    ("cube", |_, params, _| faceted(params, ShapeKind::Cube)),
    ("sphere", sphere),
    ("cylinder", cylinder),
    ("disk", |_, _, _| Ok(ShapeKind::Disk)),
    ("linearcurve", |reader, params, _| curves(reader, params, CurveBasis::Linear)),
    ("bsplinecurve", |reader, params, _| curves(reader, params, CurveBasis::BSpline)),
];

/// The format of the mesh files that a plugin reads.
pub(crate) fn mesh_format(plugin: &str) -> Option<MeshFormat> {
    match plugin {
        "obj" => Some(MeshFormat::Obj),
        "ply" => Some(MeshFormat::Ply),
        "serialized" => Some(MeshFormat::Serialized),
        _ => None,
    }
}

/// The plugin of a group.
pub(super) const GROUP: &str = "shapegroup";

/// The plugin that joins shapes: a way to write them that changes nothing that is seen.
pub(super) const MERGE: &str = "merge";

/// The plugin of an instance.
pub(super) const INSTANCE: &str = "instance";

/// Reads a shape of the scene itself: a group, an instance of one, or a shape with its material and emission.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<(), SceneError> {
    let shape = match reader.document.element(id).value("type") {
        Some(GROUP) => return group(reader, id).map(|_| ()),
        Some(MERGE) => {
            let mut parts = Vec::new();
            merged(reader, id, reader.document.element(id).span, &mut parts)?;
            return parts.into_iter().try_for_each(|(id, _)| read(reader, id));
        }
        Some(INSTANCE) => instance(reader, id)?,
        _ => single(reader, id)?,
    };
    reader.lists.shapes.push(shape);
    Ok(())
}

/// The shapes that the element `id` stands for, named at `span`: those of a `merge`, however deep, or itself.
fn merged(
    reader: &mut Reader<'_>,
    id: ElementId,
    span: Span,
    parts: &mut Vec<(ElementId, Span)>,
) -> Result<(), SceneError> {
    if reader.document.element(id).value("type") != Some(MERGE) {
        parts.push((id, span));
        return Ok(());
    }
    let depth = reader.known.open_merges.len();
    reader.known.merges += 1;
    let problem = if reader.known.open_merges.contains(&id) {
        Some((FindingKind::Reference, "a merged shape that contains itself"))
    } else if depth >= limits::REFERENCE_DEPTH || reader.known.merges > limits::ELEMENTS {
        Some((FindingKind::Limit, "too many merged shapes in each other"))
    } else {
        None
    };
    if let Some((kind, message)) = problem {
        return Err(reader.document.finding(kind, span, message).error());
    }
    let params = Params::new(reader.document, id)?;
    reader.known.open_merges.push(id);
    for (part, span) in params.objects("shape") {
        merged(reader, part, span, parts)?;
    }
    reader.known.open_merges.pop();
    reader.finish(params);
    Ok(())
}

/// A shape with geometry of its own, with its material and emission.
fn single(reader: &mut Reader<'_>, id: ElementId) -> Result<ShapeDesc, SceneError> {
    let params = Params::new(reader.document, id)?;
    let plugin = reader.plugin(&params, PLUGINS, &[GROUP, INSTANCE, MERGE])?;
    let to_world = params.to_world()?;
    let flip_normals = params.boolean("flip_normals", false)?;
    let kind = plugin(reader, &params, &to_world)?;
    let emission = match params.object("emitter")? {
        Some(id) => {
            let read = emitter::area(reader, id).map(Some);
            reader.or_instead(read, "it is left out", |_| None)?
        }
        None => None,
    };
    let (emission, emission_profile) = emission
        .map_or_else(Default::default, |AreaEmission { radiance, profile }| (Some(radiance), profile));
    let bsdf = match params.object("bsdf")? {
        Some(id) => reader.bsdf(id)?,
        None => reader.default_bsdf(emission.is_some()),
    };
    if let Some(sensor) = params.object("sensor")? {
        reader.known.meter = Some(MeteredShape { sensor, kind: kind.clone(), to_world, flip_normals });
    }
    let interface = media(reader, &params, &kind)?;
    let (bsdf, medium_interface) = subsurface::applied(reader, &params, &kind, (bsdf, interface))?;
    attribute::lay_out(reader, &params, &kind, bsdf)?;
    attribute::count_unmapped(reader, &params, &kind, bsdf, &emission_profile);
    let shape = ShapeDesc {
        id: params.element().value("id").map(str::to_owned),
        place: reader.place(params.span()),
        kind,
        to_world,
        flip_normals,
        bsdf,
        emission,
        emission_profile,
        medium_interface,
    };
    reader.finish(params);
    Ok(shape)
}

/// The media on both sides of a shape.
fn media(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    kind: &ShapeKind,
) -> Result<MediumInterface, SceneError> {
    if matches!(kind, ShapeKind::Curves(_)) {
        let Some((_, span)) = params.objects("medium").first().copied() else {
            return Ok(MediumInterface::default());
        };
        let message = "curves bound no medium: rays meet them from outside only";
        let found = reader.document.finding(FindingKind::Plugin, span, message);
        return Err(found.help("give the medium to a mesh or another shape").error());
    }
    let interface = reader.medium_interface(params)?;
    if interface.interior.is_some() && params.objects("bsdf").is_empty() {
        let message = "this shape has no bsdf: it is opaque, as in Mitsuba, and hides the medium in it";
        let found = params.fault(FindingKind::Missing, message);
        params.note(found.help("add <bsdf type=\"null\"/>, or a `dielectric`").advice());
    }
    Ok(interface)
}

/// A shape that Mitsuba takes for a mesh: it has facets anyway.
fn faceted(params: &Params<'_>, kind: ShapeKind) -> Result<ShapeKind, SceneError> {
    params.boolean("face_normals", false).map(|_| kind)
}

fn sphere(_: &mut Reader<'_>, params: &Params<'_>, to_world: &DAffine3) -> Result<ShapeKind, SceneError> {
    let center = params.point_or("center", DVec3::ZERO)?;
    let radius = params.float_or("radius", 1.0)?;
    if radius <= 0.0 {
        return Err(params.error("radius", "a radius is above zero").error());
    }
    if similarity(to_world).is_none() {
        let message = "a sphere cannot be scaled differently along its axes, or sheared";
        let found = params.error("to_world", message);
        return Err(found.help("use one factor for all axes, or a mesh").error());
    }
    Ok(ShapeKind::Sphere { center, radius })
}

/// The factor of a transform that scales all lengths alike, or `None`.
fn similarity(m: &DAffine3) -> Option<f64> {
    let s2 = m.matrix3.x_axis.length_squared();
    let gram = (m.matrix3.transpose() * m.matrix3).to_cols_array();
    let wanted = (DMat3::IDENTITY * s2).to_cols_array();
    gram.iter().zip(wanted).all(|(a, b)| (a - b).abs() <= 1e-5 * s2).then(|| s2.sqrt())
}

fn cylinder(_: &mut Reader<'_>, params: &Params<'_>, _: &DAffine3) -> Result<ShapeKind, SceneError> {
    let p0 = params.point_or("p0", DVec3::ZERO)?;
    let p1 = params.point_or("p1", DVec3::Z)?;
    let radius = params.float_or("radius", 1.0)?;
    if radius <= 0.0 {
        return Err(params.error("radius", "a radius is above zero").error());
    }
    if !(p1 - p0).length_squared().is_normal() {
        return Err(params.error("p1", "a cylinder has a length: `p0` and `p1` differ").error());
    }
    Ok(ShapeKind::Cylinder { p0, p1, radius })
}

/// A file of curves.
fn curves(reader: &mut Reader<'_>, params: &Params<'_>, basis: CurveBasis) -> Result<ShapeKind, SceneError> {
    let name = params.filename(&format!("the shape `{}`", params.plugin()), "txt")?;
    params.without_effect(&["silhouette_sampling_weight"]);
    if let Some((_, span)) = params.objects("emitter").first() {
        let found = reader.document.finding(FindingKind::Plugin, *span, "curves cannot emit light");
        return Err(found.help("give the light to a mesh or another shape").error());
    }
    let path = reader.document.resolve(&name, params.span());
    let bytes = reader.document.files.read(&path, limits::MESH_BYTES).map_err(|e| {
        let span = params.get("filename").map_or(params.span(), |e| e.span_of("value"));
        reader.document.error(e.kind(), span, e.to_string())
    })?;
    let known = &mut reader.known;
    known.mesh_bytes += bytes.len() as u64;
    if known.mesh_bytes > limits::TOTAL_MESH_BYTES {
        let message = format!("the meshes of this scene have more than {} bytes", limits::TOTAL_MESH_BYTES);
        return Err(params.fault(FindingKind::Limit, message).error());
    }
    let read = curves::parse(&path, &bytes, basis)?;
    read.warnings.into_iter().for_each(|warning| reader.warn(warning));
    Ok(ShapeKind::Curves(Arc::new(read.curves)))
}

/// A mesh file and how it is read, by the parameters that Mitsuba has for its format.
pub(crate) fn mesh_file(
    document: &Document,
    params: &Params<'_>,
    to_world: &DAffine3,
    format: MeshFormat,
) -> Result<(PathBuf, MeshOptions), SceneError> {
    let name = params.filename(&format!("the shape `{}`", params.plugin()), params.plugin())?;
    // Normals made from faces depend on the shape the faces have in the world.
    let plain = similarity(to_world).is_some() && to_world.matrix3.determinant() > 0.0;
    let world = (!plain).then(|| to_world.matrix3.to_cols_array().map(f64::to_bits));
    let shape_index = match format {
        MeshFormat::Serialized => params.integer_or("shape_index", 0)?,
        _ => 0,
    };
    let options = MeshOptions {
        format,
        shape_index: u32::try_from(shape_index)
            .map_err(|_| params.error("shape_index", "an index counts from zero").error())?,
        face_normals: params.boolean("face_normals", false)?,
        flip_tex_coords: match format {
            MeshFormat::Serialized => false,
            _ => params.boolean("flip_tex_coords", format == MeshFormat::Obj)?,
        },
        attributes: Vec::new(),
        world,
    };
    Ok((document.resolve(&name, params.span()), options))
}

/// A mesh file.
fn mesh(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    to_world: &DAffine3,
    format: MeshFormat,
) -> Result<ShapeKind, SceneError> {
    let mut key = mesh_file(reader.document, params, to_world, format)?;
    key.1.attributes = attribute::asked_by(reader, params)?;
    if let Some(&known) = reader.known.meshes.get(&key) {
        return Ok(ShapeKind::Mesh(known));
    }
    let prefetched = reader.known.prefetched.meshes.remove(&key);
    let read = prefetched.unwrap_or_else(|| mesh::load(&reader.document.files, &key.0, &key.1)).map_err(
        |e| match e {
            mesh::MeshError::At(e) => e,
            mesh::MeshError::Unreadable(e) => {
                let span = params.get("filename").map_or(params.span(), |e| e.span_of("value"));
                reader.document.error(e.kind(), span, e.to_string())
            }
        },
    )?;
    for warning in read.warnings {
        reader.warn(warning);
    }
    if let Some(nothing) = read.nothing {
        reader.warn(nothing.clone().tolerated("nothing of it is seen"));
        reader.known.nothing.get_or_insert(nothing);
    }
    let known = &mut reader.known;
    known.mesh_triangles += read.mesh.triangles.len();
    known.mesh_bytes += read.bytes as u64;
    let (triangles, bytes) = (limits::SCENE_TRIANGLES, limits::TOTAL_MESH_BYTES);
    if known.mesh_triangles > triangles || known.mesh_bytes > bytes {
        let message =
            format!("the meshes of this scene have more than {triangles} triangles or {bytes} bytes");
        return Err(params.fault(FindingKind::Limit, message).error());
    }
    reader.lists.meshes.push(read.mesh);
    let new = MeshId(reader.lists.meshes.len() as u32 - 1);
    reader.known.meshes.insert(key, new);
    Ok(ShapeKind::Mesh(new))
}

/// Reads a group; once, wherever it stands and however often it is shown.
fn group(reader: &mut Reader<'_>, id: ElementId) -> Result<GroupId, SceneError> {
    if let Some(&known) = reader.known.groups.get(&id) {
        return Ok(known);
    }
    let params = Params::new(reader.document, id)?;
    let help = "put it into the shapes of the group";
    refuse(reader, &params, "a group has no material or light of its own, and no medium", help)?;
    let mut parts = Vec::new();
    for (part, span) in params.objects("shape") {
        merged(reader, part, span, &mut parts)?;
    }
    if parts.is_empty() {
        let found = params.fault(FindingKind::Missing, "a group without shapes");
        return Err(found.help("put a <shape> into it").error());
    }
    let mut shapes = Vec::with_capacity(parts.len());
    for (id, span) in parts {
        let read = member(reader, id, span).map(Some);
        shapes.extend(reader.or_instead(read, "it is left out", |_| None)?);
    }
    if shapes.is_empty() {
        return Err(params.fault(FindingKind::Plugin, "no shape of this group is supported").error());
    }
    let Name { id: name, place } = reader.name(id);
    reader.lists.groups.push(GroupDesc { id: name, place, shapes });
    let new = GroupId(reader.lists.groups.len() as u32 - 1);
    reader.known.groups.insert(id, new);
    reader.finish(params);
    Ok(new)
}

/// One shape of a group; `span` is where the group names it.
fn member(reader: &mut Reader<'_>, id: ElementId, span: Span) -> Result<ShapeDesc, SceneError> {
    let document = reader.document;
    let wrong = |span, message: &str, help: &str| {
        Err(document.finding(FindingKind::Plugin, span, message).help(help).error())
    };
    let element = document.element(id);
    match element.value("type") {
        Some(GROUP) => return wrong(span, "a group in a group", "put its shapes into this one"),
        Some(INSTANCE) => {
            return wrong(span, "an instance in a group", "put the shapes that it shows into the group");
        }
        _ => {}
    }
    let shape = single(reader, id)?;
    if shape.emission.is_some() {
        let mut children = element.children.iter().map(|c| document.element(*c));
        let emitter = children.find(|c| c.tag.name == "emitter").map_or(span, |e| e.span);
        let help = "what shines is a shape of the scene itself: move it out of the group";
        return wrong(emitter, "a light in a group", help);
    }
    Ok(shape)
}

/// Reads an instance.
fn instance(reader: &mut Reader<'_>, id: ElementId) -> Result<ShapeDesc, SceneError> {
    let params = Params::new(reader.document, id)?;
    let help = "give it to the shapes of the group";
    refuse(reader, &params, "an instance has no material or light of its own, and no medium", help)?;
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
        let plugin = shorten(target.value("type").unwrap_or_default());
        let message = format!("an instance shows a `{GROUP}`, and this is the shape `{plugin}`");
        let help = "put the shape into a <shape type=\"shapegroup\"> and refer to that";
        return wrong(FindingKind::Reference, span, message, help);
    }
    let group = self::group(reader, group)?;
    let shape = ShapeDesc {
        id: params.element().value("id").map(str::to_owned),
        place: reader.place(params.span()),
        kind: ShapeKind::Instance(group),
        to_world: params.to_world()?,
        flip_normals: false,
        bsdf: BsdfId::NONE,
        emission: None,
        emission_profile: EmissionProfile::default(),
        medium_interface: MediumInterface::default(),
    };
    reader.finish(params);
    Ok(shape)
}

/// Refuses materials, media and lights among the children of a group or an instance.
fn refuse(reader: &Reader<'_>, params: &Params<'_>, message: &str, help: &str) -> Result<(), SceneError> {
    let found =
        ["bsdf", "medium", "emitter"].into_iter().find_map(|tag| params.objects(tag).first().copied());
    let at = |span| reader.document.finding(FindingKind::Parameter, span, message).help(help).error();
    found.map_or(Ok(()), |(_, span)| Err(at(span)))
}

/// Remarks on groups that no instance shows.
pub(crate) fn unseen(reader: &mut Reader<'_>) {
    let group_of = |shape: &ShapeDesc| match shape.kind {
        ShapeKind::Instance(group) => Some(group.0),
        _ => None,
    };
    let shown: BTreeSet<u32> = reader.lists.shapes.iter().filter_map(group_of).collect();
    for (id, group) in std::mem::take(&mut reader.known.groups) {
        if !shown.contains(&group.0) {
            let span = reader.document.element(id).span;
            let found = reader.document.finding(FindingKind::Parameter, span, "no instance shows this group");
            reader.warn(found.help("it is not seen: add a <shape type=\"instance\"> for it").advice());
        }
    }
}
