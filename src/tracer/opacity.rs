//! Surfaces that are not all there: a ray that meets one goes straight on with the probability 1 − opacity.
//!
//! A surface that is passed is no vertex of a path: it takes no random number of the path's, adds nothing to its length, and has no place in
//! densities. All strategies that find a path share the factor 1 − opacity of each surface on its segments, so that MIS weights that leave it
//! out still add up to 1. It comes in by chance where a ray looks for its first hit ([`Scene::closest`]), and as a product where a ray asks
//! whether two points see each other ([`Scene::visible`] and the like), which has less variance.
//!
//! Chance is a hash of the ray and of the hit, as in the stochastic alpha test of pbrt-v4 (Pharr, Jakob and Humphreys,
//! *Physically Based Rendering*, 4th ed., §7.1.1): the same ray meets the same surfaces, however often and wherever it is traced.
//!
//! A photon on such a surface counts for more, because the path that gathers it meets the surface by chance, too.
//!
//! A surface that emits does so in full, whatever its opacity, as in Mitsuba 3. So a camera path stops at such a surface to see it
//! ([`Scene::hit_or_emitter`]) before it goes on ([`Scene::passes`]).

use crate::math::bits::mix;
use crate::math::float::safe_origin;

use super::Scene;
use super::accel::{Hit, PrimRange, Ray};
use super::bsdf::SurfaceShare;
use super::interaction::SurfaceInteraction;
use super::shape::SurfacePoint;

/// Most surfaces that a ray passes; one more is met. It bounds the time of a ray between surfaces that lie in one place.
pub(super) const MOST_PASSED: usize = 4096;

/// The share of a surface that is there: a sum of the shares of its materials.
#[derive(Clone, Debug)]
pub(super) struct Opacity(Option<Vec<SurfaceShare>>);

impl Opacity {
    /// All of it.
    pub(super) const FULL: Self = Self(None);

    /// The sum of the shares of these materials; 0 without any.
    pub(super) fn sum_of(shares: Vec<SurfaceShare>) -> Self {
        Self(Some(shares))
    }

    /// True where none of the surface is there.
    fn is_none(&self) -> bool {
        self.0.as_ref().is_some_and(Vec::is_empty)
    }

    /// True where some of the surface may not be there.
    pub(super) fn has_holes(&self) -> bool {
        self.0.is_some()
    }
}

impl Scene {
    /// The first hit of `ray` that is at an emitter, seen from its front, or at something that the ray does not pass; `ray` then begins
    /// behind what it has passed. What camera paths ask for: [`Scene::passes`] tells whether it goes on from an emitter.
    #[inline(always)]
    pub(super) fn hit_or_emitter(&self, ray: &mut Ray) -> Option<Hit> {
        match self.opacities {
            None => self.primitives.accel.closest(ray),
            Some(_) => self.hit_seen(ray),
        }
    }

    #[cold]
    #[inline(never)]
    fn hit_seen(&self, ray: &mut Ray) -> Option<Hit> {
        Some(self.walk(ray, |ray, at, opacity| at.emitter().is_some() || meets(ray, at, opacity))?.hit)
    }

    /// True where `ray` passes the emitter that it has hit; it then begins behind it.
    #[inline(always)]
    pub(super) fn passes(&self, ray: &mut Ray, at: &SurfaceInteraction) -> bool {
        // A copy, so that the compiler keeps the hit in registers.
        self.has_holes() && self.passes_emitter(ray, *at)
    }

    #[cold]
    #[inline(never)]
    fn passes_emitter(&self, ray: &mut Ray, at: SurfaceInteraction) -> bool {
        let passes = at.emitter().is_some() && !meets(ray, &at, self.opacity(&at));
        if passes {
            *ray = past(ray, &at);
        }
        passes
    }

    /// The share of the surface at `at` that is there.
    #[inline]
    pub fn opacity(&self, at: &SurfaceInteraction) -> f32 {
        let Some(opacities) = &self.opacities else { return 1.0 };
        match opacities.get(at.surface as usize) {
            // Also a point in a medium, which has no surface.
            None | Some(Opacity(None)) => 1.0,
            Some(Opacity(Some(shares))) => {
                let texture = self.primitives.texture_point(at);
                shares.iter().map(|share| share.at(&texture)).sum()
            }
        }
    }

    /// True at a surface that nobody sees, as the boundary of a medium: all rays pass it, and it does not emit to where the ray came from.
    pub(super) fn is_unseen(&self, at: &SurfaceInteraction) -> bool {
        let opacity = self.opacities.as_ref().and_then(|opacities| opacities.get(at.surface as usize));
        opacity.is_some_and(Opacity::is_none) && at.emitter().is_none()
    }

    /// The hit of [`Scene::closest`] where some surfaces are not all there.
    #[cold]
    #[inline(never)]
    pub(super) fn hit_met(&self, ray: &mut Ray) -> Option<Hit> {
        Some(self.walk(ray, meets)?.hit)
    }

    /// The product of 1 − opacity of all that `ray` hits, the primitives of `skip` excepted, where some surfaces are not all there.
    #[cold]
    #[inline(never)]
    pub(super) fn passed_share(&self, ray: &Ray, skip: PrimRange) -> f32 {
        let mut share = 1.0;
        let end = self.walk(&mut ray.clone(), |_, at, opacity| {
            share *= if skip.contains(at.hit.prim) { 1.0 } else { (1.0 - opacity).max(0.0) };
            share == 0.0
        });
        if end.is_some() { 0.0 } else { share }
    }

    /// The first hit of `ray` at which `ends` says so, given the opacity there, or after [`MOST_PASSED`] others. `ray` then begins behind those.
    pub(super) fn walk(
        &self,
        ray: &mut Ray,
        mut ends: impl FnMut(&Ray, &SurfaceInteraction, f32) -> bool,
    ) -> Option<SurfaceInteraction> {
        let mut passed = 0;
        loop {
            let at = self.first(ray)?;
            if ends(ray, &at, self.opacity(&at)) || passed == MOST_PASSED {
                return Some(at);
            }
            passed += 1;
            *ray = past(ray, &at);
        }
    }
}

/// True where `ray` meets the surface at `at` rather than a hole.
pub(super) fn meets(ray: &Ray, at: &SurfaceInteraction, opacity: f32) -> bool {
    opacity >= 1.0 || chance(ray, at) < opacity
}

/// The rest of `ray` behind `at`.
pub(super) fn past(ray: &Ray, at: &SurfaceInteraction) -> Ray {
    let SurfacePoint { p, error, ng } = at.point;
    let (from, direction) = (safe_origin(p, error, ng, ray.direction), ray.direction);
    let gone = (from - ray.origin).dot(direction) / direction.length_squared();
    Ray { origin: from, direction, t_max: ray.t_max - gone }
}

/// A number in [0, 1) that depends on every bit of a ray and of the point that it hits.
fn chance(ray: &Ray, at: &SurfaceInteraction) -> f32 {
    let (o, d, p) = (ray.origin, ray.direction, at.point.p);
    let pairs = [[o.x, o.y], [o.z, d.x], [d.y, d.z], [p.x, p.y], [p.z, 0.0]];
    let hash = pairs
        .iter()
        .fold(0, |hash, [a, b]| mix(hash ^ (u64::from(a.to_bits()) << 32 | u64::from(b.to_bits()))));
    (hash >> 40) as f32 * (1.0 / (1u64 << 24) as f32)
}
