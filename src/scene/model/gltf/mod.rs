//! glTF 2.0 (Khronos): nodes with their meshes, lights and cameras.
//!
//! ```text
//! buffers     bytes of buffers, accessors and images: beside the file, in it, or in data URIs
//! geometry    primitives as PLY
//! materials   metallic-roughness and its extensions as `principled`
//! pictures    channels and multiples of pictures
//! ```
//!
//! A mesh that several nodes show is a shape group with instances; one that shines is as many shapes, since groups hold no lights.
//! `KHR_lights_punctual` has point and spot lights in candela and directional ones in lux; like an emission of 1 cd/m² they are
//! taken by number. Animations, skins and morph targets are shown at rest. Nodes form a tree, so that each is visited once.

mod buffers;
mod geometry;
mod materials;
mod pictures;

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DMat3, DMat4, DVec3};
use gltf::camera::Projection;
use gltf::khr_lights_punctual::{Kind, Light};

use super::text::SceneText;
use super::{finding, unreadable};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::files::SceneFiles;
use crate::scene::limits;
use buffers::Buffers;
use geometry::ModelPrimitives;
use materials::Materials;

/// The far end of a camera that has none.
const FAR: f64 = 1e9;

/// Reads a glTF file.
pub(super) fn read(text: &mut SceneText<'_>, files: &SceneFiles) -> Result<(), SceneError> {
    let path = text.path;
    let wrong = |message: String| finding(path, FindingKind::Mesh, [1, 1], message).error();
    let bytes = files.read(path, limits::MESH_BYTES).map_err(|e| unreadable(path, &e))?;
    let gltf::Gltf { document, blob } = parse(&bytes).map_err(|e| match &e {
        gltf::Error::Deserialize(json) => {
            let place = [json.line().max(1), json.column().max(1)];
            finding(path, FindingKind::Syntax, place, json.to_string()).error()
        }
        e => wrong(describe(e)),
    })?;
    let mut buffers = Buffers::new(path, &document, blob.as_deref(), bytes.len(), files);
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let roots = scene.iter().flat_map(gltf::Scene::nodes).collect();
    let nodes = visit(roots).map_err(wrong)?;
    let mut materials = Materials::default();
    let mut primitives = ModelPrimitives::default();
    let mut uses = BTreeMap::new();
    nodes.iter().filter_map(|(node, _)| node.mesh()).for_each(|m| *uses.entry(m.index()).or_insert(0) += 1);
    let mut groups = BTreeSet::new();
    let mut flat = 0;
    for (node, to_world) in &nodes {
        let turned = to_world.matrix3.determinant();
        if !(to_world.is_finite() && turned.is_normal()) {
            flat += usize::from(node.mesh().is_some());
            continue;
        }
        if let Some(mesh) = node.mesh() {
            let all = primitives.of(&mesh, text, &mut buffers, &mut materials).map_err(wrong)?;
            let (shining, still): (Vec<_>, Vec<_>) =
                all.iter().partition(|primitive| primitive.emission.is_some() || uses[&mesh.index()] == 1);
            for primitive in shining {
                primitive.write(text, to_world);
            }
            if !still.is_empty() {
                let id = format!("mesh {}", mesh.index());
                if groups.insert(mesh.index()) {
                    text.object("shape", "shapegroup", &[("id", &id)], |text| {
                        still.iter().for_each(|primitive| primitive.write(text, &DAffine3::IDENTITY));
                    });
                }
                text.object("shape", "instance", &[], |text| {
                    text.transform("to_world", to_world);
                    text.reference(&id);
                });
            }
        }
        if let Some(light) = node.light() {
            self::light(text, &light, to_world);
        }
        if let Some(camera) = node.camera()
            && let Projection::Perspective(lens) = camera.projection()
        {
            self::camera(text, &lens, to_world);
        }
    }
    if flat > 0 {
        text.note(format!("{flat} nodes are scaled to nothing, or by no number: they are left out"));
    }
    if uses.is_empty() {
        return Err(wrong("this model shows no mesh".to_owned()));
    }
    if document.skins().next().is_some() || document.animations().next().is_some() {
        text.note("skins and animations are shown at rest");
    }
    Ok(())
}

/// Parses the text and takes the binary part. The header is checked first: the crate subtracts its size from what it says.
fn parse(bytes: &[u8]) -> Result<gltf::Gltf, gltf::Error> {
    let said = bytes.get(8..12).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    if bytes.starts_with(b"glTF") && said.is_none_or(|length| length < 20 || length as usize > bytes.len()) {
        let length = said.unwrap_or_default();
        return Err(gltf::Error::Binary(gltf::binary::Error::Length { length, length_read: bytes.len() }));
    }
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice_without_validation(bytes)?;
    let root = document.into_json();
    // The validation of the crate looks at accessors of primitives before it knows that they are there.
    let mut primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    if primitives.any(|p| p.attributes.values().any(|index| index.value() >= root.accessors.len())) {
        let fault =
            (gltf::json::Path::new().field("meshes"), gltf::json::validation::Error::IndexOutOfBounds);
        return Err(gltf::Error::Validation(vec![fault]));
    }
    Ok(gltf::Gltf { document: gltf::Document::from_json(root)?, blob })
}

