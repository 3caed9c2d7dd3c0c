//! How a path crosses a boundary, and what else lies there: media that touch, a floor on which fog lies, glass or a lamp with holes upon a
//! boundary.
//!
//! A ray that goes on behind a surface begins where the rounding of that surface has no effect, and would miss whatever lies in the same place.
//! All of that is found here, at each crossing. Of two faces that are equal and back to back, one has become the back of the other when the scene was
//! prepared; a boundary hides no such face. What lies in the place of a lamp with holes that a path passes is not met, in scenes without media either.

use glam::Vec3;

use crate::math::float::safe_origin;
use crate::tracer::Scene;
use crate::tracer::accel::{Hit, Ray};
use crate::tracer::interaction::SurfaceInteraction;
use crate::tracer::opacity::MOST_PASSED;
use crate::tracer::shape::SurfacePoint;

use super::{Media, MediumIndex, MediumSides, PathMedia};

/// How a ray crosses a boundary.
#[derive(Clone, Copy, Debug)]
struct Transition {
    before: MediumIndex,
    behind: MediumIndex,
    /// It comes out of what the boundary encloses.
    leaves: bool,
}

/// The medium before all of these boundaries, which lie in one place: that of which more of them lead away than towards it. `None` without any.
fn before(all: &[Transition]) -> Option<MediumIndex> {
    let count =
        |side: fn(&Transition) -> MediumIndex, medium| all.iter().filter(|t| side(t) == medium).count();
    let surplus = |medium| count(|t| t.before, medium) > count(|t| t.behind, medium);
    // Where the medium behind is the same, shapes have a thickness: a ray leaves one before it enters the next.
    let first = all.iter().find(|t| surplus(t.before)).or_else(|| all.iter().find(|t| t.leaves));
    first.or(all.first()).map(|t| t.before)
}

/// The medium behind all of these boundaries of a ray that comes there through `medium`: it always crosses one that has before it the medium that
/// the ray is in.
fn behind(mut all: Vec<Transition>, mut medium: MediumIndex) -> MediumIndex {
    if all.iter().all(|t| t.before != medium) {
        medium = before(&all).unwrap_or(medium);
    }
    while let Some(next) = all.iter().position(|t| t.before == medium) {
        medium = all.remove(next).behind;
    }
    medium
}

impl Media {
    /// How a ray in the direction `d` crosses the boundary at `at`; `None` for a surface that leaves the medium as it is.
    fn transition(&self, at: &SurfaceInteraction, d: Vec3) -> Option<Transition> {
        let [interior, exterior] = self.interface(at.surface)?;
        let leaves = d.dot(at.point.ng) > 0.0;
        let (before, behind) = if leaves { (interior, exterior) } else { (exterior, interior) };
        Some(Transition { before, behind, leaves })
    }

    fn transitions(
        &self,
        at: &SurfaceInteraction,
        beside: &[SurfaceInteraction],
        d: Vec3,
    ) -> Vec<Transition> {
        [at].into_iter().chain(beside).filter_map(|at| self.transition(at, d)).collect()
    }

    /// The medium behind the surfaces `at` and `beside`, which lie in one place, of a path that comes there through `medium` and goes straight
    /// on in the direction `d`.
    pub(super) fn behind_all(
        &self,
        at: &SurfaceInteraction,
        beside: &[SurfaceInteraction],
        d: Vec3,
        medium: MediumIndex,
    ) -> MediumIndex {
        match beside {
            [] => self.transition(at, d).map_or(medium, |t| t.behind),
            _ => behind(self.transitions(at, beside, d), medium),
        }
    }

    /// The medium before the surfaces `at` and `beside`, which lie in one place, seen in the direction `d`; `None` where none names one.
    pub(super) fn before_all(
        &self,
        at: &SurfaceInteraction,
        beside: &[SurfaceInteraction],
        d: Vec3,
    ) -> Option<MediumIndex> {
        match beside {
            [] => self.transition(at, d).map(|t| t.before),
            _ => before(&self.transitions(at, beside, d)),
        }
    }
}

impl Scene {
    /// The other surfaces which lie so near to that at `at` that a ray in the direction `d` would begin behind all of them.
    pub(super) fn beside(&self, media: &Media, at: &SurfaceInteraction, d: Vec3) -> Vec<SurfaceInteraction> {
        let SurfacePoint { p, error, ng } = at.point;
        let [before, behind] = [-d, d].map(|d| safe_origin(p, error, ng, d));
        // With the point at which that ray begins.
        let across = Ray::between(before, behind, 1.0 + f32::EPSILON);
        let mut others: Vec<_> = self.other_side(media, at).into_iter().collect();
        let mut next = self.accel().closest_except(&across, &[at.hit.id()]);
        if next.is_none() {
            return others;
        }
        let mut known = vec![at.hit.id()];
        while let Some(hit) = next.filter(|_| known.len() <= MOST_PASSED) {
            let other = self.interaction(&across, &hit);
            // Whoever asks from there finds the surface at `at`.
            let point = SurfacePoint { error: other.point.error.max(error), ..other.point };
            let other = SurfaceInteraction { point, wo: -d, hit: Hit { t: at.hit.t, ..hit }, ..other };
            others.push(other);
            others.extend(self.other_side(media, &other));
            known.push(hit.id());
            next = self.accel().closest_except(&across, &known);
        }
        others
    }

