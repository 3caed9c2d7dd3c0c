//! Detection of light that is still being found.
//!
//! The difference of the replicates reflects only light that samples have found. In a picture where few paths find much of the light it is
//! too small, and cannot show this by itself. Two indicators can:
//!
//! - **Witnesses**, a few paths of other methods ([`witness`](crate::study::witness)). Light that they find and the picture lacks is part
//!   of the stated error.
//! - [`LargestShares`]: if one sample carries a noticeable fraction of a region's light, others like it are still to come. This causes a
//!   warning, unless witnesses have found as much light as one of them carries.

use serde::Serialize;

use crate::study::format::percent;
use crate::study::largest::LargestShares;

/// Fraction of the picture from which on light of single samples matters, since the stated errors leave out 5 %.
const WIDE: f64 = 0.05;

/// Fraction of the light from which on missing light is reported.
const WORTH_TELLING: f64 = 0.005;

/// Indicators of light that has not been found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LateLight {
    /// Fractions of the light carried by single samples.
    pub largest: LargestShares,
    /// Fraction of the light found by witnesses and missing from the picture; `None` without witnesses.
    pub missing: Option<f64>,
    /// Caustics part of `missing`.
    pub caustics: f64,
    /// Highlights part of `missing`: small lamps in mirrors and glass.
    pub highlights: f64,
}

/// A kind of light that is missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MissingLight {
    /// Light that reaches a diffuse surface only via mirrors and glass.
    Caustics,
    /// Lamps that the camera sees only via mirrors and glass.
    Highlights,
    /// Any other light.
    Other,
}

impl LateLight {
    /// Description of missing light that the stated error includes; `None` if it is negligible.
    pub fn unfound(&self) -> Option<String> {
        let missing = self.missing.filter(|missing| *missing > WORTH_TELLING)?;
        let what = match self.kind()? {
            MissingLight::Caustics => "caustics, which photons show",
            MissingLight::Highlights => "small lamps in mirrors and glass, which paths meet by chance",
            MissingLight::Other => "which paths from both ends find",
        };
        Some(format!("not yet found: {} of the light, {what}; the stated error counts it", percent(missing)))
    }

    /// The largest kind of missing light; `None` if none is known to be missing.
    pub fn kind(&self) -> Option<MissingLight> {
        let missing = self.missing.filter(|missing| *missing > 0.0)?;
        Some(match self {
            _ if self.caustics > 0.5 * missing => MissingLight::Caustics,
            _ if self.highlights > 0.5 * missing => MissingLight::Highlights,
            _ => MissingLight::Other,
        })
    }

    /// Fraction of the light that is missing and of this kind; `None` without witnesses.
    pub fn share(&self, kind: MissingLight) -> Option<f64> {
        let missing = self.missing?;
        Some(match kind {
            MissingLight::Caustics => self.caustics,
            MissingLight::Highlights => self.highlights,
            MissingLight::Other => missing - self.caustics - self.highlights,
        })
    }

    /// Why the stated error is unreliable; `None` if there is no indication.
    pub fn warning(&self) -> Option<String> {
        let is_told = self.missing.is_some_and(|missing| missing >= self.largest.one);
        let is_large = self.largest.large_in > WIDE && !is_told;
        is_large.then(|| {
            let one = percent(self.largest.one);
            format!(
                "light is still being found, the error is larger than stated: one sample carries {one} of it"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn warnings_name_their_reason() {
        let mut late = LateLight::default();
        assert_eq!(late.warning(), None);
        late.largest = LargestShares { one: 0.2, one_per_tile: 0.3, large_in: 0.04 };
        assert_eq!(late.warning(), None);
        late.largest.large_in = 0.5;
        assert!(
            late.warning()
                .is_some_and(|text| text.ends_with(&format!("one sample carries {} of it", percent(0.2))))
        );
        // Light found by witnesses is included in the stated error, so no warning is needed.
        (late.missing, late.caustics) = (Some(0.01), 0.0);
        assert!(late.warning().is_some());
        (late.missing, late.caustics) = (Some(0.24), 0.23);
        assert_eq!(late.warning(), None);
        assert!(
            late.unfound().is_some_and(|text| text.contains(&percent(0.24)) && text.contains("caustics"))
        );
    }
}
