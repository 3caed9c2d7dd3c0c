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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn area_and_solid_angle_agree_on_a_small_patch() {
        // A patch of area 1e-6 at distance 2, inclined by 60°, covers 1e-6 · 0.5 / 4 sr.
        let w = PdfA(1e6).to_solid_angle(4.0, -0.5);
        assert!((w.0 * 1e-6 * 0.5 / 4.0 - 1.0).abs() < 1e-6);
        assert_eq!(PdfA(1.0).to_solid_angle(1.0, 0.0), PdfW::ZERO);
    }
}
