//! Skeletons (UsdSkel): meshes as their joints bend them at the first time of the animation, or at rest.
//!
//! A point goes to the space of the skeleton by `skel:geomBindTransform`, and there by the weighted sum of its joints, each of which
//! takes it from where it was bound to where the joint is (linear blend skinning). The result is placed by the skeleton, not by the
//! mesh.

use std::collections::BTreeMap;
use std::rc::Rc;

use glam::{DAffine3, DMat3, DQuat, DVec3, Mat3, Vec3};
use openusd::sdf::{Path, Value};
use openusd::usd::Stage;

use super::prim::{PrimReader, leads_up};
use super::transform;
use super::values;

/// A mesh in its pose, in its own space.
pub(super) struct PosedMesh {
    pub(super) points: Vec<Vec3>,
    /// The matrix that transforms the normals at each point.
    pub(super) turns: Vec<Mat3>,
}

/// A skeleton in its pose: for each joint what takes a point from where it was bound.
struct PosedSkeleton {
    joints: Vec<String>,
    moves: Vec<DAffine3>,
    to_stage: DAffine3,
}

/// The skeletons of a stage, by their path and that of their animation.
pub(super) struct Skeletons {
    stage: Stage,
    known: BTreeMap<String, Result<Rc<PosedSkeleton>, String>>,
}

impl Skeletons {
    pub(super) fn new(stage: &Stage) -> Self {
        Self { stage: stage.clone(), known: BTreeMap::new() }
    }

    /// A mesh as its skeleton bends it; none where it has none, or one that cannot be used, which is told.
    pub(super) fn posed(&mut self, mesh: &PrimReader) -> Option<PosedMesh> {
        let indices = mesh.integers("primvars:skel:jointIndices");
        let weights = mesh.tuples("primvars:skel:jointWeights");
        let bound = affine(mesh, "primvars:skel:geomBindTransform").unwrap_or_default();
        let order = mesh.value("skel:joints").as_ref().and_then(values::words);
        let method = mesh.word("primvars:skel:skinningMethod");
        let [skeleton, animation] =
            ["skel:skeleton", "skel:animationSource"].map(|name| self.inherited(mesh, name));
        let (indices, weights) = (indices?, weights?);
        if method.is_some_and(|word| word != "classicLinear") {
            mesh.fault("dual quaternion skinning is not used: joints are blended linearly");
        }
        let posed = match skeleton {
            Some(path) => self.skeleton(&path, animation.as_deref()),
            None => Err("a mesh has joints but no skeleton".to_owned()),
        };
        let posed = posed.and_then(|skeleton| {
            let moves = skeleton.moves_of(order.as_deref())?;
            let points = mesh.tuples("points").unwrap_or_default().all::<3>();
            let size = influences(mesh, &indices, weights.values.len(), points.len())?;
            let back = world(&self.stage, mesh.prim.path()).inverse() * skeleton.to_stage;
            let mut out = PosedMesh { points: Vec::new(), turns: Vec::new() };
            for (i, point) in points.iter().enumerate() {
                // Constant influences are those of all points.
                let first = if indices.len() == size { 0 } else { i * size };
                let (mut sum, mut total) = ([DVec3::ZERO; 4], 0.0);
                let pairs = indices.iter().zip(&weights.values).skip(first).take(size);
                for (index, weight) in pairs {
                    let weight = f64::from(*weight);
                    if weight == 0.0 {
                        continue;
                    }
                    let joint = usize::try_from(*index).ok().and_then(|j| moves.get(j));
                    let joint = joint.ok_or("a mesh names joints that its skeleton has not")?;
                    let DMat3 { x_axis, y_axis, z_axis } = joint.matrix3;
                    for (sum, column) in sum.iter_mut().zip([x_axis, y_axis, z_axis, joint.translation]) {
                        *sum += weight * column;
                    }
                    total += weight;
                }
                let blended = match total > 0.0 {
                    true => DAffine3::from_mat3_translation(
                        DMat3::from_cols(sum[0] / total, sum[1] / total, sum[2] / total),
                        sum[3] / total,
                    ),
                    false => DAffine3::IDENTITY,
                };
                let all = back * blended * bound;
                out.points.push(all.transform_point3(DVec3::from(point.map(f64::from))).as_vec3());
                out.turns.push(all.matrix3.inverse().transpose().as_mat3());
            }
            Ok(out)
        });
        posed.map_err(|error| mesh.fault(format!("{error}: it is shown as it was modelled"))).ok()
    }

    /// The first target of a relationship of a prim or of the nearest one above it that has it.
    fn inherited(&self, prim: &PrimReader, name: &str) -> Option<String> {
        if let Some(own) = prim.targets(name).first() {
            return Some(own.as_str().to_owned());
        }
        prim.prim.path().strict_ancestors().find_map(|path| {
            let above = PrimReader::new(self.stage.prim(path));
            above.targets(name).first().map(|path| path.as_str().to_owned())
        })
    }

    fn skeleton(&mut self, path: &str, animation: Option<&str>) -> Result<Rc<PosedSkeleton>, String> {
        let key = format!("{path} {}", animation.unwrap_or(""));
        if let Some(known) = self.known.get(&key) {
            return known.clone();
        }
        let read = self.read(path, animation).map(Rc::new);
        self.known.insert(key, read.clone());
        read
    }

