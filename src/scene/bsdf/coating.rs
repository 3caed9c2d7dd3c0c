//! `coating` and `roughcoating` of version 0.6: a layer of a transparent medium over any other material.

use glam::Vec4;

use super::dielectric::ior;
use super::mixed::warn_of_lost_dispersion;
use super::roughness::ReadRoughness;
use super::{BsdfDesc, BsdfPlugin, Roughness, color, parts};
use crate::scene::desc::BsdfId;
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::mitsuba::{Params, Reader, Role, read_spectrum, read_texture};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::dispersion::SODIUM_D;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// What a smooth and a rough coat have in common, as what is traced sees it.
#[derive(Clone, Copy, Debug)]
pub struct CoatDesc<'a> {
    /// The material under the coat.
    pub bsdf: BsdfId,
    /// Index of the coat over that of the outside, at the sodium line.
    pub eta: f32,
    /// Thickness of the coat, in the units of 1 / `sigma_a`.
    pub thickness: f32,
    /// What the coat absorbs on a length of 1, from 0 without bound.
    pub sigma_a: &'a SpectrumTexture,
    /// Factor on the reflection of the coat, 1 in nature.
    pub specular_reflectance: &'a SpectrumTexture,
    /// Its microfacets; `None` for a smooth one.
    pub roughness: Option<Roughness>,
}

/// A smooth coat over another material.
#[derive(Clone, Debug)]
pub struct CoatingDesc {
    /// The material under the coat.
    pub bsdf: BsdfId,
    /// Index of the coat; its value at the sodium line counts for all wavelengths.
    pub int_ior: Ior,
    /// Index outside, likewise.
    pub ext_ior: Ior,
    /// Thickness of the coat, in the units of 1 / `sigma_a`.
    pub thickness: f32,
    /// What the coat absorbs on a length of 1, from 0 without bound.
    pub sigma_a: SpectrumTexture,
    /// Factor on the reflection of the coat, 1 in nature.
    pub specular_reflectance: SpectrumTexture,
}

impl CoatingDesc {
    fn coat_of(&self, roughness: Option<Roughness>) -> CoatDesc<'_> {
        let at_sodium = |ior: &Ior| ior.eval(Vec4::splat(SODIUM_D)).x;
        CoatDesc {
            bsdf: self.bsdf,
            eta: at_sodium(&self.int_ior) / at_sodium(&self.ext_ior),
            thickness: self.thickness,
            sigma_a: &self.sigma_a,
            specular_reflectance: &self.specular_reflectance,
            roughness,
        }
    }
}

impl BsdfPlugin for CoatingDesc {
    const NAME: &'static str = "coating";
    const SPECTRAL_INDEX: bool = false;

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let [inner] = *params.objects("bsdf").as_slice() else {
            let message = format!("a `{}` has one bsdf, which it coats", params.plugin());
            return Err(params.fault(FindingKind::Parameter, message).error());
        };
        params.without_effect(&["specular_sampling_weight"]);
        let (int_ior, ext_ior) = (ior(params, "int_ior", "bk7")?, ior(params, "ext_ior", "air")?);
        params.default("thickness", 1);
        let thickness = params.float("thickness")?.unwrap_or(1.0);
        if thickness < 0.0 {
            return Err(params.error("thickness", "a coat is not thinner than 0").error());
        }
        params.default("sigma_a", 0);
        let sigma_a = absorption(reader, params)?;
        let specular_reflectance = color(reader, params, "specular_reflectance", 1.0)?;
        let bsdf = super::read(reader, inner.0)?;
        warn_of_lost_dispersion(reader, params, bsdf, inner.1);
        if is_coated(reader, bsdf) {
            let found = params.fault(FindingKind::Plugin, "a coat over another coat is not supported");
            return Err(found.help("leave one of them out").error());
        }
        if has_holes(reader, bsdf) {
            let message = "where the bsdf in this coat has holes the coat has them, too";
            params.note(params.fault(FindingKind::Parameter, message).advice());
        }
        let thickness = thickness.min(f64::from(f32::MAX)) as f32;
        Ok(Self { bsdf, int_ior, ext_ior, thickness, sigma_a, specular_reflectance })
    }

    parts! {
        reflection: specular_reflectance,
        absorption: sigma_a,
        int_ior: int_ior,
        ext_ior: ext_ior,
    }

    fn number(&self, name: &str) -> Option<f32> {
        (name == "thickness").then_some(self.thickness)
    }

    fn set_number(&mut self, _name: &str, value: f32) {
        self.thickness = value;
    }

    fn nested(&self) -> Vec<BsdfId> {
        vec![self.bsdf]
    }

    fn coat(&self) -> Option<CoatDesc<'_>> {
        Some(self.coat_of(None))
    }
}

