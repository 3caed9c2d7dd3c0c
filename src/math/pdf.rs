//! Probability densities that carry their measure in their type.

/// A density per steradian of direction.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct PdfW(pub f32);

/// A density per unit of area.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct PdfA(pub f32);

impl PdfW {
    /// The density of directions that are never sampled.
    pub const ZERO: PdfW = PdfW(0.0);
}

impl PdfA {
    /// Converts to solid angle at a point with squared distance `distance2`, where `cos` (of either sign) is the cosine at the
    /// surface: `pdf_A · r² / |cos|`. Zero if the surface is seen edge-on.
    #[inline]
    pub fn to_solid_angle(self, distance2: f32, cos: f32) -> PdfW {
        let cos = cos.abs();
        if cos > 0.0 { PdfW(self.0 * distance2 / cos) } else { PdfW::ZERO }
    }
}
