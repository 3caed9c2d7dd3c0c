//! Two-sidedness: which material a surface shows to which side.

use glam::Vec3;

use crate::math::frame::Frame;

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
    /// The material for something seen from `wo` (world space), and the frame it is to be evaluated in: turned
    /// around for the back of a two-sided surface.
    #[inline]
    pub fn facing(self, frame: Frame, wo: Vec3) -> (u32, Frame) {
        match self {
            Sides::Single(material) => (material, frame),
            Sides::Two { front, .. } if wo.dot(frame.n) >= 0.0 => (front, frame),
            // A turn by 180° about the s axis: stays right-handed.
            Sides::Two { back, .. } => (back, Frame { s: frame.s, t: -frame.t, n: -frame.n }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_back_is_a_front_turned_around() {
        let frame = Frame::new(Vec3::Z);
        let sides = Sides::Two { front: 3, back: 5 };
        assert_eq!(sides.facing(frame, Vec3::Z).0, 3);
        let (material, turned) = sides.facing(frame, -Vec3::Z);
        assert_eq!(material, 5);
        assert!(turned.to_local(-Vec3::Z).z > 0.0);
        assert!((turned.s.cross(turned.t).dot(turned.n) - 1.0).abs() < 1e-6);
        assert_eq!(Sides::Single(1).facing(frame, -Vec3::Z).1.n, Vec3::Z);
    }
}
