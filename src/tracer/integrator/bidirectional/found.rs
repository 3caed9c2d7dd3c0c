//! What a path has found, while it is traced.

use crate::color::Xyz;
use crate::spectrum::{SampledSpectrum, SampledWavelengths};

/// What the ways of one path have found.
pub(super) struct Found {
    /// All wavelengths, and the hero only.
    pub(super) lambda: [SampledWavelengths; 2],
    /// Radiance by which of them it is right for.
    radiance: [SampledSpectrum; 2],
    /// Emission at the wavelengths of the path: light, value.
    pub(super) emission: Option<(u32, SampledSpectrum)>,
}

impl Found {
    pub(super) fn new(lambda: SampledWavelengths) -> Self {
        let mut hero = lambda;
        hero.terminate_companions();
        Self { lambda: [lambda, hero], radiance: [SampledSpectrum::ZERO; 2], emission: None }
    }

    #[inline]
    pub(super) fn add(&mut self, value: SampledSpectrum, hero_only: bool) {
        self.radiance[usize::from(hero_only)] += value;
    }

    /// Sum over the wavelengths of what was found.
    #[inline]
    pub(super) fn brightness(&self) -> f32 {
        (self.radiance[0] + self.radiance[1]).0.element_sum()
    }

    pub(super) fn xyz(&self) -> Xyz {
        let all = self.lambda[0].to_xyz(self.radiance[0]);
        if self.radiance[1].is_black() { all } else { all + self.lambda[1].to_xyz(self.radiance[1]) }
    }
}
