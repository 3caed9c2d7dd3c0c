//! How a path crosses a boundary, and what else lies there: two media that touch, or a floor on which fog lies.
//!
//! A ray that goes on behind a surface begins where the rounding of that surface has no effect, and would miss whatever lies in the same place.
//! Faces that are equal are found when a scene is prepared, where one becomes the back of the other; others, as a wide floor
//! below a small box, are found here, one at each crossing.

use glam::Vec3;

use crate::math::float::safe_origin;
use crate::tracer::Scene;
use crate::tracer::accel::{Hit, PrimRange, Ray};
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::shape::SurfacePoint;

use super::{Media, MediumIndex};

impl Scene {
    /// Another surface which lies so near to that at `at` that a ray in the direction `d` would begin behind both.
    pub(super) fn beside(&self, at: &SurfaceInteraction, d: Vec3) -> Option<SurfaceInteraction> {
        let SurfacePoint { p, error, ng } = at.point;
        let [before, behind] = [-d, d].map(|d| safe_origin(p, error, ng, d));
        let across = Ray::between(before, behind, 1.0);
        let skip = PrimRange { first: at.hit.prim, end: at.hit.prim + 1 };
        let hit = self.accel().closest_except(&across, skip)?;
        let other = self.interaction(&across, &hit);
        Some(SurfaceInteraction { wo: -d, hit: Hit { t: at.hit.t, ..hit }, ..other })
    }
}

impl Media {
    /// The media before and behind the surface at `hit` of a path that goes straight on in the direction `d`; `None` for a surface that leaves
    /// the medium as it is.
    fn crossed(&self, hit: &SurfaceInteraction, d: Vec3) -> Option<[MediumIndex; 2]> {
        let [interior, exterior] = self.interface(hit.surface)?;
        Some(if d.dot(hit.point.ng) > 0.0 { [interior, exterior] } else { [exterior, interior] })
    }

    /// The medium behind the surfaces `at` and `beside`, which lie in one place, of a path that comes there through `medium` and goes straight
    /// on in the direction `d`. It crosses first the one that has this medium before it.
    pub(super) fn behind_both(
        &self,
        at: &SurfaceInteraction,
        beside: Option<&SurfaceInteraction>,
        d: Vec3,
        medium: MediumIndex,
    ) -> MediumIndex {
        let sides = [self.crossed(at, d), beside.and_then(|other| self.crossed(other, d))];
        match sides {
            [None, None] => medium,
            [Some([_, behind]), None] | [None, Some([_, behind])] => behind,
            [Some(first), Some(second)] => {
                let [first, second] =
                    if first[0] != medium && second[0] == medium { [second, first] } else { [first, second] };
                if second[0] == first[1] { second[1] } else { first[1] }
            }
        }
    }

    /// The medium before the surfaces `at` and `beside`, which lie in one place, seen in the direction `d`; `None` where neither names one.
    pub(super) fn before_both(
        &self,
        at: &SurfaceInteraction,
        beside: Option<&SurfaceInteraction>,
        d: Vec3,
    ) -> Option<MediumIndex> {
        match [self.crossed(at, d), beside.and_then(|other| self.crossed(other, d))] {
            [None, None] => None,
            [Some([before, _]), None] | [None, Some([before, _])] => Some(before),
            // The first of the two is the one that has the other behind it.
            [Some(one), Some(other)] => Some(if other[1] == one[0] { other[0] } else { one[0] }),
        }
    }
}

impl SurfaceInteraction {
    /// The point `p` of a ray that has this hit ahead, moved to before the surface where rounding has put it beyond or upon it. It is not moved
    /// out of the bound on all rounding errors: in a dense medium that is many free paths, and light would hardly come out.
    pub(super) fn keep_before(&self, p: Vec3) -> Vec3 {
        let n = self.facing_normal();
        let height = (p - self.point.p).dot(n);
        let least = p.abs().max_element() * (2.0 * f32::EPSILON);
        if height > least { p } else { p + n * (least - height) }
    }
}
