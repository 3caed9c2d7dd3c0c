//! Which shapes are brushed, and along what: the first texture coordinate, as Mitsuba defines it for each of its shapes.

use glam::{DVec3, Vec2, Vec3};

use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfDesc, BsdfId, Mesh, ShapeDesc, ShapeKind};
use crate::tracer::tangents::Tangents;

/// True when a material, or a side of it, looks different along the two tangents.
pub(super) fn is_brushed(desc: &SceneDesc, mut id: BsdfId) -> bool {
    // A circle of two-sided materials is an error that is told elsewhere.
    for _ in 0..=desc.bsdfs.len() {
        match desc.bsdfs.get(id.0 as usize) {
            Some(
                BsdfDesc::RoughConductor { roughness, .. } | BsdfDesc::RoughDielectric { roughness, .. },
            ) => {
                return roughness.alpha[0] != roughness.alpha[1];
            }
            Some(BsdfDesc::TwoSided { front, back }) => {
                if front != back && is_brushed_side(desc, *back) {
                    return true;
                }
                id = *front;
            }
            _ => return false,
        }
    }
    false
}

/// As [`is_brushed`], for a side: of another pair its front counts.
fn is_brushed_side(desc: &SceneDesc, id: BsdfId) -> bool {
    match desc.bsdfs.get(id.0 as usize) {
        Some(BsdfDesc::TwoSided { front, .. }) if *front != id => is_brushed(desc, *front),
        Some(BsdfDesc::TwoSided { .. }) | None => false,
        Some(_) => is_brushed(desc, id),
    }
}

/// Along what a brushed shape is brushed, where that is not a matter of its triangles.
pub(super) fn of_shape(shape: &ShapeDesc) -> Tangents {
    let along = |v: DVec3| shape.to_world.transform_vector3(v).as_vec3();
    match shape.kind {
        ShapeKind::Rectangle => Tangents::Fixed(along(DVec3::X)),
        ShapeKind::Disk => Tangents::From(shape.to_world.translation.as_vec3()),
        ShapeKind::Sphere { .. } => Tangents::Around(along(DVec3::Z)),
        ShapeKind::Mesh(_) | ShapeKind::Cube | ShapeKind::Instance(_) => Tangents::Any,
    }
}

/// u of a face of the cube, `axis` and `sign` saying where its normal points: Mitsuba's texture coordinates run up the
/// sides, and elsewhere as they happen to.
pub(super) fn of_cube_face(axis: usize, sign: f64) -> DVec3 {
    match axis {
        1 if sign > 0.0 => DVec3::X,
        1 => DVec3::Z,
        _ => DVec3::Y,
    }
}

/// ∂p/∂u over a triangle of a mesh with the world-space corners `p`, up to a factor; zero where there is none.
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
