//! Rendering space: world space with its origin near the shapes (pbrt-v4, §5.1.1), in a unit of their size.
//!
//! Paths are traced in single precision, which resolves a point to 6e-8 of its distance from the origin and overflows above 1e38, a limit
//! that squares and reciprocals of areas can reach. When a scene is prepared, it is therefore moved to the origin in double precision if it lies
//! far from it, and scaled by a power of two so that its shapes have sizes around 1. Cameras, point lights and the heights of bump maps are
//! moved and scaled with it; what is reported in world space is transformed back. Scaling by a power of two rounds nothing, so the choice of
//! the power does not change a bit of the picture. The spaces of groups are chosen likewise.

use glam::{DAffine3, DVec3, Vec3};

/// A scene stays where it is unless its nearest point is farther from the origin than this many times its size: up to there
/// two bits of its coordinates are lost.
const FAR: f64 = 4.0;

/// Points and shapes larger than the median by this power of two have no influence on the choice of the space: the tracer leaves them
/// out.
pub(super) const STRAY: i32 = 40;

/// The scale is from 2^−48 to 2^48, so that intensities, which go with its square, stay in single precision.
const LARGEST_EXPONENT: i32 = 48;

/// Where rendering space lies in world space, and its scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderingSpace {
    /// Its origin, in world space.
    pub origin: DVec3,
    /// Length in rendering space of a unit of world space: a power of two.
    pub scale: f64,
}

impl RenderingSpace {
    /// World space.
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

    /// The space chosen for shapes with these bounding boxes.
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

/// Binary exponent of a finite number; −1023 for 0.
pub(super) fn exponent(x: f64) -> i32 {
    ((x.to_bits() >> 52 & 0x7ff) as i32) - 1023
}

/// Median of exponents, except those of 0; `None` if there are none.
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

/// Bounding box of boxes; `None` if there are none.
pub(super) fn enclosing(boxes: impl Iterator<Item = [DVec3; 2]>) -> Option<[DVec3; 2]> {
    boxes.reduce(|[low, high], [a, b]| [low.min(a), high.max(b)])
}
