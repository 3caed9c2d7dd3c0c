//! Shapes.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};

use super::document::ElementId;
use super::params::Params;
use super::reader::Reader;
use super::{emitter, group};
use crate::scene::bsdf;
use crate::scene::desc::{MeshId, ShapeDesc, ShapeKind};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::limits;
use crate::scene::mesh::{self, MeshOptions};

/// Reader of one shape's geometry, given its `to_world`.
type ShapePlugin = fn(&mut Reader<'_>, &Params<'_>, &DAffine3) -> Result<ShapeKind, SceneError>;

/// Every shape with geometry of its own; groups and instances are read in `group.rs`.
const PLUGINS: &[(&str, ShapePlugin)] = &[
    ("obj", obj),
    ("rectangle", |_, _, _| Ok(ShapeKind::Rectangle)),
    ("cube", |_, _, _| Ok(ShapeKind::Cube)),
    ("sphere", sphere),
    ("disk", |_, _, _| Ok(ShapeKind::Disk)),
];

/// What makes two meshes the same: the file, and how it is read.
pub(crate) type MeshKey = (PathBuf, MeshOptions);

/// Reads a shape of the scene itself: a group, an instance of one, or a shape with its material and emission.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<(), SceneError> {
    let shape = match reader.document.element(id).value("type") {
        Some(group::GROUP) => return group::read(reader, id).map(|_| ()),
        Some(group::INSTANCE) => group::instance(reader, id)?,
        _ => single(reader, id)?,
    };
    reader.shapes.push(shape);
    Ok(())
}

/// A shape with geometry of its own, with its material and emission.
pub(crate) fn single(reader: &mut Reader<'_>, id: ElementId) -> Result<ShapeDesc, SceneError> {
    let params = Params::new(reader.document, id)?;
    let plugin = reader.plugin(&params, PLUGINS, &[group::GROUP, group::INSTANCE])?;
    let to_world = params.to_world()?;
    let flip_normals = params.boolean("flip_normals", false)?;
    let kind = plugin(reader, &params, &to_world)?;
    let emission = match params.object("emitter")? {
        Some(id) => Some(emitter::area(reader, id)?),
        None => None,
    };
    let bsdf = match params.object("bsdf")? {
        Some(id) => bsdf::read(reader, id)?,
        None => bsdf::default(reader, emission.is_some()),
    };
    let shape = ShapeDesc {
        id: params.element().value("id").map(str::to_owned),
        place: reader.place(params.span()),
        kind,
        to_world,
        flip_normals,
        bsdf,
        emission,
    };
    reader.finish(params);
    Ok(shape)
}

fn sphere(_: &mut Reader<'_>, params: &Params<'_>, to_world: &DAffine3) -> Result<ShapeKind, SceneError> {
    let center = params.point("center")?.unwrap_or(DVec3::ZERO);
    let radius = params.float("radius")?.unwrap_or(1.0);
    if radius <= 0.0 {
        return Err(params.error("radius", "a radius is above zero").error());
    }
    if similarity(to_world).is_none() {
        let found =
            params.error("to_world", "a sphere cannot be scaled differently along its axes, or sheared");
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

fn obj(reader: &mut Reader<'_>, params: &Params<'_>, to_world: &DAffine3) -> Result<ShapeKind, SceneError> {
    let Some(name) = params.string("filename")? else {
        let found =
            reader.document.finding(FindingKind::Missing, params.span(), "an obj shape needs `filename`");
        return Err(found.help("add <string name=\"filename\" value=\"….obj\"/>").error());
    };
    // Normals made from faces depend on the shape the faces have in the world.
    let plain = similarity(to_world).is_some() && to_world.matrix3.determinant() > 0.0;
    let world = (!plain).then(|| to_world.matrix3.to_cols_array().map(f64::to_bits));
    let options = MeshOptions {
        face_normals: params.boolean("face_normals", false)?,
        flip_tex_coords: params.boolean("flip_tex_coords", true)?,
        world,
    };
    let path = reader.document.resolve(&name, params.span());
    let key = (path, options);
    if let Some(&known) = reader.known_meshes.get(&key) {
        return Ok(ShapeKind::Mesh(known));
    }
    let read = mesh::obj::load(&key.0, &key.1).map_err(|e| match e {
        mesh::MeshError::At(e) => e,
        mesh::MeshError::Unreadable(kind, message) => {
            let span = params.get("filename").map_or(params.span(), |e| e.span_of("value"));
            reader.document.finding(kind, span, message).error()
        }
    })?;
    for warning in read.warnings {
        reader.warn(warning);
    }
    reader.mesh_triangles += read.mesh.triangles.len();
    reader.mesh_bytes += read.bytes as u64;
    if reader.mesh_triangles > limits::SCENE_TRIANGLES || reader.mesh_bytes > limits::TOTAL_MESH_BYTES {
        let (triangles, bytes) = (limits::SCENE_TRIANGLES, limits::TOTAL_MESH_BYTES);
        let message =
            format!("the meshes of this scene have more than {triangles} triangles or {bytes} bytes");
        return Err(reader.document.finding(FindingKind::Limit, params.span(), message).error());
    }
    reader.meshes.push(Arc::new(read.mesh));
    let new = MeshId(reader.meshes.len() as u32 - 1);
    reader.known_meshes.insert(key, new);
    Ok(ShapeKind::Mesh(new))
}
