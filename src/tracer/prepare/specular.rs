//! Shapes that cast caustics: mirrors and glass without a diffuse part, which would hide the caustic. And the shapes that a chain of deltas can
//! lead to: these, coated shapes, and shapes that emit.

use glam::{DAffine3, DVec3, Vec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfDesc, BsdfId, ShapeDesc, ShapeKind};
use crate::tracer::bounding_sphere::BoundingSphere;
use crate::tracer::light::CausticCasters;
use crate::tracer::specular_chain::ChainBounds;

/// The role of a surface in caustics and chains of deltas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::tracer) struct SpecularUse {
    /// It casts caustics.
    casts: bool,
    /// It has deltas.
    continues: bool,
}

impl SpecularUse {
    fn of(desc: &SceneDesc, id: BsdfId) -> Self {
        Self { casts: casts(desc, id), continues: continues(desc, id) }
    }

    /// The use of each surface of a description.
    pub(super) fn of_surfaces(desc: &SceneDesc) -> Box<[Self]> {
        desc.surfaces().map(|shape| Self::of(desc, shape.bsdf)).collect()
    }
}

/// The casters of a description in rendering space, and what chains lead to. Its materials must not contain themselves.
pub(super) fn of(desc: &SceneDesc) -> (CausticCasters, ChainBounds) {
    let (mut casters, mut chains) = (Vec::new(), Vec::new());
    let mut add = |shape: &ShapeDesc, to_world: DAffine3| {
        let (used, emits) = (SpecularUse::of(desc, shape.bsdf), shape.emission.is_some());
        if !(used.casts || used.continues || emits) {
            return;
        }
        let sphere = sphere_around(desc, shape, to_world);
        if used.casts && !emits {
            casters.extend(sphere);
        }
        if used.continues || emits {
            chains.push(sphere.unwrap_or(BoundingSphere::EVERYTHING));
        }
    };
    for shape in &desc.shapes {
        match shape.kind {
            ShapeKind::Instance(id) => {
                for part in desc.groups.get(id.0 as usize).iter().flat_map(|group| &group.shapes) {
                    add(part, shape.to_world * part.to_world);
                }
            }
            _ => add(shape, shape.to_world),
        }
    }
    if !desc.surfaces().any(|shape| shape.emission.is_some()) {
        // No chain leads to a light.
        chains.clear();
    }
    (CausticCasters::new(casters), ChainBounds::new(chains))
}

/// The sphere around a shape, if there is one that can be computed with.
fn sphere_around(desc: &SceneDesc, shape: &ShapeDesc, to_world: DAffine3) -> Option<BoundingSphere> {
    let corners = |lo: DVec3, hi: DVec3| -> Vec<DVec3> {
        let corner = |i: u32| {
            DVec3::from_array([0, 1, 2].map(|axis| if i >> axis & 1 == 0 { lo[axis] } else { hi[axis] }))
        };
        (0..8).map(corner).collect()
    };
    let points = match &shape.kind {
        ShapeKind::Mesh(id) => {
            desc.meshes.get(id.0 as usize)?.positions.iter().map(|p| p.as_dvec3()).collect()
        }
        ShapeKind::Sphere { center, radius } => {
            let scale = to_world.matrix3.determinant().abs().cbrt();
            let center = to_world.transform_point3(*center).as_vec3();
            return usable(center, (radius.abs() * scale) as f32);
        }
        ShapeKind::Cylinder { p0, p1, radius } => {
            corners(p0.min(*p1) - radius.abs(), p0.max(*p1) + radius.abs())
        }
        ShapeKind::Disk | ShapeKind::Rectangle => corners(DVec3::NEG_ONE.with_z(0.0), DVec3::ONE.with_z(0.0)),
        ShapeKind::Cube => corners(DVec3::NEG_ONE, DVec3::ONE),
        // A curve is too thin to be aimed at. An instance is no shape of its own.
        ShapeKind::Curves(_) | ShapeKind::Instance(_) => return None,
    };
    let points = || points.iter().map(|p| to_world.transform_point3(*p).as_vec3());
    let (lo, hi) = points().fold((Vec3::MAX, Vec3::MIN), |(lo, hi), p| (lo.min(p), hi.max(p)));
    let center = 0.5 * (lo + hi);
    usable(center, points().map(|p| p.distance(center)).fold(0.0, f32::max))
}

/// The sphere, if it has a size that can be computed with.
fn usable(center: Vec3, radius: f32) -> Option<BoundingSphere> {
    let area = radius * radius;
    (center.is_finite() && area.is_normal()).then_some(BoundingSphere { center, radius })
}

/// Greatest roughness α of a material that casts caustics, the geometric mean of both axes: rougher ones spread light so far that
/// connections find it.
const ROUGHEST: f32 = 0.1;

/// True for a material that may name deltas in [`ScatteringModel::delta_lobes`](crate::tracer::bsdf::ScatteringModel::delta_lobes): one without
/// roughness, and rough glass, which is smooth where both of its sides are of one index.
fn continues(desc: &SceneDesc, id: BsdfId) -> bool {
    let Some(bsdf) = desc.bsdfs.get(id.0 as usize) else { return false };
    let own = bsdf.is_delta() || matches!(bsdf, BsdfDesc::RoughDielectric(_));
    own || bsdf.nested().into_iter().any(|id| continues(desc, id))
}

/// True for a material that reflects or refracts into nearly single directions and has no diffuse part.
fn casts(desc: &SceneDesc, id: BsdfId) -> bool {
    let Some(bsdf) = desc.bsdfs.get(id.0 as usize) else { return false };
    let is_smooth = bsdf.roughness().is_none_or(|r| r.alpha[0] * r.alpha[1] <= ROUGHEST * ROUGHEST);
    // A pane bends nothing, and what is under a coat says for itself.
    let own = bsdf.is_specular()
        && is_smooth
        && !bsdf.is_diffuse()
        && !matches!(bsdf, BsdfDesc::ThinDielectric(_))
        && bsdf.coat().is_none();
    own || bsdf.nested().into_iter().any(|id| casts(desc, id))
}
