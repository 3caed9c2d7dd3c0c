//! Surfaces that are not all there: a ray that meets one goes straight on with the probability 1 − opacity.
//!
//! What is passed is no vertex of a path: it takes no random number of the path's, adds nothing to its length, and has no place in
//! densities. All strategies that find a path share the factor 1 − opacity of each surface on its segments, so that MIS weights that leave it
//! out still add up to 1. It comes in by chance where a ray looks for its first hit ([`Scene::closest`]), and as a product where a ray asks
//! whether two points see each other ([`Scene::visible`] and the like), which has less variance.
//!
//! Chance is a hash of the ray and of the hit, as in the stochastic alpha test of pbrt-v4 (Pharr, Jakob and Humphreys,
//! *Physically Based Rendering*, 4th ed., §7.1.1): the same ray meets the same surfaces, however often and wherever it is traced.
//!
//! A photon on such a surface counts for more, because the path that gathers it meets the surface by chance, too.
//!
//! What emits does so in full, however little of it is there, as in Mitsuba 3. So a camera path stops at such a surface to see it
//! ([`Scene::closest_or_emitter`]) before it goes on ([`Scene::beyond`]).

use crate::scene::texture::TexturePoint;

use crate::math::bits::mix;
use crate::math::float::safe_origin;

use super::Scene;
use super::accel::{Hit, PrimRange, Ray};
use super::bsdf::SurfaceShare;
use super::interaction::SurfaceInteraction;
use super::shape::SurfacePoint;

/// Most surfaces that a ray passes; one more is met. It bounds the time of a ray between surfaces that lie in one place.
const MOST_PASSED: usize = 4096;

/// The share of a surface that is there: a sum of the shares of its materials.
#[derive(Clone, Debug)]
pub(super) struct Opacity(Option<Vec<SurfaceShare>>);

impl Opacity {
    /// All of it.
    pub(super) const FULL: Self = Self(None);

    /// What these materials have together; nothing, if there are none.
    pub(super) fn sum_of(shares: Vec<SurfaceShare>) -> Self {
        Self(Some(shares))
    }

    /// True where some of the surface may not be there.
    pub(super) fn has_holes(&self) -> bool {
        self.0.is_some()
    }

    fn at(&self, at: TexturePoint) -> f32 {
        self.0.as_ref().map_or(1.0, |shares| shares.iter().map(|share| share.at(at)).sum())
    }
}

impl Scene {
    /// The first hit of `ray` that is at an emitter, seen from its front, or at something that the ray does not pass. What camera paths
    /// ask for: [`Scene::beyond`] tells whether it goes on from an emitter.
    #[inline(always)]
    pub fn closest_or_emitter(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        match self.opacities {
            None => self.first(ray),
            Some(_) => self.closest_seen(ray),
        }
    }

    #[cold]
    #[inline(never)]
    fn closest_seen(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        self.walk(*ray, |ray, _, at, opacity| at.emitter().is_some() || meets(ray, at, opacity))
    }

    /// The ray that goes on behind the emitter that `ray` has hit, if it passes it.
    #[inline(always)]
    pub fn beyond(&self, ray: &Ray, at: &SurfaceInteraction) -> Option<Ray> {
        let passes = self.opacities.is_some() && at.emitter().is_some() && !meets(ray, at, self.opacity(at));
        passes.then(|| past(ray, at))
    }

    /// The share of the surface at `at` that is there.
    #[inline]
    pub fn opacity(&self, at: &SurfaceInteraction) -> f32 {
        self.opacities.as_ref().map_or(1.0, |opacities| opacities[at.surface as usize].at(at.texture))
    }

    /// As [`Scene::closest`] where some surfaces are not all there.
    #[cold]
    #[inline(never)]
    pub(super) fn closest_met(&self, ray: &Ray) -> Option<SurfaceInteraction> {
        self.walk(*ray, |ray, _, at, opacity| meets(ray, at, opacity))
    }

    /// The product of 1 − opacity of all that `ray` hits, the primitives of `skip` excepted, where some surfaces are not all there.
    #[cold]
    #[inline(never)]
    pub(super) fn passed_share(&self, ray: &Ray, skip: PrimRange) -> f32 {
        let mut share = 1.0;
        let end = self.walk(*ray, |_, hit, _, opacity| {
            share *= if skip.contains(hit.prim) { 1.0 } else { (1.0 - opacity).max(0.0) };
            share == 0.0
        });
        if end.is_some() { 0.0 } else { share }
    }

    /// The first hit of `ray` at which `ends` says so, given the opacity there, or after [`MOST_PASSED`] others.
    pub(super) fn walk(
        &self,
        mut ray: Ray,
        mut ends: impl FnMut(&Ray, &Hit, &SurfaceInteraction, f32) -> bool,
    ) -> Option<SurfaceInteraction> {
        let mut passed = 0;
        loop {
            let hit = self.primitives.accel.closest(&ray)?;
            let at = self.primitives.interaction(&ray, &hit);
            if ends(&ray, &hit, &at, self.opacity(&at)) || passed == MOST_PASSED {
                return Some(at);
            }
            passed += 1;
            ray = past(&ray, &at);
        }
    }
}

/// True where `ray` meets the surface at `at` rather than a hole.
fn meets(ray: &Ray, at: &SurfaceInteraction, opacity: f32) -> bool {
    opacity >= 1.0 || chance(ray, at) < opacity
}

/// What is left of `ray` behind `at`.
fn past(ray: &Ray, at: &SurfaceInteraction) -> Ray {
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
