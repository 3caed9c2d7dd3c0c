//! Rendering space: world space with its origin near the shapes (pbrt-v4, §5.1.1), in a unit of their size.
//!
//! Paths are traced in single precision, which resolves a point to 6e-8 of its distance from the origin, and whose squares and
//! reciprocals of areas end at 1e38. A scene that lies far from the origin of its file is therefore moved there in double precision when it
//! is prepared, and every scene is scaled by a power of two until its shapes have sizes around 1. Cameras, point lights and the heights of bump maps go with it, and
//! what is reported in world space goes back. The power rounds nothing: a scene that is scaled by another one has the same picture, bit for
//! bit. The spaces of groups are chosen likewise.

use glam::{DAffine3, DVec3, Vec3};

/// A scene stays where it is unless its nearest point is farther from the origin than this many times its size: up to there
/// two bits of its coordinates are lost.
const FAR: f64 = 4.0;

/// Binary logarithm of the size over that of most others from which on a point or a shape has no part in the choice: it is one that the
/// tracer leaves out.
pub(super) const STRAY: i32 = 40;

/// The scale is from 2^−48 to 2^48, so that intensities, which go with its square, stay in single precision.
const LARGEST_EXPONENT: i32 = 48;

/// Where rendering space lies in world space, and its scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderingSpace {
    /// Its origin, in world space.
    pub origin: DVec3,
    /// What a length of 1 in world space is here: a power of two.
    pub scale: f64,
}

impl RenderingSpace {
    /// World space itself.
    pub const WORLD: Self = Self { origin: DVec3::ZERO, scale: 1.0 };

    /// A point of world space in this space.
    pub fn point(&self, p: DVec3) -> DVec3 {
        (p - self.origin) * self.scale
    }

    /// A length of world space in this space.
    pub fn length(&self, length: f32) -> f32 {
        (f64::from(length) * self.scale) as f32
    }

    /// A point of this space in world space.
    pub fn world_point(&self, p: Vec3) -> DVec3 {
        self.origin + p.as_dvec3() / self.scale
    }

    /// A length of this space in world space.
    pub fn world_length(&self, length: f32) -> f32 {
        (f64::from(length) / self.scale) as f32
    }

    /// A space for these boxes.
    pub(super) fn around(boxes: impl Iterator<Item = [DVec3; 2]> + Clone) -> Self {
        let size = |[low, high]: [DVec3; 2]| exponent((high - low).max_element());
        let sizes = boxes.clone().map(size);
        let Some(typical) = median(sizes) else { return Self::WORLD };
        let scale = 2f64.powi(-typical.clamp(-LARGEST_EXPONENT, LARGEST_EXPONENT));
        let origin =
            enclosing(boxes.filter(|b| size(*b) <= typical + STRAY)).map_or(DVec3::ZERO, |[low, high]| {
                let nearest = DVec3::ZERO.clamp(low, high);
                let is_far = nearest.abs().max_element() > FAR * (high - low).max_element();
                if is_far { 0.5 * (low + high) } else { DVec3::ZERO }
            });
        Self { origin, scale }
    }

    /// The transform from world space.
    pub(super) fn transform(&self) -> DAffine3 {
        DAffine3::from_scale(DVec3::splat(self.scale)) * DAffine3::from_translation(-self.origin)
    }

    /// The transform to world space.
    pub(super) fn inverse_transform(&self) -> DAffine3 {
        DAffine3 { translation: self.origin, ..DAffine3::from_scale(DVec3::splat(1.0 / self.scale)) }
    }
}

/// The exponent of a finite number; −1023 of 0.
pub(super) fn exponent(x: f64) -> i32 {
    ((x.to_bits() >> 52 & 0x7ff) as i32) - 1023
}

/// The median of exponents, without those of 0; `None` of none.
pub(super) fn median(exponents: impl Iterator<Item = i32>) -> Option<i32> {
    let mut counts = [0usize; 2048];
    exponents.filter(|e| *e > -1023).for_each(|e| counts[(e + 1023) as usize & 2047] += 1);
    let half = counts.iter().sum::<usize>().div_ceil(2);
    let mut below = 0;
    let at = counts.iter().position(|count| {
        below += count;
        below >= half && below > 0
    })?;
    Some(at as i32 - 1023)
}

/// The box around boxes; `None` around nothing.
pub(super) fn enclosing(boxes: impl Iterator<Item = [DVec3; 2]>) -> Option<[DVec3; 2]> {
    boxes.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
}
