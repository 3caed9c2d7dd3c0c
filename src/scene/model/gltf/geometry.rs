//! Primitives of glTF meshes as PLY files.

use std::collections::BTreeMap;

use gltf::Semantic;
use gltf::mesh::Mode;
use serde_json::Value;

use super::buffers::Buffers;
use super::cutout::CutVertices;
use super::json;
use super::material_reader::VertexColors;
use super::materials::{GltfMaterial, Materials};
use super::pose::{MeshPose, PoseKey};
use crate::scene::model::mesh_shape::MeshShape;
use crate::scene::model::text::{PlyVertices, SceneText, ply_with_opacities};

/// The primitives of each mesh that was asked for, in each of its poses.
pub(super) struct ModelPrimitives<'r> {
    root: &'r Value,
    known: BTreeMap<usize, BTreeMap<PoseKey, Vec<MeshShape>>>,
    materials: Materials<'r>,
}

impl<'r> ModelPrimitives<'r> {
    /// Those of a file.
    pub(super) fn new(root: &'r Value) -> Self {
        Self { root, known: BTreeMap::new(), materials: Materials::new(root) }
    }

    /// The primitives of a mesh that are surfaces, with their materials written.
    pub(super) fn of(
        &mut self,
        mesh: &gltf::Mesh<'r>,
        pose: &MeshPose,
        text: &mut SceneText<'_>,
        buffers: &mut Buffers<'r>,
    ) -> Result<Vec<MeshShape>, String> {
        let poses = self.known.entry(mesh.index()).or_default();
        if let Some(known) = poses.get(&pose.key()) {
            return Ok(known.clone());
        }
        let poses = poses.len();
        let suffix = if poses == 0 { String::new() } else { format!("-{poses}") };
        let mut shapes = Vec::new();
        for primitive in mesh.primitives() {
            let (mesh, index) = (mesh.index(), primitive.index());
            let name = format!("mesh-{mesh}-{index}{suffix}.ply");
            let object = &self.root["meshes"][mesh]["primitives"][index];
            let place = format!("meshes[{mesh}].primitives[{index}]");
            let mut reader = PrimitiveReader { primitive, object, count: 0, place, text, buffers };
            shapes.extend(reader.shape(&name, pose, &mut self.materials)?);
        }
        self.known.entry(mesh.index()).or_default().insert(pose.key(), shapes.clone());
        Ok(shapes)
    }
}

/// A primitive that is being read.
struct PrimitiveReader<'p, 'r, 't> {
    primitive: gltf::Primitive<'r>,
    object: &'r Value,
    /// The number of vertices.
    count: usize,
    place: String,
    text: &'p mut SceneText<'t>,
    buffers: &'p mut Buffers<'r>,
}

