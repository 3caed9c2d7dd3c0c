//! Orthonormal frames around a normal.

use glam::Vec3;

/// A right-handed orthonormal frame. `n` is the z axis of its local space.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Local x in world space.
    pub s: Vec3,
    /// Local y in world space.
    pub t: Vec3,
    /// Local z in world space, unit length.
    pub n: Vec3,
}

impl Frame {
    /// The axes of world space.
    pub const WORLD: Self = Self { s: Vec3::X, t: Vec3::Y, n: Vec3::Z };

    /// The frame around the unit vector `n`, without branches and without a division by zero at n = −z
    /// (Duff et al., *Building an Orthonormal Basis, Revisited*, JCGT 6(1), 2017).
    #[inline]
    pub fn new(n: Vec3) -> Self {
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// The frame around the unit vector `n` whose s axis is the part of `along` (of any length) perpendicular to `n`, or that of
    /// [`Frame::new`] if there is no such part.
    pub fn along(n: Vec3, along: Vec3) -> Self {
        let along = along.normalize_or_zero();
        let across = along - n * n.dot(along);
        // Below this, the rest consists of rounding errors.
        if across.length_squared() < 1e-10 {
            return Self::new(n);
        }
        // Orthogonalised twice, because the first difference may have lost precision.
        let s = across.normalize();
        let s = (s - n * n.dot(s)).normalize();
        Self { s, t: n.cross(s), n }
    }

    /// This frame after a turn by 180° about the s axis: that of the back of a surface, right-handed as well.
    #[inline]
    pub fn turned(&self) -> Self {
        Self { s: self.s, t: -self.t, n: -self.n }
    }

    /// World space to local space.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.s), v.dot(self.t), v.dot(self.n))
    }

    /// Local space to world space.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.s * v.x + self.t * v.y + self.n * v.z
    }
}