    fn read(&self, path: &str, animation: Option<&str>) -> Result<PosedSkeleton, String> {
        let parsed = Path::new(path).ok().filter(leads_up).ok_or("a skeleton has no path")?;
        let prim = PrimReader::new(self.stage.prim(parsed.clone()));
        let joints = prim.value("joints").as_ref().and_then(values::words).unwrap_or_default();
        let bind = matrices(&prim, "bindTransforms");
        let mut local = matrices(&prim, "restTransforms");
        if joints.is_empty() || bind.len() != joints.len() {
            return Err("a skeleton has not a bind transform for each joint".to_owned());
        }
        let own = prim.targets("skel:animationSource").first().map(|path| path.as_str().to_owned());
        let animated = own.as_deref().or(animation).and_then(|path| self.animation(path));
        let parents: BTreeMap<&str, usize> =
            joints.iter().enumerate().map(|(i, name)| (name.as_str(), i)).collect();
        if local.len() != joints.len() {
            // Without a pose at rest it is where it was bound.
            local = (0..joints.len())
                .map(|i| match parent_of(&joints[i]).and_then(|name| parents.get(name)) {
                    Some(parent) => bind[*parent].inverse() * bind[i],
                    None => bind[i],
                })
                .collect();
        }
        for (name, place) in animated.unwrap_or_default() {
            if let Some(i) = parents.get(name.as_str()) {
                local[*i] = place;
            }
        }
        // Parents stand before their joints, as UsdSkel demands.
        let mut places: Vec<DAffine3> = Vec::with_capacity(joints.len());
        for (i, name) in joints.iter().enumerate() {
            let parent = parent_of(name).and_then(|name| parents.get(name)).filter(|parent| **parent < i);
            places.push(parent.map_or(local[i], |parent| places[*parent] * local[i]));
        }
        let moves = places.iter().zip(&bind).map(|(place, bind)| *place * bind.inverse()).collect();
        Ok(PosedSkeleton { joints, moves, to_stage: world(&self.stage, &parsed) })
    }

    /// The places of the joints of an animation, relative to their parents.
    fn animation(&self, path: &str) -> Option<Vec<(String, DAffine3)>> {
        let prim = PrimReader::new(self.stage.prim(Path::new(path).ok().filter(leads_up)?));
        let joints = prim.value("joints").as_ref().and_then(values::words)?;
        let [moves, turns, scales] =
            ["translations", "rotations", "scales"].map(|name| prim.tuples(name).unwrap_or_default());
        let place = |i: usize| {
            let vector = |v: [f32; 3]| DVec3::from(v.map(f64::from));
            let q = turns.get::<4>(i).unwrap_or([1.0, 0.0, 0.0, 0.0]).map(f64::from);
            let turn = DQuat::from_xyzw(q[1], q[2], q[3], q[0]);
            DAffine3::from_scale_rotation_translation(
                scales.get(i).map_or(DVec3::ONE, vector),
                if turn.length_squared() > 0.0 { turn.normalize() } else { DQuat::IDENTITY },
                moves.get(i).map_or(DVec3::ZERO, vector),
            )
        };
        Some(joints.into_iter().enumerate().map(|(i, name)| (name, place(i))).collect())
    }
}

impl PosedSkeleton {
    /// The transforms of the joints in the order of a mesh, which may have its own.
    fn moves_of(&self, order: Option<&[String]>) -> Result<Vec<DAffine3>, String> {
        let Some(order) = order else { return Ok(self.moves.clone()) };
        let find = |name: &String| self.joints.iter().position(|known| known == name).map(|i| self.moves[i]);
        let found: Option<Vec<DAffine3>> = order.iter().map(find).collect();
        found.ok_or_else(|| "a mesh names joints that its skeleton has not".to_owned())
    }
}

/// Joints of each point.
fn influences(mesh: &PrimReader, indices: &[i64], weights: usize, points: usize) -> Result<usize, String> {
    let size = mesh.metadata("primvars:skel:jointIndices", "elementSize");
    let size = size.as_ref().and_then(values::doubles).and_then(|all| all.first().copied());
    let size = size.map_or(1, |size| size.clamp(0.0, 1024.0) as usize);
    let is_one = indices.len() == size;
    match size > 0 && weights == indices.len() && (is_one || points.checked_mul(size) == Some(indices.len()))
    {
        true => Ok(size),
        false => Err("a mesh has not joints and weights for each point".to_owned()),
    }
}

/// The name of the joint above one.
fn parent_of(joint: &str) -> Option<&str> {
    joint.rsplit_once('/').map(|(parent, _)| parent)
}

/// A matrix of an attribute, for columns.
fn affine(prim: &PrimReader, name: &str) -> Option<DAffine3> {
    let numbers: [f64; 16] = prim.doubles(name, 16)?.try_into().ok()?;
    Some(DAffine3::from_mat4(glam::DMat4::from_cols_array(&numbers)))
}

fn matrices(prim: &PrimReader, name: &str) -> Vec<DAffine3> {
    match prim.value(name) {
        Some(Value::Matrix4dVec(all)) => {
            all.iter().map(|m| DAffine3::from_mat4(glam::DMat4::from_cols_array(&m.0))).collect()
        }
        _ => Vec::new(),
    }
}

/// From a prim to the stage.
fn world(stage: &Stage, path: &Path) -> DAffine3 {
    let mut to_stage = DAffine3::IDENTITY;
    for path in path.ancestors_below_root() {
        let (local, resets) = transform::local(&PrimReader::new(stage.prim(path)));
        to_stage = local * to_stage;
        if resets {
            break;
        }
    }
    to_stage
}
