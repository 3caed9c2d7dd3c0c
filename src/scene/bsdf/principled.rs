//! `principled`: diffuse, metallic, glassy and coated materials by one set of parameters, most of them from 0 to 1.

use super::dielectric::is_ior;
use super::{BsdfParts, BsdfPlugin, Facets, Roughness, color};
use crate::scene::diagnostic::SceneError;
use crate::scene::mitsuba::{Params, Reader};
use crate::scene::texture::SpectrumTexture;
use crate::spectrum::{Spectrum, dispersion::Ior};

/// The smoothest that its facets can be.
const SMOOTHEST: f32 = 1e-3;

/// What its reflection is multiplied by.
pub(super) static ONE: SpectrumTexture = SpectrumTexture::Uniform(Spectrum::Constant(1.0));

/// The principled material of Burley (2012, 2015) as Mitsuba 3 has it.
#[derive(Clone, Debug)]
pub struct PrincipledDesc {
    /// Albedo of the diffuse part, colour of the metal, squared colour of the glass.
    pub base_color: SpectrumTexture,
    /// Share of glass in what is not metal, a constant. 0 for a material that lets nothing through.
    pub spec_trans: SpectrumTexture,
    /// All that has no colour.
    pub lobes: PrincipledLobes,
}

/// The parameters of a [`PrincipledDesc`] that have no colour; from 0 to 1, the index excepted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipledLobes {
    /// Square root of the microfacets' α.
    pub roughness: f32,
    /// Share of α that differs between the two tangents.
    pub anisotropic: f32,
    /// Share of metal.
    pub metallic: f32,
    /// Index behind the surface over that in front of it.
    pub eta: f32,
    /// Share of the base colour in the reflection of what is not metal.
    pub spec_tint: f32,
    /// Brightness at grazing angles, as of velvet.
    pub sheen: f32,
    /// Share of the base colour in it.
    pub sheen_tint: f32,
    /// Share of an approximation of light that scatters within the surface in the diffuse part.
    pub flatness: f32,
    /// Strength of a second reflection, of a clear coat.
    pub clearcoat: f32,
    /// Its smoothness.
    pub clearcoat_gloss: f32,
}

impl PrincipledLobes {
    /// Those of a file, with this index.
    pub(super) fn read(params: &Params<'_>, eta: f32) -> Result<Self, SceneError> {
        let share = |name, default| share(params, name, default, 1.0);
        Ok(Self {
            roughness: share("roughness", 0.5)?,
            anisotropic: share("anisotropic", 0.0)?,
            spec_tint: share("spec_tint", 0.0)?,
            sheen: share("sheen", 0.0)?,
            sheen_tint: share("sheen_tint", 0.0)?,
            flatness: share("flatness", 0.0)?,
            eta,
            metallic: 0.0,
            clearcoat: 0.0,
            clearcoat_gloss: 0.0,
        })
    }

    /// Microfacets of this roughness (Burley 2012, §5.4).
    pub fn facets(&self, roughness: f32) -> Roughness {
        let (alpha, aspect) = (roughness * roughness, (1.0 - 0.9 * self.anisotropic).sqrt());
        Roughness {
            facets: Facets::Ggx,
            alpha: [alpha / aspect, alpha * aspect].map(|alpha| alpha.max(SMOOTHEST)),
        }
    }
}

impl BsdfPlugin for PrincipledDesc {
    const NAME: &'static str = "principled";

    fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let base_color = color(reader, params, "base_color", 0.5)?;
        let share = |name| share(params, name, 0.0, 1.0);
        let spec_trans = share("spec_trans")?;
        let lobes = PrincipledLobes {
            metallic: share("metallic")?,
            clearcoat: share("clearcoat")?,
            clearcoat_gloss: share("clearcoat_gloss")?,
            ..PrincipledLobes::read(params, eta(params, spec_trans > 0.0)?)?
        };
        params.without_effect(&[
            "main_specular_sampling_rate",
            "clearcoat_sampling_rate",
            "diffuse_reflectance_sampling_rate",
        ]);
        Ok(Self { base_color, spec_trans: Spectrum::Constant(spec_trans).into(), lobes })
    }

    fn parts(&self) -> BsdfParts<&SpectrumTexture, &Spectrum, &Ior> {
        BsdfParts {
            albedo: Some(&self.base_color),
            reflection: Some(&ONE),
            transmission: (!self.spec_trans.is_black()).then_some(&self.spec_trans),
            ..Default::default()
        }
    }

    fn parts_mut(&mut self) -> BsdfParts<&mut SpectrumTexture, &mut Spectrum, &mut Ior> {
        let transmits = !self.spec_trans.is_black();
        BsdfParts {
            albedo: Some(&mut self.base_color),
            transmission: transmits.then_some(&mut self.spec_trans),
            ..Default::default()
        }
    }

    fn roughness(&self) -> Option<Roughness> {
        Some(self.lobes.facets(self.lobes.roughness))
    }
}

/// The relative index: `eta`, or from `specular` with 0.5 for glass. A material that lets light through has an index other than 1.
fn eta(params: &Params<'_>, transmits: bool) -> Result<f32, SceneError> {
    let Some(eta) = params.float("eta")? else {
        let specular = share(params, "specular", 0.5, 1.0)?;
        let specular = if transmits { specular.max(1e-3) } else { specular };
        return Ok(2.0 / (1.0 - (0.08 * specular).sqrt()) - 1.0);
    };
    if params.has("specular") {
        return Err(params.error("specular", "either `eta` or `specular`, which say the same").error());
    }
    if !is_ior(eta) {
        return Err(params.error("eta", "an index of refraction is above 0 and not above 1000").error());
    }
    Ok(if transmits && (eta - 1.0).abs() < 1e-3 { 1.001 } else { eta as f32 })
}

/// A parameter from 0 to `most`; what is out of range is cut, with a warning.
pub(super) fn share(
    params: &Params<'_>,
    name: &'static str,
    default: f32,
    most: f64,
) -> Result<f32, SceneError> {
    let Some(v) = params.float(name)? else { return Ok(default) };
    let cut = v.clamp(0.0, most);
    if cut != v {
        let found = params.error(name, format!("`{name}` is from 0 to {most}: it counts as {cut}"));
        params.note(found.help("other values have no meaning in this material").warning());
    }
    Ok(cut as f32)
}
