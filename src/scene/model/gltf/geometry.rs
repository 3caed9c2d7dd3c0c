//! ModelPrimitives of glTF meshes as PLY files.

use std::collections::BTreeMap;

use glam::DAffine3;
use gltf::Semantic;
use gltf::mesh::Mode;

use super::buffers::Buffers;
use super::materials::{EmittedRadiance, Materials};
use crate::scene::model::text::{PlyVertices, SceneText, ply};

/// A primitive: a mesh file with its material.
#[derive(Clone)]
pub(super) struct PrimitiveShape {
    file: String,
    bsdf: String,
    /// Facets: the primitive has no normals.
    flat: bool,
    pub(super) emission: Option<EmittedRadiance>,
}

/// The primitives of each mesh that was asked for.
#[derive(Default)]
pub(super) struct ModelPrimitives(BTreeMap<usize, Vec<PrimitiveShape>>);

impl ModelPrimitives {
    /// The primitives of a mesh that are surfaces, with their materials written.
    pub(super) fn of<'a>(
        &mut self,
        mesh: &gltf::Mesh<'a>,
        text: &mut SceneText<'_>,
        buffers: &mut Buffers<'a>,
        materials: &mut Materials,
    ) -> Result<Vec<PrimitiveShape>, String> {
        if let Some(known) = self.0.get(&mesh.index()) {
            return Ok(known.clone());
        }
        let mut shapes = Vec::new();
        for primitive in mesh.primitives() {
            let name = format!("mesh-{}-{}.ply", mesh.index(), primitive.index());
            shapes.extend(shape(&name, &primitive, text, buffers, materials)?);
        }
        self.0.insert(mesh.index(), shapes.clone());
        Ok(shapes)
    }
}

/// A primitive; nothing for one without triangles.
fn shape<'a>(
    name: &str,
    primitive: &gltf::Primitive<'a>,
    text: &mut SceneText<'_>,
    buffers: &mut Buffers<'a>,
    materials: &mut Materials,
) -> Result<Option<PrimitiveShape>, String> {
    let cut = match primitive.mode() {
        Mode::Triangles => triangles as fn(&[u32]) -> Vec<[u32; 3]>,
        Mode::TriangleStrip => strip,
        Mode::TriangleFan => fan,
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
            text.note(format!("{name} is made of points or lines, which have no surface: left out"));
            return Ok(None);
        }
    };
    let Some(positions) = primitive.get(&Semantic::Positions) else { return Ok(None) };
    let positions = buffers.floats::<3>(&positions)?;
    let count = positions.len();
    let mut vectors = |semantic| -> Result<Vec<[f32; 3]>, String> {
        let read = primitive.get(&semantic).map(|accessor| buffers.floats::<3>(&accessor)).transpose()?;
        // What belongs to other vertices belongs to none.
        Ok(read.filter(|all| all.len() == count).unwrap_or_default())
    };
    let (normals, colors) = (vectors(Semantic::Normals)?, vectors(Semantic::Colors(0))?);
    let material = primitive.material();
    let set = materials.set_of(&material);
    let uvs = primitive.get(&Semantic::TexCoords(set)).map(|accessor| buffers.floats::<2>(&accessor));
    let uvs = uvs.transpose()?.filter(|all| all.len() == count).unwrap_or_default();
    let corners = match primitive.indices() {
        Some(accessor) => buffers.indices(&accessor)?,
        None => (0..count as u32).collect(),
    };
    let triangles = cut(&corners);
    if triangles.is_empty() {
        text.note(format!("{name} has no triangle: left out"));
        return Ok(None);
    }
    let colored = !colors.is_empty();
    let (bsdf, emission) = materials.of(&material, colored, text, buffers)?;
    let vertices = PlyVertices { positions: &positions, normals: &normals, uvs: &uvs, colors: &colors };
    buffers.spend(44 * count + 13 * triangles.len())?;
    let file = text.file(name, ply(&vertices, &triangles));
    Ok(Some(PrimitiveShape { file, bsdf, flat: normals.is_empty(), emission }))
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

impl PrimitiveShape {
    /// Writes it at this place.
    pub(super) fn write(&self, text: &mut SceneText<'_>, to_world: &DAffine3) {
        text.shape("ply", &self.file, &self.bsdf, |text| {
            if *to_world != DAffine3::IDENTITY {
                text.transform("to_world", to_world);
            }
            if self.flat {
                text.value("boolean", "face_normals", true);
            }
            if let Some(emission) = &self.emission {
                text.object("emitter", "area", &[], |text| emission.write(text));
            }
        });
    }
}
