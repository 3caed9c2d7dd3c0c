//! The placement of an instance: transforms between the space of its group and the world.
//!
//! The primitives of a group stay in its space. The traversal transforms a ray to that space
//! ([`Accel::ray_in_instance`](super::accel::Accel::ray_in_instance)), and [`Placement::point`] transforms the point that it hits back to
//! the world. Both use double precision and round once, so the error is bounded.

use glam::{DAffine3, DVec3, Vec3};

use crate::math::float::UNIT_ROUNDOFF;

use super::shape::SurfacePoint;

/// An instance of a group.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placement {
    /// The group's space to world space.
    pub(super) to_world: DAffine3,
    /// World space to the group's space.
    to_group: DAffine3,
    /// Index into [`SceneDesc::shapes`](crate::scene::SceneDesc::shapes).
    pub(super) shape: u32,
}

impl Placement {
    /// The placement with the transform `to_world`, or `None` if that has no inverse or is not finite.
    pub(super) fn new(to_world: DAffine3, shape: u32) -> Option<Self> {
        let to_group = to_world.inverse();
        let usable = to_world.is_finite() && to_group.is_finite() && to_world.matrix3.determinant() != 0.0;
        usable.then_some(Self { to_world, to_group, shape })
    }

    /// Transforms a surface point of the group to world space.
    ///
    /// Let M be the matrix, t the translation, x the point in the group with error e, and u the unit roundoff of single
    /// precision. Then the error bound is |M|·(e + u·|x|) + u·|Mx + t| + 2⁻⁵⁰·(|M|·|x| + |t|). The term u·|x| is for spawned
    /// rays, whose origins are rounded once more in the space of the group. The last term is for cancellation in the matrix
    /// product.
    pub(super) fn point(&self, point: &SurfacePoint) -> SurfacePoint {
        /// An upper bound for 4 operations in double precision: γ₄ ≈ 2⁻⁵¹.
        const PRODUCT: f64 = 4.0 * f64::EPSILON;
        // A little above the unit roundoff, because a ray's origin lies beside the point, and the bound is rounded too.
        let u = 1.01 * f64::from(UNIT_ROUNDOFF);
        let (x, e) = (point.p.as_dvec3(), point.error.as_dvec3());
        let (m, t) = (self.to_world.matrix3, self.to_world.translation);
        let p = m * x + t;
        let size = m.abs();
        let moved = size * (e + x.abs() * u);
        let error = moved + p.abs() * u + (size * x.abs() + t.abs()) * PRODUCT;
        SurfacePoint { p: p.as_vec3(), error: (error * (1.0 + u)).as_vec3(), ng: self.normal(point.ng) }
    }

    /// Transforms a surface point in world space back to the group, up to the rounding of its world-space coordinates; its error bound is
    /// not transformed.
    pub(super) fn point_in_group(&self, point: &SurfacePoint) -> SurfacePoint {
        let p = self.to_group.transform_point3(point.p.as_dvec3()).as_vec3();
        let ng = (self.to_world.matrix3.transpose() * point.ng.as_dvec3()).normalize_or(DVec3::Z).as_vec3();
        SurfacePoint { p, ng, ..*point }
    }

    /// Transforms a unit normal of the group to world space. The inverse transpose keeps it on the outside under a mirroring
    /// transform, as in Mitsuba.
    pub(super) fn normal(&self, n: Vec3) -> Vec3 {
        (self.to_group.matrix3.transpose() * n.as_dvec3()).normalize_or(DVec3::Z).as_vec3()
    }

    /// Transforms a vector of the group to world space.
    pub(super) fn vector(&self, v: Vec3) -> Vec3 {
        self.to_world.transform_vector3(v.as_dvec3()).as_vec3()
    }

    /// Transforms a tangent of the group to world space, as a unit vector.
    pub(super) fn along(&self, v: Vec3) -> Vec3 {
        self.to_world.transform_vector3(v.as_dvec3()).normalize_or_zero().as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    fn stretched() -> Placement {
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 1.1);
        let m = turn * DMat3::from_diagonal(DVec3::new(3.0, -0.2, 1.0));
        let place = DAffine3::from_mat3_translation(m, DVec3::new(100.0, -3.0, 7.0));
        Placement::new(place, 0).expect("invertible")
    }

    #[test]
    fn normals_stay_at_right_angles_and_outside() {
        let place = stretched();
        let n = Vec3::new(0.6, 0.0, 0.8);
        let world = place.normal(n);
        assert!((world.length() - 1.0).abs() < 1e-6);
        for v in [Vec3::Y, Vec3::new(0.8, 0.0, -0.6)] {
            assert!(place.along(v).dot(world).abs() < 1e-6);
        }
        assert!(place.along(n).dot(world) > 0.0, "outwards");
    }

    #[test]
    fn the_error_holds_the_truth() {
        let place = stretched();
        for i in 0..1000 {
            let f = |k: f64| (f64::from(i) * k).sin() * 50.0;
            let truth = DVec3::new(f(0.37), f(0.73), f(1.91));
            let p = truth.as_vec3();
            let error = (p.as_dvec3() - truth).abs().as_vec3() * 1.000_001;
            let world = place.point(&SurfacePoint { p, error, ng: Vec3::Z });
            let off = (world.p.as_dvec3() - place.to_world.transform_point3(truth)).abs();
            assert!(off.cmple(world.error.as_dvec3()).all(), "{off} beyond {}", world.error);
            // Beside the roundings there is the longest of the three scales only.
            assert!(world.error.max_element() < 4.0 * 250.0 * f32::EPSILON, "{}", world.error);
        }
    }

    #[test]
    fn what_has_no_inverse_has_no_place() {
        let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
        assert!(Placement::new(flat, 0).is_none());
        assert!(Placement::new(DAffine3::from_translation(DVec3::NAN), 0).is_none());
        // There may be millions: two matrices and a number.
        assert!(size_of::<Placement>() <= 2 * size_of::<DAffine3>() + 8);
    }
}
