//! Participating media: fog, smoke, milk, and how they scatter.

use std::sync::Arc;

use super::ids::MediumId;
use super::phase::PhaseDesc;
use super::rendering_space::RenderingSpace;
use super::texture::SpectrumTexture;
use super::volume::VolumeTexture;
use crate::spectrum::{Spectrum, blackbody};

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
    /// Where it varies in space.
    pub grid: Option<EmissionGrid>,
}

/// The light that a medium emits, at the points of a grid.
#[derive(Clone, Debug)]
pub enum EmissionGrid {
    /// Colours under D65.
    Colors(Arc<VolumeTexture>),
    /// Temperatures in K, one number at each point, up to [`blackbody::HOTTEST`]: the radiance is that of a black body of the temperature that is
    /// interpolated.
    Temperatures(Arc<VolumeTexture>),
}

impl EmissionGrid {
    /// The numbers and where they lie.
    pub fn volume(&self) -> &Arc<VolumeTexture> {
        match self {
            Self::Colors(volume) | Self::Temperatures(volume) => volume,
        }
    }

    /// Its colours under D65; those of temperatures are exact at the points of the grid, and without negative components.
    fn colors(&self) -> Arc<VolumeTexture> {
        match self {
            Self::Colors(colors) => colors.clone(),
            Self::Temperatures(kelvin) => Arc::new(kelvin.colored(blackbody::colors(kelvin.largest()))),
        }
    }

    /// The same with its numbers elsewhere in space.
    fn placed(&self, space: &RenderingSpace) -> Self {
        match self {
            Self::Colors(colors) => Self::Colors(Arc::new(colors.placed(space))),
            Self::Temperatures(kelvin) => Self::Temperatures(Arc::new(kelvin.placed(space))),
        }
    }
}

impl MediumEmission {
    /// True where there is no light.
    pub fn is_black(&self) -> bool {
        self.radiance.is_black() || self.grid.as_ref().is_some_and(|grid| grid.volume().mean() == [0.0; 3])
    }

    /// Replaces a grid by its mean colour.
    pub fn make_uniform(&mut self) {
        if let Some(grid) = self.grid.take() {
            let factor = self.radiance.max();
            self.radiance = Spectrum::emission_rgb(grid.colors().mean().map(|v| v * factor));
        }
    }

    /// Light of D65 as bright as the colours are.
    pub fn make_grey(&mut self) {
        match &mut self.grid {
            Some(grid) => *grid = EmissionGrid::Colors(Arc::new(grid.colors().grey())),
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
        grid.into_iter().for_each(|grid| *grid = grid.placed(space));
        self.phase.place(space);
    }
}

/// The single-scattering albedo α of a medium that looks as bright as a matt surface of this `reflectance`: the share of even light that a half-space
/// of it reflects behind a boundary that does not refract, its multiple-scattering albedo. `g` is the mean cosine of its phase function. All
/// are numbers without a unit; the reflectance is clamped to [0, 1].
///
/// The fit is that of C. Kulla and A. Conty, *Revisiting Physically Based Shading at Imageworks*, SIGGRAPH 2017 course notes, as
/// `KHR_materials_volume_scatter` prescribes it; another g follows by the similarity (1 − α) / (1 − g α) = s² of H. C. van de Hulst, *Multiple Light
/// Scattering*, 1980. By random walks a half-space with this α reflects what was asked for, within 0.0025 for g from 0 to 0.95 and within 0.025
/// down to g = −0.9. The fit of Chiang, Kutz and Burley, *Practical and Controllable Subsurface Scattering for Production Path Tracing*, 2016,
/// is as close up to 0.8 and then falls short: 0.87 for 0.9, 0.92 for 0.99.
///
/// A boundary that refracts throws a part of the light back into the medium, which is then darker: with an index of 1.5 half-spaces for 0.2,
/// 0.5 and 0.8 return 0.07, 0.26 and 0.60 of the light that enters. glTF defines the colour without that, for any index.
pub fn single_scattering_albedo(reflectance: f32, g: f32) -> f32 {
    let (a, g) = (f64::from(reflectance).clamp(0.0, 1.0), f64::from(g));
    let s = 4.09712 + 4.20863 * a - (9.59217 + 41.6808 * a + 17.7126 * a * a).sqrt();
    let s2 = s * s;
    (((1.0 - s2) / (1.0 - g * s2)) as f32).clamp(0.0, 1.0)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The share of even light that a half-space reflects which scatters isotropically: 1 − 2 √(1 − α) ∫ H(μ) μ dμ, with Chandrasekhar's function
    /// (*Radiative Transfer*, 1960, §33) from the iteration 1/H(μ) = √(1 − α) + α/2 ∫ μ' H(μ') / (μ + μ') dμ'.
    fn reflectance(alpha: f64) -> f64 {
        const N: usize = 64;
        let mu = |i: usize| (i as f64 + 0.5) / N as f64;
        let root = (1.0 - alpha).sqrt();
        let mut h = vec![1.0; N];
        for _ in 0..150 {
            let next = |i: usize| {
                let sum: f64 = (0..N).map(|j| mu(j) * h[j] / (mu(i) + mu(j))).sum();
                1.0 / (root + 0.5 * alpha * sum / N as f64)
            };
            h = (0..N).map(next).collect();
        }
        1.0 - 2.0 * root * (0..N).map(|i| h[i] * mu(i)).sum::<f64>() / N as f64
    }

    #[test]
    fn a_half_space_reflects_what_was_asked_for() {
        for asked in [0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.95] {
            let found = reflectance(single_scattering_albedo(asked, 0.0).into());
            assert!((found - f64::from(asked)).abs() < 0.0025, "{found}, not {asked}");
        }
        let ends = [0.0, 1.0].map(|asked| single_scattering_albedo(asked, 0.5));
        assert!(ends[0] < 1e-4 && ends[1] > 0.999_999 && ends[1] <= 1.0, "{ends:?}");
        // What scatters forwards has to scatter more often.
        assert!(single_scattering_albedo(0.5, 0.8) > single_scattering_albedo(0.5, 0.0));
    }
}