impl<'r> PrimitiveReader<'_, 'r, '_> {
    /// The shape; nothing for a primitive without triangles.
    fn shape(
        &mut self,
        name: &str,
        pose: &MeshPose,
        materials: &mut Materials<'r>,
    ) -> Result<Option<MeshShape>, String> {
        let material = json::index(self.object, "material");
        let cut = match self.primitive.mode() {
            Mode::Triangles => triangles as fn(&[u32]) -> Vec<[u32; 3]>,
            Mode::TriangleStrip => strip,
            Mode::TriangleFan => fan,
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
                self.text.tell("points and lines have no surface: they are left out", &self.place);
                return Ok(None);
            }
        };
        let Some(positions) = self.primitive.get(&Semantic::Positions) else { return Ok(None) };
        let compressed = self.buffers.decompress_primitive(&self.primitive, self.object, &self.place)?;
        let mut positions = self.buffers.floats::<3>(&positions)?;
        self.count = positions.len();
        let mut normals = match self.primitive.get(&Semantic::Normals) {
            Some(accessor) => self.buffers.floats::<3>(&accessor)?,
            None => Vec::new(),
        };
        self.check("NORMAL", &mut normals);
        pose.apply(&self.primitive, &mut positions, &mut normals, self.buffers)?;
        let mut uvs = self.uvs(materials.set_of(material))?;
        let (mut colors, mut opacities) = self.colors(materials, material)?;
        let mut triangles = match (compressed, self.primitive.indices()) {
            // A stream has triangles also where the primitive says that it is a strip.
            (Some(triangles), _) => triangles,
            (None, Some(accessor)) => cut(&self.buffers.indices(&accessor)?),
            (None, None) => cut(&(0..positions.len() as u32).collect::<Vec<_>>()),
        };
        if let Some(cutoff) = materials.cutoff(material).filter(|_| !opacities.is_empty()) {
            let mut vertices = CutVertices {
                positions: &mut positions,
                normals: &mut normals,
                uvs: &mut uvs,
                colors: &mut colors,
            };
            triangles = vertices.cut(&triangles, &opacities, cutoff, self.buffers)?;
            opacities.clear();
            if materials.has_texture(material) {
                let message = "under `alphaMode` `MASK` the opacities of vertices and of the texture are each compared with \
                               the cutoff, not their product";
                self.text.tell(message, &self.place);
            }
        }
        if triangles.is_empty() {
            self.text.tell("a primitive without triangles is left out", &self.place);
            return Ok(None);
        }
        let given = VertexColors { rgb: !colors.is_empty(), opacity: !opacities.is_empty() };
        let GltfMaterial { bsdf, emission, interior } =
            materials.of(material, given, self.text, self.buffers)?;
        let vertices = PlyVertices { positions: &positions, normals: &normals, uvs: &uvs, colors: &colors };
        self.buffers.spend(48 * positions.len() + 13 * triangles.len())?;
        let file = self.text.file(name, ply_with_opacities(&vertices, &opacities, &triangles));
        Ok(Some(MeshShape { file, bsdf, flat: normals.is_empty(), emission, interior }))
    }

    /// Drops an attribute that belongs to more or fewer vertices than there are.
    fn check<T>(&mut self, attribute: &str, read: &mut Vec<T>) {
        if !read.is_empty() && read.len() != self.count {
            let message = format!("`{attribute}` has not an element for each vertex: it is not used");
            self.text.tell(message, &self.place);
            read.clear();
        }
    }

    /// The texture coordinates of this set; those of others are told.
    fn uvs(&mut self, set: Option<usize>) -> Result<Vec<[f32; 2]>, String> {
        let mut uvs = Vec::new();
        let primitive = self.primitive.clone();
        for (semantic, accessor) in primitive.attributes() {
            let Semantic::TexCoords(i) = semantic else { continue };
            let name = format!("TEXCOORD_{i}");
            if i as usize == set.unwrap_or(0) {
                uvs = self.buffers.floats::<2>(&accessor)?;
                self.check(&name, &mut uvs);
            } else {
                let message = format!("`{name}` is not used: a mesh has one set of texture coordinates");
                self.text.tell(message, &self.place);
            }
        }
        if set.is_some() && uvs.is_empty() {
            self.text.tell("a mesh has not the texture coordinates that its material asks for", &self.place);
        }
        Ok(uvs)
    }

    /// Colours and opacities of the vertices, times the factors of the material.
    fn colors(
        &mut self,
        materials: &Materials<'r>,
        material: Option<usize>,
    ) -> Result<(Vec<[f32; 3]>, Vec<f32>), String> {
        let Some(accessor) = self.primitive.get(&Semantic::Colors(0)) else { return Ok(Default::default()) };
        let ([r, g, b, a], mode) = materials.vertex_factor(material);
        let mut colors = self.buffers.shares::<3>(&accessor)?;
        self.check("COLOR_0", &mut colors);
        colors.iter_mut().for_each(|c| *c = [c[0] * r, c[1] * g, c[2] * b]);
        if colors.is_empty() || accessor.dimensions().multiplicity() < 4 || mode == "OPAQUE" {
            return Ok((colors, Vec::new()));
        }
        let opacities = self.buffers.shares::<4>(&accessor)?;
        let mut opacities: Vec<f32> = opacities.iter().map(|c| c[3]).collect();
        if opacities.iter().all(|v| *v == 1.0) {
            opacities.clear();
        }
        opacities.iter_mut().for_each(|v| *v = (*v * a).clamp(0.0, 1.0));
        Ok((colors, opacities))
    }
}

fn triangles(corners: &[u32]) -> Vec<[u32; 3]> {
    corners.as_chunks::<3>().0.to_vec()
}

/// Every second triangle of a strip goes around the other way.
fn strip(corners: &[u32]) -> Vec<[u32; 3]> {
    let turned = |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] };
    corners.windows(3).enumerate().map(turned).collect()
}

fn fan(corners: &[u32]) -> Vec<[u32; 3]> {
    let Some((first, rest)) = corners.split_first() else { return Vec::new() };
    rest.windows(2).map(|pair| [*first, pair[0], pair[1]]).collect()
}
