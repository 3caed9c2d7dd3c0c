//! A medium whose coefficients are the same everywhere: distances and transmittances have a closed form.

use glam::Vec4;

use crate::scene::desc::MediumDesc;
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::{SampledWavelengths, Spectrum};

use super::Coefficients;

/// The spectra of its coefficients.
#[derive(Clone, Debug)]
pub(super) struct HomogeneousMedium {
    /// σₜ over `scale`.
    extinction: Spectrum,
    /// Factor on it, which includes the unit of length of rendering space.
    scale: f32,
    albedo: Spectrum,
    /// Nothing is scattered at any wavelength.
    only_absorbs: bool,
}

impl HomogeneousMedium {
    /// `None` for a medium that varies in space.
    pub(super) fn new(desc: &MediumDesc) -> Option<Self> {
        if !desc.is_homogeneous() {
            return None;
        }
        let (SpectrumTexture::Uniform(extinction), SpectrumTexture::Uniform(albedo)) =
            (&desc.sigma_t, &desc.albedo)
        else {
            return None;
        };
        let only_absorbs = albedo.is_black();
        let (extinction, albedo) = (extinction.clone(), albedo.clone());
        Some(Self { extinction, scale: desc.scale as f32, albedo, only_absorbs })
    }

    /// True for a medium in which paths have no vertices.
    #[inline]
    pub(super) fn only_absorbs(&self) -> bool {
        self.only_absorbs
    }

    /// An upper bound of σₜ over all wavelengths.
    pub(super) fn largest_extinction(&self) -> f32 {
        self.extinction.max() * self.scale
    }

    /// The coefficients at the wavelengths of a path, along which particles have this projected area: finite, not negative, and no more
    /// scattered than met.
    #[inline]
    pub(super) fn at(&self, lambda: &SampledWavelengths, area: f32) -> Coefficients {
        let extinction = self.extinction.sample(lambda).0 * (self.scale * area);
        Coefficients {
            extinction: extinction.clamp(Vec4::ZERO, Vec4::splat(f32::MAX)),
            albedo: self.albedo.sample(lambda).0.clamp(Vec4::ZERO, Vec4::ONE),
        }
    }
}
