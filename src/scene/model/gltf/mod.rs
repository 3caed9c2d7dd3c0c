//! glTF 2.0 (Khronos): nodes with their meshes, lights and cameras.
//!
//! ```text
//! parse       the container and the JSON; extensions that are required
//! grammar     each property of each object (grammar_tables) and what becomes of it; json reads them
//! buffers     bytes of buffers, accessors and images: beside the file, in it, or in data URIs
//! meshopt     views that are compressed; draco: primitives that are
//! nodes       the tree and its transforms; instances: EXT_mesh_gpu_instancing
//! geometry    primitives as PLY; pose: morph targets and skins; cutout: opacity of vertices
//! materials   metallic-roughness as `principled`; extensions, glass and specular_glossiness: what else materials have; volume: media
//!             within meshes; material_reader: what these read a material by
//! textures    pictures with samplers and transforms; pictures: their channels and multiples
//! placed      lights and cameras
//! ```
//!
//! A mesh that several nodes show is a shape group with instances; one that shines is as many shapes, since groups hold no lights.
//! `KHR_lights_punctual` has point and spot lights in candela and directional ones in lux; like an emission of 1 cd/m² they are
//! taken by number. Animations are not played. Nodes form a tree, so that each is visited once.

mod buffers;
mod cutout;
mod draco;
mod extensions;
mod geometry;
mod glass;
mod grammar;
mod grammar_tables;
mod instances;
mod json;
mod material_reader;
mod materials;
mod meshopt;
mod nodes;
mod parse;
mod pictures;
mod placed;
mod pose;
mod specular_glossiness;
mod textures;
mod volume;

use std::collections::BTreeMap;

use glam::DAffine3;

use super::mesh_shape::MeshShape;
use super::text::{SceneText, finding, unreadable};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::files::SceneFiles;
use crate::scene::limits;
use buffers::Buffers;
use geometry::ModelPrimitives;
use nodes::PlacedNode;
use parse::ModelDocument;
use pose::{MeshPose, PoseKey, Skins};

/// Reads a glTF file.
pub(super) fn read(text: &mut SceneText<'_>, files: &SceneFiles) -> Result<(), SceneError> {
    let path = text.path;
    let bytes = files.read(path, limits::MESH_BYTES).map_err(|e| unreadable(path, &e))?;
    let model = parse::parse(&bytes, text)?;
    let mut buffers = Buffers::new(path, &model, bytes.len(), files);
    let shown = show(&model, &mut buffers, text);
    for (message, place) in std::mem::take(&mut buffers.remarks) {
        text.tell(message, &place);
    }
    shown.map_err(|e| finding(path, FindingKind::Mesh, [1, 1], e).error())
}

/// A mesh at its places.
struct ShownMesh<'a> {
    mesh: gltf::Mesh<'a>,
    pose: MeshPose,
    places: Vec<DAffine3>,
}

/// Writes the scene of a model.
fn show<'a>(
    model: &'a ModelDocument,
    buffers: &mut Buffers<'a>,
    text: &mut SceneText<'_>,
) -> Result<(), String> {
    let ModelDocument { root, document, .. } = model;
    let scene = document.default_scene().or_else(|| document.scenes().next());
    if let Some(scene) = &scene
        && document.scenes().len() > 1
    {
        text.tell("one scene is shown: others are left out", &format!("all but scenes[{}]", scene.index()));
    }
    let nodes = nodes::visit(scene.iter().flat_map(gltf::Scene::nodes).collect())?;
    let mut shown = meshes(&nodes, model, buffers, text)?;
    let mut uses: BTreeMap<(usize, PoseKey), usize> = BTreeMap::new();
    for mesh in shown.values() {
        *uses.entry(mesh.key()).or_default() += mesh.places.len();
    }
    let mut primitives = ModelPrimitives::new(root);
    let mut groups = BTreeMap::new();
    let mut flat = 0;
    for (node, to_world) in &nodes {
        let mesh = shown.remove(&node.index());
        if let Some(mut mesh) = mesh {
            let all = mesh.places.len();
            mesh.places.retain(is_usable);
            flat += all - mesh.places.len();
            if !mesh.places.is_empty() {
                let parts = primitives.of(&mesh.mesh, &mesh.pose, text, buffers)?;
                mesh.write(&parts, uses[&mesh.key()] == 1, &mut groups, text);
            }
        }
        if !is_usable(to_world) {
            flat += usize::from(node.light().is_some() || node.camera().is_some());
            continue;
        }
        if let Some(light) = node.light() {
            placed::light(text, &light, to_world);
        }
        if let Some(camera) = node.camera() {
            placed::camera(text, &camera, to_world);
        }
    }
    if flat > 0 {
        text.note(format!("{flat} nodes are scaled to nothing, or by no number: they are left out"));
    }
    if uses.is_empty() {
        return Err("this model shows no mesh".to_owned());
    }
    Ok(())
}

