//! From photons found to a density: the area that they stand for, and which of them count.

use std::f32::consts::PI;

use super::query::Near;

/// The disc that photons were found in.
///
/// Radiance is `Σ f · flux / (area · light paths)` over [`Disc::counted`].
///
/// **All within the radius** (fewer than `wanted` were found): all count, the area is π r², and the estimate is
/// unbiased where the density is even.
/// **The k nearest** (`wanted` = k were found): the radius is that of the k-th photon, which was chosen for being
/// there. Counting it would be too bright by k/(k − 1) for good: for Poisson points of density ρ, π ρ r_k² is
/// gamma-distributed with shape k, so E[1/(π r_k²)] = ρ/(k − 1). So k − 1 photons count, and the k-th only gives
/// the radius.
#[derive(Clone, Copy, Debug)]
pub struct Disc<'a> {
    counted: &'a [Near],
    area: f32,
}

impl<'a> Disc<'a> {
    /// The disc of what [`Forest::nearest`](super::Forest::nearest) found, asked for `wanted` ≥ 2 photons within `radius`.
    ///
    /// The radius is never taken below `floor` (m): coincident photons, as those of a caustic's focus or of a beam, have
    /// a finite density. `None` when nothing was found.
    pub fn new(found: &'a [Near], wanted: usize, radius: f32, floor: f32) -> Option<Self> {
        let farthest = found.first()?;
        let (counted, r2) = if found.len() < wanted || wanted < 2 {
            (found, radius * radius)
        } else {
            (&found[1..], farthest.distance2)
        };
        // Divided in this order, neither overflows nor becomes 0 before it has to.
        let area = (PI * r2.max(floor * floor)).clamp(f32::MIN_POSITIVE, f32::MAX);
        Some(Self { counted, area })
    }

    /// The photons that count.
    #[inline]
    pub fn counted(&self) -> &'a [Near] {
        self.counted
    }

    /// Area, m².
    #[inline]
    pub fn area(&self) -> f32 {
        self.area
    }
}
