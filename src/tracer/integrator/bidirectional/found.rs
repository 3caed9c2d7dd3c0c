//! What a path has found, while it is traced.

use crate::spectrum::{SampledSpectrum, SampledWavelengths};

/// What the ways of one path have found.
pub(super) struct Found {
    /// The wavelengths of the path.
    pub(super) lambda: SampledWavelengths,
    /// Radiance at them.
    pub(super) radiance: SampledSpectrum,
    /// Emission at them: light, value.
    pub(super) emission: Option<(u32, SampledSpectrum)>,
}

impl Found {
    pub(super) fn new(lambda: SampledWavelengths) -> Self {
        Self { lambda, radiance: SampledSpectrum::ZERO, emission: None }
    }

    /// Sum over the wavelengths of what was found.
    #[inline]
    pub(super) fn brightness(&self) -> f32 {
        self.radiance.0.element_sum()
    }
}
