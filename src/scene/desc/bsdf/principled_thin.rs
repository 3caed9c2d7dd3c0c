//! `principledthin`: leaves, paper and panes by parameters like those of `principled`.

use super::principled::ONE;
use super::{BsdfParts, BsdfPlugin, LobeTexture, PrincipledLobes, Roughness};
use crate::scene::desc::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// The thin principled material of Burley (2015) as Mitsuba 3 has it: both sides look alike.
#[derive(Clone, Debug)]
pub struct PrincipledThinDesc {
    /// Albedo of the diffuse parts, colour of transmitted light.
    pub base_color: SpectrumTexture,
    /// Factor on transmission: 1, or 0 if the effect `transmission` is disabled.
    pub transmittance: SpectrumTexture,
    /// Share of the microfacets in everything, a number.
    pub spec_trans: SpectrumTexture,
    /// Twice the share of the diffuse part that is let through: a number from 0 to 2.
    pub diff_trans: SpectrumTexture,
    /// The parameters that it shares with `principled`; there is neither metal nor coat.
    pub lobes: PrincipledLobes,
    /// Textures of the parameters that vary; `lobes` then has their means, or 1 for a mesh attribute.
    pub textures: Vec<LobeTexture>,
}

impl BsdfPlugin for PrincipledThinDesc {
    const NAME: &'static str = "principledthin";

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

    fn number(&self, name: &str) -> Option<f32> {
        match name {
            "spec_trans" => self.spec_trans.constant_scalar(),
            "diff_trans" => self.diff_trans.constant_scalar(),
            _ => [PrincipledLobes::SHARED, PrincipledLobes::ETA]
                .iter()
                .find_map(|known| self.lobes.number(known, &self.textures, name)),
        }
    }

    fn set_number(&mut self, name: &str, value: f32) {
        match name {
            "spec_trans" => self.spec_trans = Spectrum::Constant(value).into(),
            "diff_trans" => self.diff_trans = Spectrum::Constant(value).into(),
            _ => [PrincipledLobes::SHARED, PrincipledLobes::ETA]
                .iter()
                .for_each(|known| self.lobes.set_number(known, name, value)),
        }
    }

    fn scalars(&self) -> Vec<&SpectrumTexture> {
        let lobes = self.textures.iter().map(|varying| &varying.texture);
        lobes.chain([&self.spec_trans, &self.diff_trans]).collect()
    }

    fn scalars_mut(&mut self) -> Vec<&mut SpectrumTexture> {
        let lobes = self.textures.iter_mut().map(|varying| &mut varying.texture);
        lobes.chain([&mut self.spec_trans, &mut self.diff_trans]).collect()
    }
}

impl PrincipledThinDesc {
    fn lets_through(&self) -> bool {
        !self.spec_trans.is_black() || !self.diff_trans.is_black()
    }
}
