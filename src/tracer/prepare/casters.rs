//! What casts caustics: shapes of mirror and glass, without a diffuse part that would hide the caustic.

use glam::{DAffine3, DVec3, Vec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfDesc, BsdfId, ShapeDesc, ShapeKind};
use crate::tracer::light::{BoundingSphere, CausticCasters};

/// The casters of a description in rendering space. Its materials must not contain themselves.
pub(super) fn of(desc: &SceneDesc) -> CausticCasters {
    let mut spheres = Vec::new();
    for shape in &desc.shapes {
        match shape.kind {
            ShapeKind::Instance(id) => {
                for part in desc.groups.get(id.0 as usize).iter().flat_map(|group| &group.shapes) {
                    spheres.extend(caster(desc, part, shape.to_world * part.to_world));
                }
            }
            _ => spheres.extend(caster(desc, shape, shape.to_world)),
        }
    }
    CausticCasters::new(spheres)
}

/// Whether each surface of a description casts caustics.
pub(super) fn casting(desc: &SceneDesc) -> Box<[bool]> {
    desc.surfaces().map(|shape| casts(desc, shape.bsdf)).collect()
}

/// The sphere around a shape, if it casts caustics.
fn caster(desc: &SceneDesc, shape: &ShapeDesc, to_world: DAffine3) -> Option<BoundingSphere> {
    if shape.emission.is_some() || !casts(desc, shape.bsdf) {
        return None;
    }
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
        // Too thin to be met, and nothing that aims finds an instance here.
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

/// True for a material that reflects or refracts into nearly single directions and has no diffuse part.
fn casts(desc: &SceneDesc, id: BsdfId) -> bool {
    let Some(bsdf) = desc.bsdfs.get(id.0 as usize) else { return false };
    let is_smooth = bsdf.roughness().is_none_or(|r| r.alpha[0] * r.alpha[1] <= ROUGHEST * ROUGHEST);
    // A pane bends nothing.
    let own =
        bsdf.is_specular() && is_smooth && !bsdf.is_diffuse() && !matches!(bsdf, BsdfDesc::ThinDielectric(_));
    own || bsdf.nested().into_iter().any(|id| casts(desc, id))
}