    /// The surface on the other side of the primitive at `at`, where one of both is a boundary. Of other pairs back to back only the side that is
    /// seen counts, as in a scene without media.
    fn other_side(&self, media: &Media, at: &SurfaceInteraction) -> Option<SurfaceInteraction> {
        let other = self.primitives.other_side(at)?;
        let is_boundary = |at: &SurfaceInteraction| media.interface(at.surface).is_some();
        (is_boundary(at) || is_boundary(&other)).then_some(other)
    }

    /// The medium behind all that lies at `at`, of a path that comes there through `medium` and goes straight on in the direction `d`.
    pub(in crate::tracer) fn medium_behind(
        &self,
        media: &Media,
        at: &SurfaceInteraction,
        d: Vec3,
        medium: MediumIndex,
    ) -> MediumIndex {
        media.behind_all(at, &self.beside(media, at, d), d, medium)
    }

    /// The medium into which a path that comes to the transmitting surface at `hit` through `medium` leaves it in the direction `d`.
    pub(in crate::tracer) fn medium_towards(
        &self,
        hit: &SurfaceInteraction,
        d: Vec3,
        medium: MediumIndex,
    ) -> MediumIndex {
        let sides = self.media_at(hit, medium);
        sides.map_or(medium, |sides| MediumSides(sides).towards(hit.point.ng, d))
    }

    /// The media behind and in front of the surface at `hit`, to which a path came through `medium`; `None` for one that has the same on both
    /// sides. Where light goes through the surface, boundaries in the same place count.
    pub(in crate::tracer) fn media_at(
        &self,
        hit: &SurfaceInteraction,
        medium: MediumIndex,
    ) -> Option<[MediumIndex; 2]> {
        let media = self.media()?;
        if !media.may_touch_boundary(hit.surface) {
            return media.interface(hit.surface);
        }
        let d = -hit.wo;
        let beside = self.beside(media, hit, d);
        if beside.is_empty() {
            return media.interface(hit.surface);
        }
        let behind = media.behind_all(hit, &beside, d, medium);
        Some(if d.dot(hit.point.ng) > 0.0 { [medium, behind] } else { [behind, medium] })
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

#[cfg(test)]
mod tests {
    use super::*;

    const VACUUM: MediumIndex = MediumIndex::VACUUM;

    fn enters(exterior: MediumIndex, interior: MediumIndex) -> Transition {
        Transition { before: exterior, behind: interior, leaves: false }
    }

    fn leaves(interior: MediumIndex, exterior: MediumIndex) -> Transition {
        Transition { before: interior, behind: exterior, leaves: true }
    }

    /// All orders of a list.
    fn orders(all: &[Transition]) -> Vec<Vec<Transition>> {
        if all.is_empty() {
            return vec![Vec::new()];
        }
        let each = (0..all.len()).flat_map(|i| {
            let mut rest = all.to_vec();
            let first = rest.remove(i);
            orders(&rest).into_iter().map(move |rest| [vec![first], rest].concat())
        });
        each.collect()
    }

    #[test]
    fn boundaries_in_one_place_are_crossed_in_the_order_of_their_media() {
        let [a, b, c] = [0, 1, 2].map(MediumIndex);
        for (all, first, last) in [
            (vec![], None, b),
            (vec![enters(VACUUM, a)], Some(VACUUM), a),
            // Two media that touch; the same one twice.
            (vec![leaves(a, VACUUM), enters(VACUUM, b)], Some(a), b),
            (vec![leaves(a, VACUUM), enters(VACUUM, a)], Some(a), a),
            // A box within another stands on a third.
            (vec![leaves(a, VACUUM), enters(VACUUM, b), enters(b, c)], Some(a), c),
            (vec![leaves(c, b), leaves(b, VACUUM), enters(VACUUM, a), enters(a, b)], Some(c), b),
            // The same boundary several times.
            (vec![enters(VACUUM, a), enters(VACUUM, a), enters(VACUUM, a)], Some(VACUUM), a),
        ] {
            for order in orders(&all) {
                assert_eq!(before(&order), first, "{order:?}");
                let medium = first.unwrap_or(last);
                assert_eq!(behind(order.clone(), medium), last, "{order:?}");
                // A path that has lost its medium to rounding finds it again.
                let lost = MediumIndex(9);
                assert_eq!(behind(order, lost), first.map_or(lost, |_| last), "{all:?}");
            }
        }
    }
}
