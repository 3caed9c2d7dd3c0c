//! The light that a medium emits.

use std::sync::Arc;

use glam::{Vec3, Vec3A, Vec4};

use crate::scene::desc::MediumEmission;
use crate::scene::desc::volume::VolumeTexture;
use crate::spectrum::{SampledWavelengths, Spectrum};

/// The radiance of an opaque layer that scatters nothing, at each point of a medium.
#[derive(Clone, Debug)]
pub(super) struct EmissionField {
    radiance: Spectrum,
    grid: Option<Arc<VolumeTexture>>,
}

impl EmissionField {
    pub(super) fn new(desc: &MediumEmission) -> Self {
        Self { radiance: desc.radiance.clone(), grid: desc.grid.clone() }
    }

    /// The radiance at the point `p` of rendering space.
    #[inline]
    pub(super) fn at(&self, p: Vec3, lambda: &SampledWavelengths) -> Vec4 {
        let radiance = self.radiance.sample(lambda).0;
        match &self.grid {
            None => radiance,
            Some(grid) => {
                let rgb = Vec3A::from_array(grid.coefficient_at(p));
                let most = rgb.max_element();
                if most <= 0.0 {
                    return Vec4::ZERO;
                }
                let color = Spectrum::textured_rgb(rgb / most, lambda).0 * most;
                radiance * color * Spectrum::d65(1.0).sample(lambda).0
            }
        }
    }
}
