//! Lines of sight of cameras whose picture is a plane.

use glam::{Mat3, Vec2, Vec3};

/// The lines through the centre of the lens, without normalisation, and where places lie on them: quick arithmetic in single precision, for what
/// is shown and not for light. They exist where the picture is a plane ([`Camera::lines`](super::Camera::lines)).
#[derive(Clone, Copy, Debug)]
pub struct CameraLines {
    /// A line begins at the first and a sum of the other two by uv.
    pub(super) origin: [Vec3; 3],
    pub(super) direction: [Vec3; 3],
    pub(super) position: Vec3,
    pub(super) from_world: Mat3,
    pub(super) offset: Vec2,
    /// 1 / scale.
    pub(super) per_scale: Vec2,
    pub(super) near: f32,
    pub(super) is_central: bool,
}

impl CameraLines {
    /// Origin on the near clip plane and direction, not of unit length, of the line at uv.
    #[inline]
    pub fn line(&self, uv: Vec2) -> (Vec3, Vec3) {
        let at = |[first, u, v]: [Vec3; 3]| first + uv.x * u + uv.y * v;
        let (origin, direction) = (at(self.origin), at(self.direction));
        (origin + direction * self.near, direction)
    }

    /// The uv of a place and its distance from the near clip plane along its line; `None` outside the picture, and before that plane.
    #[inline]
    pub fn project(&self, place: Vec3) -> Option<(Vec2, f32)> {
        let local = self.from_world * (place - self.position);
        if local.z <= self.near.max(0.0) {
            return None;
        }
        let (xy, length) = match self.is_central {
            true => (local.truncate() / local.z, place.distance(self.position) / local.z),
            false => (local.truncate(), 1.0),
        };
        Some((self.inside(xy)?, (local.z - self.near) * length))
    }

    /// The uv of both ends of a line segment, as far as it lies before the near clip plane; `None` where nothing of it does. They may lie
    /// outside the picture.
    pub fn segment(&self, ends: [Vec3; 2]) -> Option<[Vec2; 2]> {
        let near = self.near.max(1e-6);
        let [mut a, mut b] = ends.map(|place| self.from_world * (place - self.position));
        if a.z.max(b.z) <= near {
            return None;
        }
        let cut = |behind: Vec3, before: Vec3| behind.lerp(before, (near - behind.z) / (before.z - behind.z));
        if a.z < near {
            a = cut(a, b);
        } else if b.z < near {
            b = cut(b, a);
        }
        let uv = |local: Vec3| {
            let xy = if self.is_central { local.truncate() / local.z } else { local.truncate() };
            (xy - self.offset) * self.per_scale
        };
        Some([uv(a), uv(b)])
    }

    /// The uv of a place at infinity; `None` outside the picture, and where lines are parallel.
    #[inline]
    pub fn project_direction(&self, direction: Vec3) -> Option<Vec2> {
        let local = self.from_world * direction;
        if !self.is_central || local.z <= 0.0 {
            return None;
        }
        self.inside(local.truncate() / local.z)
    }

    fn inside(&self, xy: Vec2) -> Option<Vec2> {
        let uv = (xy - self.offset) * self.per_scale;
        (uv.cmpge(Vec2::ZERO).all() && uv.cmplt(Vec2::ONE).all()).then_some(uv)
    }
}
