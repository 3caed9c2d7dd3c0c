//! Vertices as the file poses them: morph targets at their weights, then the skin at its joints (specification 2.0, §3.7.2.2 and §3.7.3).

use std::collections::BTreeMap;
use std::rc::Rc;

use glam::{DAffine3, DMat3, DMat4, DVec3, Vec3};
use gltf::Semantic;

use super::buffers::Buffers;
use crate::scene::model::text::SceneText;

/// How a node poses its mesh.
#[derive(Clone)]
pub(super) struct MeshPose {
    /// Weights of the morph targets.
    weights: Vec<f32>,
    /// The index of the skin and the transforms of its joints.
    skin: Option<(usize, Rc<Vec<DAffine3>>)>,
}

/// Two poses with equal keys are the same.
pub(super) type PoseKey = (Vec<u32>, Option<usize>);

/// The skins that were read: the transforms of their joints, none of one that cannot be used.
#[derive(Default)]
pub(super) struct Skins(BTreeMap<usize, Option<Rc<Vec<DAffine3>>>>);

impl Skins {
    /// The pose of the mesh of a node. `worlds`: the transforms of the nodes.
    pub(super) fn pose<'a>(
        &mut self,
        node: &gltf::Node<'a>,
        mesh: &gltf::Mesh<'a>,
        worlds: &BTreeMap<usize, DAffine3>,
        buffers: &mut Buffers<'a>,
        text: &mut SceneText<'_>,
    ) -> MeshPose {
        let weights = node.weights().or(mesh.weights()).unwrap_or_default();
        let weights = weights.iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect();
        let Some(skin) = node.skin() else { return MeshPose { weights, skin: None } };
        let index = skin.index();
        let known = self.0.entry(index).or_insert_with(|| match joints(&skin, worlds, buffers) {
            Ok(joints) => Some(Rc::new(joints)),
            Err(message) => {
                text.tell(format!("a skin is not used, since {message}"), &format!("skins[{index}]"));
                None
            }
        });
        MeshPose { weights, skin: known.clone().map(|joints| (index, joints)) }
    }
}

/// Whether all vertices of a mesh name joints.
pub(super) fn has_joints(mesh: &gltf::Mesh<'_>) -> bool {
    let has = |primitive: &gltf::Primitive<'_>, semantic| primitive.get(&semantic).is_some();
    mesh.primitives().all(|p| has(&p, Semantic::Joints(0)) && has(&p, Semantic::Weights(0)))
}

/// The transforms of the joints, from the space of the mesh to the world.
fn joints<'a>(
    skin: &gltf::Skin<'a>,
    worlds: &BTreeMap<usize, DAffine3>,
    buffers: &mut Buffers<'a>,
) -> Result<Vec<DAffine3>, String> {
    let inverses =
        skin.inverse_bind_matrices().map(|accessor| buffers.floats::<16>(&accessor)).transpose()?;
    let count = skin.joints().count();
    if inverses.as_ref().is_some_and(|inverses| inverses.len() < count) {
        return Err("it has more joints than inverse bind matrices".to_owned());
    }
    let joint = |(i, node): (usize, gltf::Node<'_>)| {
        let world = worlds.get(&node.index());
        let world =
            world.ok_or_else(|| format!("its joint nodes[{}] is in no tree of nodes", node.index()))?;
        let inverse = inverses.as_ref().map_or(DAffine3::IDENTITY, |inverses| {
            DAffine3::from_mat4(DMat4::from_cols_array(&inverses[i].map(f64::from)))
        });
        Ok(*world * inverse)
    };
    skin.joints().enumerate().map(joint).collect()
}

impl MeshPose {
    pub(super) fn key(&self) -> PoseKey {
        (self.weights.iter().map(|v| v.to_bits()).collect(), self.skin.as_ref().map(|(index, _)| *index))
    }

