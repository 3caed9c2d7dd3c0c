//! The direction of the first texture coordinate on brushed (anisotropic) surfaces, as Mitsuba defines it for each shape.

use glam::{DVec3, Vec2, Vec3};

use crate::math::frame::Frame;
use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfId, Mesh, ShapeDesc, ShapeKind};

use super::shape::SurfacePoint;

/// ∂p/∂u of one shape, up to a factor of either sign: the microfacet distribution is symmetric.
#[derive(Debug)]
pub(super) enum Tangents {
    /// Undefined: the shape is not brushed, or has no texture coordinates.
    Any,
    /// Constant.
    Fixed(Vec3),
    /// Radial from a point.
    From(Vec3),
    /// Around an axis.
    Around(Vec3),
    /// By triangle. Zero where it is undefined.
    Each {
        /// The first triangle of the shape.
        first: u32,
        /// ∂p/∂u of this triangle and of those that follow.
        along: Vec<Vec3>,
    },
}

impl Tangents {
    /// The shading frame with normal `n` at a point of primitive `prim`. Its s axis is the part of ∂p/∂u perpendicular to `n`.
    pub(super) fn frame(&self, prim: u32, point: &SurfacePoint, n: Vec3) -> Frame {
        self.along(prim, point).map_or_else(|| Frame::new(n), |along| Frame::along(n, along))
    }

    /// ∂p/∂u at a point of primitive `prim`, up to a factor. `None` if any direction will do.
    pub(super) fn along(&self, prim: u32, point: &SurfacePoint) -> Option<Vec3> {
        let along = match self {
            Tangents::Any => return None,
            Tangents::Fixed(along) => *along,
            Tangents::From(center) => point.p - *center,
            Tangents::Around(axis) => axis.cross(point.ng),
            Tangents::Each { first, along } => {
                let i = prim.checked_sub(*first).map_or(usize::MAX, |i| i as usize);
                along.get(i).copied().unwrap_or(Vec3::ZERO)
            }
        };
        // Where it is undefined, use the s axis of the geometric normal's frame.
        Some(if along == Vec3::ZERO { Frame::new(point.ng).s } else { along })
    }
}

/// True if a material, or one that it is made of, is anisotropic.
pub(super) fn is_brushed(desc: &SceneDesc, id: BsdfId) -> bool {
    desc.made_of(id).iter().any(|bsdf| bsdf.roughness().is_some_and(|r| r.alpha[0] != r.alpha[1]))
}

/// The tangents of a brushed shape, if they do not depend on its triangles.
pub(super) fn of_shape(shape: &ShapeDesc) -> Tangents {
    let along = |v: DVec3| shape.to_world.transform_vector3(v).as_vec3();
    match shape.kind {
        ShapeKind::Rectangle => Tangents::Fixed(along(DVec3::X)),
        ShapeKind::Disk => Tangents::From(shape.to_world.translation.as_vec3()),
        ShapeKind::Sphere { .. } => Tangents::Around(along(DVec3::Z)),
        ShapeKind::Cylinder { p0, p1, .. } => {
            // Perpendicular to the ends, also where they are sheared against the axis.
            let to_normal = shape.to_world.matrix3.inverse().transpose();
            Tangents::Around((to_normal * (p1 - p0)).normalize_or(DVec3::Z).as_vec3())
        }
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
