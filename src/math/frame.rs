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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    /// Frisvad's form (2012), the naive method here, breaks down near n = −z.
    #[test]
    fn frames_are_orthonormal_everywhere() {
        let frisvad = |n: Vec3| {
            let a = 1.0 / (1.0 + n.z);
            let b = -n.x * n.y * a;
            (Vec3::new(1.0 - n.x * n.x * a, b, -n.x), Vec3::new(b, 1.0 - n.y * n.y * a, -n.y))
        };
        let (mut worst, mut worst_naive) = (0f32, 0f32);
        let mut random = Random(1);
        let mut next = || random.within(-1.0, 1.0);
        for i in 0..1_000_000 {
            // Half of them within 1e-3 of the poles, the difficult case.
            let squeeze = if i % 2 == 0 { 1.0 } else { 1e-3 };
            let z = if i % 4 < 2 { -1.0 } else { 1.0 };
            let v = Vec3::new(next() * squeeze, next() * squeeze, if i % 2 == 0 { next() } else { z });
            let Some(n) = v.try_normalize() else { continue };
            let f = Frame::new(n);
            let det = f.s.cross(f.t).dot(f.n);
            let off = f.s.dot(f.t).abs().max(f.s.dot(n).abs()).max(f.t.dot(n).abs()).max((det - 1.0).abs());
            worst = worst.max(off).max((f.s.length() - 1.0).abs()).max((f.t.length() - 1.0).abs());
            let (s, t) = frisvad(n);
            let naive = s.dot(t).abs().max((s.length() - 1.0).abs());
            worst_naive = worst_naive.max(if naive.is_finite() { naive } else { 1.0 });
        }
        assert!(worst_naive > 1e-3, "the case is too easy: {worst_naive}");
        assert!(worst < 1e-6, "worst deviation {worst}");
    }

    #[test]
    fn frames_along_a_direction() {
        let n = Vec3::new(0.48, -0.6, -0.64);
        for along in [Vec3::X, Vec3::new(1e-20, 3e-20, 0.0), Vec3::new(-1e18, 0.0, 2e18), n + Vec3::X * 1e-3]
        {
            let f = Frame::along(n, along);
            let off = f.s.dot(n).abs().max(f.t.dot(n).abs()).max((f.s.cross(f.t) - n).length());
            assert!(off < 1e-6, "{along}: {f:?}");
            assert!(f.t.dot(along.normalize()).abs() < 1e-4 && f.s.dot(along) > 0.0, "{along}: {f:?}");
        }
        for none in [Vec3::ZERO, n, -n * 7.0, Vec3::splat(f32::NAN)] {
            assert_eq!(Frame::along(n, none).s, Frame::new(n).s);
        }
    }

    #[test]
    fn local_and_back() {
        let f = Frame::new(Vec3::new(0.48, -0.6, -0.64));
        let v = Vec3::new(0.3, 0.4, -1.2);
        assert!((f.to_world(f.to_local(v)) - v).length() < 1e-6);
        assert!((f.to_local(f.n) - Vec3::Z).length() < 1e-6);
    }
}