    /// Whether vertices are placed by joints, so that the transform of the node means nothing.
    pub(super) fn is_skinned(&self) -> bool {
        self.skin.is_some()
    }

    /// The same without its skin.
    pub(super) fn without_skin(self) -> Self {
        Self { skin: None, ..self }
    }

    /// Moves the vertices of a primitive to their places.
    pub(super) fn apply<'a>(
        &self,
        primitive: &gltf::Primitive<'a>,
        positions: &mut [[f32; 3]],
        normals: &mut [[f32; 3]],
        buffers: &mut Buffers<'a>,
    ) -> Result<(), String> {
        let mut morphed = false;
        for (target, weight) in
            primitive.morph_targets().zip(&self.weights).filter(|(_, weight)| **weight != 0.0)
        {
            morphed = true;
            let moved = [(target.positions(), &mut *positions), (target.normals(), &mut *normals)];
            for (accessor, values) in moved {
                let Some(accessor) = accessor.filter(|_| !values.is_empty()) else { continue };
                let deltas = buffers.floats::<3>(&accessor)?;
                if deltas.len() != values.len() {
                    return Err(format!(
                        "accessors[{}] of a morph target has not an element for each vertex",
                        accessor.index()
                    ));
                }
                for (value, delta) in values.iter_mut().zip(deltas) {
                    *value = (Vec3::from(*value) + Vec3::from(delta) * *weight).to_array();
                }
            }
        }
        if let Some((_, joints)) = &self.skin {
            self::skin(primitive, joints, positions, normals, buffers)?;
            morphed = true;
        }
        if morphed {
            normals.iter_mut().for_each(|n| *n = Vec3::from(*n).normalize_or(Vec3::Z).to_array());
        }
        Ok(())
    }
}

/// Moves vertices by their joints.
fn skin<'a>(
    primitive: &gltf::Primitive<'a>,
    joints: &[DAffine3],
    positions: &mut [[f32; 3]],
    normals: &mut [[f32; 3]],
    buffers: &mut Buffers<'a>,
) -> Result<(), String> {
    buffers.spend(positions.len() * size_of::<(DAffine3, f64)>())?;
    let mut sums = vec![(DAffine3::ZERO, 0.0); positions.len()];
    for set in 0.. {
        let get = |semantic| primitive.get(&semantic);
        let (Some(named), Some(weights)) = (get(Semantic::Joints(set)), get(Semantic::Weights(set))) else {
            break;
        };
        let place = named.index();
        let (named, weights) = (buffers.integers::<4>(&named)?, buffers.shares::<4>(&weights)?);
        if [named.len(), weights.len()] != [positions.len(); 2] {
            return Err(format!("accessors[{place}] of a skin has not an element for each vertex"));
        }
        for ((sum, named), weights) in sums.iter_mut().zip(named).zip(weights) {
            for (joint, weight) in named.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0) {
                let joint = joints.get(joint as usize);
                let joint =
                    joint.ok_or_else(|| format!("accessors[{place}] names a joint that its skin has not"))?;
                let weight = f64::from(weight);
                sum.0.matrix3 += joint.matrix3 * weight;
                sum.0.translation += joint.translation * weight;
                sum.1 += weight;
            }
        }
    }
    for (i, (sum, weight)) in sums.into_iter().enumerate() {
        // A vertex without weights belongs to no joint: it stays.
        if weight <= 0.0 {
            continue;
        }
        let moved = sum.transform_point3(Vec3::from(positions[i]).as_dvec3()) / weight;
        positions[i] = moved.as_vec3().to_array();
        if let Some(normal) = normals.get_mut(i) {
            let turned = cofactors(&sum.matrix3) * Vec3::from(*normal).as_dvec3();
            *normal = turned.normalize_or(DVec3::Z).as_vec3().to_array();
        }
    }
    Ok(())
}

/// The matrix that transforms normals: the inverse of the transpose, times the determinant.
fn cofactors(m: &DMat3) -> DMat3 {
    let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
    DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}
