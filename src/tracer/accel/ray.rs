//! Rays, hits, and ranges of what they hit.

use glam::Vec3;

/// A ray: the points `origin + t · direction`, `0 < t < t_max`. The direction need not have unit length.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Start, world space.
    pub origin: Vec3,
    /// Direction, world space.
    pub direction: Vec3,
    /// End, in units of `direction`; may be infinite.
    pub t_max: f32,
}

/// Directions that are shorter are stretched: the traversal takes those below 5e-12 for none, and instances may shrink them.
const SHORT: f32 = 1e-4;

/// By a power of two, so that nothing is rounded.
const STRETCH: f32 = (1u64 << 63) as f32;

impl Ray {
    /// A ray of infinite length.
    #[inline]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, direction, t_max: f32::INFINITY }
    }

    /// A ray from `origin` to the share `t_max` of the way to `target`; its direction has any length.
    #[inline]
    pub fn between(origin: Vec3, target: Vec3, t_max: f32) -> Self {
        let direction = target - origin;
        match direction.abs().max_element() < SHORT {
            false => Self { origin, direction, t_max },
            true => Self { origin, direction: direction * STRETCH, t_max: t_max / STRETCH },
        }
    }
}

/// A range of primitive ids.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PrimRange {
    /// First id.
    pub first: u32,
    /// One past the last id.
    pub end: u32,
}

impl PrimRange {
    /// No primitive.
    pub const NONE: PrimRange = PrimRange { first: 0, end: 0 };

    /// True if `id` is in the range.
    #[inline]
    pub fn contains(self, id: u32) -> bool {
        id >= self.first && id < self.end
    }
}

/// The closest intersection of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter.
    pub t: f32,
    /// Primitive id.
    pub prim: u32,
    /// Barycentric weights of the second and third vertex (outside [0, 1] for the second half of a parallelogram);
    /// zero for all others.
    pub uv: [f32; 2],
    /// Index of the instance through which the primitive was hit, or [`Hit::DIRECT`].
    pub instance: u32,
}

/// What a ray has hit: the primitive and the instance.
pub type HitId = (u32, u32);

impl Hit {
    /// The primitive is in world space, in no instance.
    pub const DIRECT: u32 = u32::MAX;

    /// What was hit, wherever.
    pub fn id(&self) -> HitId {
        (self.prim, self.instance)
    }

    /// Replaces this hit by `other` if that is closer. At the same distance the lower id (then the lower instance) wins.
    #[inline(always)]
    pub(super) fn improve(&mut self, other: Hit) {
        let ties = other.t == self.t && (other.prim, other.instance) < (self.prim, self.instance);
        if other.t < self.t || ties {
            *self = other;
        }
    }
}