/// A rough coat over another material.
#[derive(Clone, Debug)]
pub struct RoughCoatingDesc {
    /// What it has in common with a smooth one.
    pub coating: CoatingDesc,
    /// Microfacets of the coat, the same along both tangents.
    pub roughness: Roughness,
}

impl BsdfPlugin for RoughCoatingDesc {
    const NAME: &'static str = "roughcoating";
    const SPECTRAL_INDEX: bool = false;

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let coating = CoatingDesc::read(reader, params)?;
        let roughness = ReadRoughness::read(reader, params)?.uniform(params);
        if roughness.alpha[0] != roughness.alpha[1] {
            let found = params.error("alpha_u", "a coat is as rough along as across");
            return Err(found.help("give one `alpha`").error());
        }
        Ok(Self { coating, roughness })
    }

    fn parts(&self) -> super::BsdfParts<&SpectrumTexture, &Spectrum, &Ior> {
        self.coating.parts()
    }

    fn parts_mut(&mut self) -> super::BsdfParts<&mut SpectrumTexture, &mut Spectrum, &mut Ior> {
        self.coating.parts_mut()
    }

    fn roughness(&self) -> Option<Roughness> {
        Some(self.roughness)
    }

    fn number(&self, name: &str) -> Option<f32> {
        self.coating.number(name).or_else(|| self.roughness.number(name))
    }

    fn set_number(&mut self, name: &str, value: f32) {
        match name {
            "thickness" => self.coating.set_number(name, value),
            _ => self.roughness.set_number(name, value),
        }
    }

    fn nested(&self) -> Vec<BsdfId> {
        self.coating.nested()
    }

    fn coat(&self) -> Option<CoatDesc<'_>> {
        Some(self.coating.coat_of(Some(self.roughness)))
    }
}

/// `sigma_a`: a spectrum without bound, or a texture; nothing unless given.
fn absorption(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<SpectrumTexture, SceneError> {
    let is_texture = params.get("sigma_a").is_some_and(|element| element.tag.name == "texture");
    let given = if is_texture {
        read_texture(reader, params, "sigma_a")?
    } else {
        read_spectrum(reader, params, "sigma_a", Role::Unbounded)?.map(SpectrumTexture::Uniform)
    };
    Ok(given.unwrap_or(Spectrum::Constant(0.0).into()))
}

/// True for a material that has a coat, or of which a part does.
fn is_coated(reader: &Reader<'_>, id: BsdfId) -> bool {
    any(reader, id, |bsdf| bsdf.coat().is_some())
}

/// True for a material that has holes, or of which a part does.
fn has_holes(reader: &Reader<'_>, id: BsdfId) -> bool {
    any(reader, id, BsdfDesc::has_holes)
}

fn any(reader: &Reader<'_>, id: BsdfId, is: fn(&BsdfDesc) -> bool) -> bool {
    let bsdf = &reader.lists.bsdfs[id.0 as usize];
    is(bsdf) || bsdf.nested().into_iter().any(|id| any(reader, id, is))
}
