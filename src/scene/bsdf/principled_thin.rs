//! `principledthin`: leaves, paper and panes by parameters like those of `principled`.

use super::dielectric::is_ior;
use super::principled::{ONE, share};
use super::{BsdfParts, BsdfPlugin, PrincipledLobes, Roughness, color};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// The thin principled material of Burley (2015) as Mitsuba 3 has it: both sides look alike.
#[derive(Clone, Debug)]
pub struct PrincipledThinDesc {
    /// Albedo of the diffuse parts, colour of what is let through.
    pub base_color: SpectrumTexture,
    /// Factor on all that is let through: 1, or 0 where the effect `transmission` is taken out.
    pub transmittance: SpectrumTexture,
    /// Share of the microfacets in everything.
    pub spec_trans: f32,
    /// Share of the diffuse part that is let through, from 0 to 1; half of the file's.
    pub diff_trans: f32,
    /// The parameters that it shares with `principled`; there is neither metal nor coat.
    pub lobes: PrincipledLobes,
}

impl BsdfPlugin for PrincipledThinDesc {
    const NAME: &'static str = "principledthin";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let eta = params.float("eta")?.unwrap_or(1.5);
        if !is_ior(eta) {
            return Err(params.error("eta", "an index of refraction is above 0 and not above 1000").error());
        }
        params.without_effect(&[
            "specular_reflectance_sampling_rate",
            "specular_transmittance_sampling_rate",
            "diffuse_reflectance_sampling_rate",
            "diffuse_transmittance_sampling_rate",
        ]);
        Ok(Self {
            base_color: color(reader, params, "base_color", 0.5)?,
            transmittance: Spectrum::Constant(1.0).into(),
            spec_trans: share(params, "spec_trans", 0.0, 1.0)?,
            diff_trans: 0.5 * share(params, "diff_trans", 0.0, 2.0)?,
            lobes: PrincipledLobes::read(params, eta as f32)?,
        })
    }

    fn parts(&self) -> BsdfParts<&SpectrumTexture, &Spectrum, &Ior> {
        BsdfParts {
            albedo: Some(&self.base_color),
            reflection: Some(&ONE),
            transmission: self.lets_through().then_some(&self.transmittance),
            ..Default::default()
        }
    }

    fn parts_mut(&mut self) -> BsdfParts<&mut SpectrumTexture, &mut Spectrum, &mut Ior> {
        let through = self.lets_through();
        BsdfParts {
            albedo: Some(&mut self.base_color),
            transmission: through.then_some(&mut self.transmittance),
            ..Default::default()
        }
    }

    fn roughness(&self) -> Option<Roughness> {
        Some(self.lobes.facets(self.lobes.roughness))
    }
}

impl PrincipledThinDesc {
    fn lets_through(&self) -> bool {
        self.spec_trans > 0.0 || self.diff_trans > 0.0
    }
}