/// Whether a transform shows anything.
fn is_usable(to_world: &DAffine3) -> bool {
    to_world.is_finite() && to_world.matrix3.determinant().is_normal()
}

/// The meshes by the indices of their nodes.
fn meshes<'a>(
    nodes: &[PlacedNode<'a>],
    ModelDocument { root, document, .. }: &'a ModelDocument,
    buffers: &mut Buffers<'a>,
    text: &mut SceneText<'_>,
) -> Result<BTreeMap<usize, ShownMesh<'a>>, String> {
    let mut worlds: BTreeMap<usize, DAffine3> =
        nodes.iter().map(|(node, to_world)| (node.index(), *to_world)).collect();
    let mut joints = nodes.iter().filter_map(|(node, _)| node.skin()).flat_map(|skin| skin.joints());
    if joints.any(|joint| !worlds.contains_key(&joint.index())) {
        nodes::add_unshown(document, &mut worlds);
    }
    let mut skins = Skins::default();
    let mut shown = BTreeMap::new();
    for (node, to_world) in nodes {
        let Some(mesh) = node.mesh() else { continue };
        let place = format!("nodes[{}]", node.index());
        let mut pose = skins.pose(node, &mesh, &worlds, buffers, text);
        if pose.is_skinned() && !pose::has_joints(&mesh) {
            text.tell("a mesh whose vertices name no joints is not bent by its skin", &place);
            pose = pose.without_skin();
        }
        let instances = instances::read(&root["nodes"][node.index()], buffers)?;
        let places = match instances {
            Some(_) if pose.is_skinned() => {
                text.tell("`EXT_mesh_gpu_instancing` is not used for a mesh with a skin", &place);
                vec![DAffine3::IDENTITY]
            }
            Some(instances) => instances.iter().map(|instance| *to_world * *instance).collect(),
            // Joints place the vertices in the world.
            None if pose.is_skinned() => vec![DAffine3::IDENTITY],
            None => vec![*to_world],
        };
        shown.insert(node.index(), ShownMesh { mesh, pose, places });
    }
    Ok(shown)
}

impl ShownMesh<'_> {
    fn key(&self) -> (usize, PoseKey) {
        (self.mesh.index(), self.pose.key())
    }

    /// Writes its parts at its places. `once`: there is no other place. `groups` has the ids of what is written as a shape group.
    fn write(
        &self,
        parts: &[MeshShape],
        once: bool,
        groups: &mut BTreeMap<usize, BTreeMap<PoseKey, String>>,
        text: &mut SceneText<'_>,
    ) {
        let (alone, grouped): (Vec<_>, Vec<_>) =
            parts.iter().partition(|primitive| primitive.emission.is_some() || once);
        for (to_world, primitive) in
            self.places.iter().flat_map(|to_world| alone.iter().map(move |p| (to_world, p)))
        {
            primitive.write(text, to_world);
        }
        if grouped.is_empty() {
            return;
        }
        let poses = groups.entry(self.mesh.index()).or_default();
        let posed = poses.len();
        let id = poses.entry(self.pose.key()).or_insert_with(|| {
            let suffix = if posed == 0 { String::new() } else { format!(" pose {posed}") };
            let id = text.id(&format!("mesh {}{suffix}", self.mesh.index()));
            text.object("shape", "shapegroup", &[("id", &id)], |text| {
                grouped.iter().for_each(|primitive| primitive.write(text, &DAffine3::IDENTITY));
            });
            id
        });
        for to_world in &self.places {
            text.object("shape", "instance", &[], |text| {
                text.transform("to_world", to_world);
                text.reference(id);
            });
        }
    }
}
