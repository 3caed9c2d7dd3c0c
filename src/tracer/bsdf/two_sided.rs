//! Two-sidedness: which material a surface shows to which side.

use glam::Vec3;

/// Materials of a surface by side; indices into the scene's list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// One material that decides itself what its back looks like: diffuse and metal are black there.
    Single(u32),
    /// Seen from the front and from behind; each is lit and seen as if that side were its front.
    Two {
        /// The material seen from the side of the normal.
        front: u32,
        /// The material seen from the other side.
        back: u32,
    },
}

impl Sides {
    /// The material that is seen from `wo` where the shading normal is `n`, both in world space, and whether it is to be evaluated in a
    /// frame that is turned around: on the back of a two-sided surface.
    #[inline]
    pub fn seen_from(self, wo: Vec3, n: Vec3) -> (u32, bool) {
        match self {
            Sides::Single(material) => (material, false),
            Sides::Two { front, .. } if wo.dot(n) >= 0.0 => (front, false),
            Sides::Two { back, .. } => (back, true),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::math::frame::Frame;

    use super::*;

    #[test]
    fn the_back_is_a_front_turned_around() {
        let sides = Sides::Two { front: 3, back: 5 };
        assert_eq!(sides.seen_from(Vec3::Z, Vec3::Z), (3, false));
        assert_eq!(sides.seen_from(-Vec3::Z, Vec3::Z), (5, true));
        assert_eq!(Sides::Single(1).seen_from(-Vec3::Z, Vec3::Z), (1, false));
        let turned = Frame::new(Vec3::Z).turned();
        assert!(turned.to_local(-Vec3::Z).z > 0.0);
        assert!((turned.s.cross(turned.t).dot(turned.n) - 1.0).abs() < 1e-6);
    }
}