/// An error of the format in words: the first of many.
fn describe(error: &gltf::Error) -> String {
    match error {
        gltf::Error::Validation(faults) => match faults.as_slice() {
            [(place, fault), rest @ ..] => {
                let more =
                    if rest.is_empty() { String::new() } else { format!(", and {} more faults", rest.len()) };
                format!("this is not valid glTF: {place} is {}{more}", fault.to_string().to_lowercase())
            }
            [] => "this is not valid glTF".to_owned(),
        },
        error => format!("this is not valid glTF: {error}"),
    }
}

type PlacedNode<'a> = (gltf::Node<'a>, DAffine3);

/// All nodes below these with their transforms to the world; an error where one is reached twice.
fn visit(roots: Vec<gltf::Node<'_>>) -> Result<Vec<PlacedNode<'_>>, String> {
    let mut open: Vec<PlacedNode<'_>> =
        roots.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
    let (mut seen, mut nodes) = (BTreeSet::new(), Vec::new());
    while let Some((node, parent)) = open.pop() {
        if !seen.insert(node.index()) {
            let message =
                format!("nodes[{}] is below itself, or below two others: nodes form a tree", node.index());
            return Err(message);
        }
        let matrix = DMat4::from_cols_array_2d(&node.transform().matrix().map(|c| c.map(f64::from)));
        let to_world = parent * DAffine3::from_mat4(matrix);
        let at = open.len();
        open.extend(node.children().map(|child| (child, to_world)));
        open[at..].reverse();
        nodes.push((node, to_world));
    }
    Ok(nodes)
}

/// Writes a light (`KHR_lights_punctual`), which shines along −z of its node.
fn light(text: &mut SceneText<'_>, light: &Light<'_>, to_world: &DAffine3) {
    let rgb = light.color().map(|c| (c * light.intensity()).max(0.0));
    let id = text.id(light.name().unwrap_or("light"));
    if !rgb.iter().all(|v| v.is_finite()) {
        return text.note(format!("the light `{id}` has an intensity that is no number: it is left out"));
    }
    text.lit = true;
    let [position, ahead] = [to_world.translation, to_world.transform_vector3(DVec3::NEG_Z)];
    let words = |v: DVec3| format!("{} {} {}", v.x, v.y, v.z);
    match light.kind() {
        Kind::Directional => text.object("emitter", "directional", &[("id", &id)], |text| {
            text.value("vector", "direction", words(ahead));
            text.rgb("irradiance", rgb);
        }),
        Kind::Point => text.object("emitter", "point", &[("id", &id)], |text| {
            text.value("point", "position", words(position));
            text.rgb("intensity", rgb);
        }),
        Kind::Spot { inner_cone_angle, outer_cone_angle } => {
            let outer = f64::from(outer_cone_angle).to_degrees().clamp(0.1, 90.0);
            let inner = f64::from(inner_cone_angle).to_degrees().clamp(0.0, outer * 0.999);
            text.object("emitter", "spot", &[("id", &id)], |text| {
                text.transform("to_world", &looking(to_world));
                text.rgb("intensity", rgb);
                text.value("float", "cutoff_angle", outer);
                text.value("float", "beam_width", inner);
            });
        }
    }
}

/// The transform of what looks along −z with +x to the right, as one that looks along +z with +x to the left, without scale.
fn looking(to_world: &DAffine3) -> DAffine3 {
    let ahead = to_world.transform_vector3(DVec3::NEG_Z).normalize();
    let up = to_world.transform_vector3(DVec3::Y);
    let left = up.cross(ahead).normalize_or(ahead.any_orthonormal_vector());
    DAffine3::from_mat3_translation(DMat3::from_cols(left, ahead.cross(left), ahead), to_world.translation)
}

/// Writes a camera; the first of the file counts.
fn camera(text: &mut SceneText<'_>, lens: &gltf::camera::Perspective<'_>, to_world: &DAffine3) {
    let (fov, near) = (f64::from(lens.yfov()).to_degrees(), f64::from(lens.znear()));
    let far = lens.zfar().map_or(FAR, f64::from);
    if text.framed || !(0.1..179.0).contains(&fov) || !(near > 0.0 && near < far && far.is_finite()) {
        return;
    }
    text.framed = true;
    let aspect = lens.aspect_ratio().map(f64::from).filter(|a| (0.05..20.0).contains(a));
    text.camera(fov, "y", aspect, |text| {
        text.transform("to_world", &looking(to_world));
        text.value("float", "near_clip", near);
        text.value("float", "far_clip", far);
    });
}
