//! Participating media: fog, smoke, milk, and how they scatter.

use std::sync::Arc;

use super::ids::MediumId;
use super::phase::PhaseDesc;
use super::rendering_space::RenderingSpace;
use super::texture::SpectrumTexture;
use super::volume::VolumeTexture;
use crate::spectrum::Spectrum;

/// A participating medium, Mitsuba's `homogeneous` or `heterogeneous`: it absorbs and scatters light between surfaces.
#[derive(Clone, Debug)]
pub struct MediumDesc {
    /// Extinction coefficient σₜ per unit of length of world space, before [`MediumDesc::scale`]: the same everywhere, or a grid.
    pub sigma_t: SpectrumTexture,
    /// Single-scattering albedo σₛ / σₜ in [0, 1]: the same everywhere, or a grid.
    pub albedo: SpectrumTexture,
    /// Factor on σₜ.
    pub scale: f64,
    /// The distribution of directions into which it scatters.
    pub phase: PhaseDesc,
    /// The light that it emits, if any.
    pub emission: Option<MediumEmission>,
}

/// The emission of a medium: the radiance Lₑ of a layer that is opaque and scatters nothing, pbrt-v4's `Le`. What is emitted per unit of length is
/// σₐ Lₑ, in all directions alike. Mitsuba's media do not shine.
#[derive(Clone, Debug)]
pub struct MediumEmission {
    /// The radiance in W m⁻² sr⁻¹ nm⁻¹, or the factor on `grid`.
    pub radiance: Spectrum,
    /// A grid of colours under D65.
    pub grid: Option<Arc<VolumeTexture>>,
}

impl MediumEmission {
    /// True where there is no light.
    pub fn is_black(&self) -> bool {
        self.radiance.is_black() || self.grid.as_ref().is_some_and(|grid| grid.mean() == [0.0; 3])
    }

    /// Replaces a grid by its mean.
    pub fn make_uniform(&mut self) {
        if let Some(grid) = self.grid.take() {
            let factor = self.radiance.max();
            self.radiance = Spectrum::emission_rgb(grid.mean().map(|v| v * factor));
        }
    }

    /// Light of D65 as bright as the colours are.
    pub fn make_grey(&mut self) {
        match &mut self.grid {
            Some(grid) => *grid = Arc::new(grid.grey()),
            None => self.radiance = Spectrum::d65(self.radiance.luminance()),
        }
    }
}

impl MediumDesc {
    /// The largest coefficient that is the same everywhere, and the largest factor: the product stays in single precision in every rendering
    /// space.
    pub const LARGEST: f64 = 1e12;

    /// True where neither a coefficient nor the phase function nor the emission varies in space: Mitsuba's `homogeneous`.
    pub fn is_homogeneous(&self) -> bool {
        let uniform = |texture: &SpectrumTexture| matches!(texture, SpectrumTexture::Uniform(_));
        let varies = self.phase.varies() || self.emission.as_ref().is_some_and(|light| light.grid.is_some());
        uniform(&self.sigma_t) && uniform(&self.albedo) && !varies
    }

    /// True where it emits light.
    pub fn shines(&self) -> bool {
        self.emission.as_ref().is_some_and(|light| !light.is_black())
    }

    /// Mitsuba's name of the plugin.
    pub fn plugin(&self) -> &'static str {
        if self.is_homogeneous() { "homogeneous" } else { "heterogeneous" }
    }

    /// Moves it from world space to `space`: σₜ is per unit of length, and grids lie in space.
    pub(super) fn place(&mut self, space: &RenderingSpace) {
        self.scale /= space.scale;
        for volume in [&mut self.sigma_t, &mut self.albedo].into_iter().flat_map(SpectrumTexture::volumes_mut)
        {
            *volume = Arc::new(volume.placed(space));
        }
        let grid = self.emission.as_mut().and_then(|light| light.grid.as_mut());
        grid.into_iter().for_each(|grid| *grid = Arc::new(grid.placed(space)));
        self.phase.place(space);
    }
}

/// The media on both sides of a surface, pbrt's `MediumInterface`. A surface that names none has the same medium on both sides, whichever it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MediumInterface {
    /// Behind it, where its normals do not point; `None` is vacuum.
    pub interior: Option<MediumId>,
    /// In front of it; `None` is vacuum.
    pub exterior: Option<MediumId>,
}

impl MediumInterface {
    /// True where it names a medium: then both of its sides are said.
    pub fn is_transition(&self) -> bool {
        self.interior.is_some() || self.exterior.is_some()
    }
}
