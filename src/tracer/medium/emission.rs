//! The light that a medium emits.

use glam::{Vec3, Vec3A, Vec4};

use crate::scene::desc::{EmissionGrid, MediumEmission};
use crate::spectrum::{BRIGHTEST, SampledWavelengths, Spectrum, blackbody};

/// The radiance of an opaque layer that scatters nothing, at each point of a medium.
#[derive(Clone, Debug)]
pub(super) struct EmissionField {
    radiance: Spectrum,
    grid: Option<EmissionGrid>,
}

impl EmissionField {
    pub(super) fn new(desc: &MediumEmission) -> Self {
        Self { radiance: desc.radiance.clone(), grid: desc.grid.clone() }
    }

    /// The radiance at the point `p` of rendering space.
    #[inline]
    pub(super) fn at(&self, p: Vec3, lambda: &SampledWavelengths) -> Vec4 {
        let radiance = self.radiance.sample(lambda).0;
        let of_grid = match &self.grid {
            None => return radiance,
            Some(EmissionGrid::Temperatures(grid)) => {
                let [kelvin, ..] = grid.coefficient_at(p);
                blackbody::radiance_at(lambda.lambda(), kelvin)
            }
            Some(EmissionGrid::Colors(grid)) => {
                let rgb = Vec3A::from_array(grid.coefficient_at(p));
                let most = rgb.max_element();
                if most <= 0.0 {
                    return Vec4::ZERO;
                }
                let color = Spectrum::textured_rgb(rgb / most, lambda).0 * most;
                color * Spectrum::d65(1.0).sample(lambda).0
            }
        };
        (radiance * of_grid).min(Vec4::splat(BRIGHTEST))
    }
}
