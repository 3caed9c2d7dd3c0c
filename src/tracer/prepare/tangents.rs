//! Brushed (anisotropic) shapes and the direction of their first texture coordinate, as Mitsuba defines it for each shape.

use glam::{DVec3, Vec2, Vec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfDesc, BsdfId, Mesh, ShapeDesc, ShapeKind, TwoSidedDesc};
use crate::tracer::tangents::Tangents;

/// True if a material, or one of its sides, is anisotropic.
pub(super) fn is_brushed(desc: &SceneDesc, mut id: BsdfId) -> bool {
    // `materials` reports a cycle of two-sided materials.
    for _ in 0..=desc.bsdfs.len() {
        match desc.bsdfs.get(id.0 as usize) {
            Some(BsdfDesc::TwoSided(TwoSidedDesc { front, back })) => {
                if front != back && is_brushed_side(desc, *back) {
                    return true;
                }
                id = *front;
            }
            Some(bsdf) => return bsdf.roughness().is_some_and(|r| r.alpha[0] != r.alpha[1]),
            None => return false,
        }
    }
    false
}

/// As [`is_brushed`], for one side. Of a nested two-sided material the front counts.
fn is_brushed_side(desc: &SceneDesc, id: BsdfId) -> bool {
    match desc.bsdfs.get(id.0 as usize) {
        Some(BsdfDesc::TwoSided(TwoSidedDesc { front, .. })) if *front != id => is_brushed(desc, *front),
        Some(BsdfDesc::TwoSided(_)) | None => false,
        Some(_) => is_brushed(desc, id),
    }
}

/// The tangents of a brushed shape, if they do not depend on its triangles.
pub(super) fn of_shape(shape: &ShapeDesc) -> Tangents {
    let along = |v: DVec3| shape.to_world.transform_vector3(v).as_vec3();
    match shape.kind {
        ShapeKind::Rectangle => Tangents::Fixed(along(DVec3::X)),
        ShapeKind::Disk => Tangents::From(shape.to_world.translation.as_vec3()),
        ShapeKind::Sphere { .. } => Tangents::Around(along(DVec3::Z)),
        ShapeKind::Mesh(_) | ShapeKind::Cube | ShapeKind::Instance(_) => Tangents::Any,
    }
}

/// The direction of u on the face of a cube whose normal is `sign` times the unit vector of `axis`, as in Mitsuba.
pub(super) fn of_cube_face(axis: usize, sign: f64) -> DVec3 {
    match axis {
        1 if sign > 0.0 => DVec3::X,
        1 => DVec3::Z,
        _ => DVec3::Y,
    }
}

/// ∂p/∂u of a triangle of a mesh with the world-space corners `p`, up to a factor. Zero if it is undefined.
pub(super) fn of_triangle(mesh: &Mesh, triangle: [u32; 3], p: [Vec3; 3]) -> Vec3 {
    let uv = |i: usize| mesh.uvs.get(triangle[i] as usize).copied();
    let (Some(a), Some(b), Some(c)) = (uv(0), uv(1), uv(2)) else { return Vec3::ZERO };
    let (e, f): (Vec2, Vec2) = (b - a, c - a);
    let (e, f) = (e.as_dvec2(), f.as_dvec2());
    let [p0, p1, p2] = p.map(|p| p.as_dvec3());
    let determinant = e.perp_dot(f);
    ((p1 - p0) * f.y - (p2 - p0) * e.y).normalize_or_zero().as_vec3()
        * determinant.signum() as f32
        * f32::from(determinant != 0.0)
}
