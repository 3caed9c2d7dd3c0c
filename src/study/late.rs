//! Light that is still being found.
//!
//! The difference of the replicates knows only what samples have met. In a picture where few paths find much of the light it is too small, and
//! by itself it cannot tell. Two things can:
//!
//! - **Witnesses**, a few paths of other methods ([`witness`](crate::study::witness)). What they find and the picture lacks is a part of the
//!   stated error.
//! - [`LargestShares`]: where one sample carries a noticeable part of the light of a region, others like it are yet to come. That warns, unless
//!   witnesses have told of as much light as one of them carries.

use serde::Serialize;

use crate::study::format::percent;
use crate::study::largest::LargestShares;

/// Share of the picture on which the light of single samples counts, as the errors that are stated leave out 5 %.
const WIDE: f64 = 0.05;

/// Share of the light from which it is worth telling that the picture lacks it.
const WORTH_TELLING: f64 = 0.005;

/// What is known of light that has not been found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct LateLight {
    /// How much of the light single samples carry.
    pub largest: LargestShares,
    /// Share of the light that witnesses have found and the picture lacks; `None` without witnesses.
    pub missing: Option<f64>,
    /// The part of it that is caustics.
    pub caustics: f64,
    /// The part of it that is highlights: small lamps in mirrors and glass.
    pub highlights: f64,
}

/// A kind of light that is missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MissingLight {
    /// Light that arrives over mirrors and glass alone where it is spread.
    Caustics,
    /// Lamps that the camera sees over mirrors and glass alone.
    Highlights,
    /// Any other.
    Other,
}

impl LateLight {
    /// What the picture lacks and its stated error counts; `None` where that is not worth telling.
    pub fn unfound(&self) -> Option<String> {
        let missing = self.missing.filter(|missing| *missing > WORTH_TELLING)?;
        let what = match self.kind()? {
            MissingLight::Caustics => "caustics, which photons show",
            MissingLight::Highlights => "small lamps in mirrors and glass, which paths meet by chance",
            MissingLight::Other => "which paths from both ends find",
        };
        Some(format!("not yet found: {} of the light, {what}; the stated error counts it", percent(missing)))
    }

    /// What most of the light is that is missing; `None` where none is known to be.
    pub fn kind(&self) -> Option<MissingLight> {
        let missing = self.missing.filter(|missing| *missing > 0.0)?;
        Some(match self {
            _ if self.caustics > 0.5 * missing => MissingLight::Caustics,
            _ if self.highlights > 0.5 * missing => MissingLight::Highlights,
            _ => MissingLight::Other,
        })
    }

    /// The share of the light that is of this kind and missing; `None` without witnesses.
    pub fn share(&self, kind: MissingLight) -> Option<f64> {
        let missing = self.missing?;
        Some(match kind {
            MissingLight::Caustics => self.caustics,
            MissingLight::Highlights => self.highlights,
            MissingLight::Other => missing - self.caustics - self.highlights,
        })
    }

    /// Why the stated error cannot be trusted; `None` if nothing speaks against it.
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
        // What witnesses have told is stated, so that there is nothing to warn of.
        (late.missing, late.caustics) = (Some(0.01), 0.0);
        assert!(late.warning().is_some());
        (late.missing, late.caustics) = (Some(0.24), 0.23);
        assert_eq!(late.warning(), None);
        assert!(
            late.unfound().is_some_and(|text| text.contains(&percent(0.24)) && text.contains("caustics"))
        );
    }
}
