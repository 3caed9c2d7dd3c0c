//! How points move with texture coordinates, as Mitsuba defines it for each shape: on brushed (anisotropic) surfaces the direction of
//! the first coordinate, on those that have a bump both derivatives.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3, Vec2, Vec3};

use crate::math::frame::Frame;
use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfId, Mesh, ShapeDesc, ShapeKind};

use super::shape::SurfacePoint;

/// The derivatives of one shape. Those of brushed surfaces are ∂p/∂u up to a factor of either sign: the microfacet distribution is
/// symmetric.
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
    /// ∂p/∂u and ∂p/∂v by triangle. Zero where they are undefined.
    Triangles {
        /// The first triangle of the shape.
        first: u32,
        /// Those of this triangle and of those that follow.
        of: Vec<[Vec3; 2]>,
    },
    /// ∂p/∂u and ∂p/∂v of a disk, sphere or cylinder.
    Round(RoundDerivatives),
}

/// The derivatives of a disk, sphere or cylinder by its own coordinates.
#[derive(Debug)]
pub(super) struct RoundDerivatives {
    shape: RoundShape,
    /// The shape's own space, in which it has radius 1, to world space.
    to_world: DMat3,
    to_local: DMat3,
    /// Centre, or that of the first end, world space.
    origin: DVec3,
}

#[derive(Clone, Copy, Debug)]
enum RoundShape {
    Disk,
    Sphere,
    Cylinder,
}

impl RoundDerivatives {
    fn at(&self, p: Vec3) -> [Vec3; 2] {
        let local = self.to_local * (p.as_dvec3() - self.origin);
        let radius = local.truncate().length();
        let around = DVec3::new(-local.y, local.x, 0.0) * TAU;
        let (x, y) = if radius > 0.0 { (local.x / radius, local.y / radius) } else { (1.0, 0.0) };
        let [du, dv] = match self.shape {
            RoundShape::Disk => [DVec3::new(x, y, 0.0), around],
            RoundShape::Sphere => [around, DVec3::new(local.z * x, local.z * y, -radius) * PI],
            RoundShape::Cylinder => [around, DVec3::Z],
        };
        [du, dv].map(|v| (self.to_world * v).as_vec3())
    }
}

impl Tangents {
    /// ∂p/∂u and ∂p/∂v at a point of primitive `prim`: both exact, or the first up to a factor and no second, or neither.
    #[inline(never)]
    pub(super) fn at(&self, prim: u32, point: &SurfacePoint) -> [Vec3; 2] {
        let of = |first: &u32| prim.checked_sub(*first).map_or(usize::MAX, |i| i as usize);
        let along = match self {
            Tangents::Any => return [Vec3::ZERO; 2],
            Tangents::Fixed(along) => *along,
            Tangents::From(center) => point.p - *center,
            Tangents::Around(axis) => axis.cross(point.ng),
            Tangents::Each { first, along } => along.get(of(first)).copied().unwrap_or(Vec3::ZERO),
            Tangents::Triangles { first, of: known } => {
                return match known.get(of(first)) {
                    Some(&[du, dv]) if du != Vec3::ZERO && dv != Vec3::ZERO => [du, dv],
                    _ => any_tangents(point),
                };
            }
            Tangents::Round(derivatives) => {
                let [du, dv] = derivatives.at(point.p);
                return if du != Vec3::ZERO && dv != Vec3::ZERO { [du, dv] } else { any_tangents(point) };
            }
        };
        // Where it is undefined, use the s axis of the geometric normal's frame.
        [if along == Vec3::ZERO { any_tangents(point)[0] } else { along }, Vec3::ZERO]
    }
}

/// The tangents of the geometric normal's frame, for points where texture coordinates have no derivatives.
fn any_tangents(point: &SurfacePoint) -> [Vec3; 2] {
    let frame = Frame::new(point.ng);
    [frame.s, frame.t]
}

/// True if a material, or one that it is made of, has a map of normals or heights.
pub(super) fn has_bump(desc: &SceneDesc, id: BsdfId) -> bool {
    desc.made_of(id).iter().any(|bsdf| bsdf.bump().is_some())
}

/// ∂p/∂u and ∂p/∂v of a triangle with the corners `p` from the steps of its texture coordinates (`texture_coordinates::of_corners`).
/// Zero where they are undefined.
pub(super) fn derivatives_of_triangle(p: [Vec3; 3], [_, e, f]: [Vec2; 3]) -> [Vec3; 2] {
    let [p0, p1, p2] = p.map(|p| p.as_dvec3());
    let (e, f) = (e.as_dvec2(), f.as_dvec2());
    let (a, b) = (p1 - p0, p2 - p0);
    let inverse = 1.0 / e.perp_dot(f);
    let both = [(a * f.y - b * e.y) * inverse, (b * e.x - a * f.x) * inverse].map(|v| v.as_vec3());
    if both.iter().all(|v| v.is_finite()) { both } else { [Vec3::ZERO; 2] }
}

/// The derivatives of a shape that is not made of triangles.
pub(super) fn derivatives_of_shape(shape: &ShapeDesc) -> Tangents {
    let m = shape.to_world.matrix3;
    let (kind, to_world, origin) = match shape.kind {
        ShapeKind::Disk => (RoundShape::Disk, m, DVec3::ZERO),
        ShapeKind::Sphere { center, radius } => {
            // A sphere stays one.
            let scale = m.determinant().abs().cbrt();
            let columns = [m.x_axis, m.y_axis, m.z_axis].map(|c| c.normalize_or_zero() * (scale * radius));
            (RoundShape::Sphere, DMat3::from_cols(columns[0], columns[1], columns[2]), center)
        }
        ShapeKind::Cylinder { p0, p1, radius } => {
            let (s, t) = (p1 - p0).normalize_or(DVec3::Z).any_orthonormal_pair();
            let axes = DMat3::from_cols(s * radius, t * radius, p1 - p0);
            (RoundShape::Cylinder, m * axes, p0)
        }
        ShapeKind::Mesh(_)
        | ShapeKind::Rectangle
        | ShapeKind::Cube
        | ShapeKind::Curves(_)
        | ShapeKind::Instance(_) => return Tangents::Any,
    };
    let origin = shape.to_world.transform_point3(origin);
    Tangents::Round(RoundDerivatives { shape: kind, to_world, to_local: to_world.inverse(), origin })
}

/// True if a material, or one that it is made of, is anisotropic.
pub(super) fn is_brushed(desc: &SceneDesc, id: BsdfId) -> bool {
    desc.made_of(id).iter().any(|bsdf| bsdf.is_brushed())
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
        ShapeKind::Mesh(_) | ShapeKind::Cube | ShapeKind::Curves(_) | ShapeKind::Instance(_) => Tangents::Any,
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
