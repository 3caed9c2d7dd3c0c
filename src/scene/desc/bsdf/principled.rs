//! `principled`: diffuse, metallic, glassy and coated materials by one set of parameters, most of them from 0 to 1.

use super::{BsdfParts, BsdfPlugin, Facets, Roughness, ThinFilmDesc};
use crate::scene::desc::texture::{SpectrumTexture, TexturePoint};
use crate::spectrum::{Spectrum, dispersion::Ior};

/// Least α of the microfacets.
const SMOOTHEST: f32 = 1e-3;

/// The factor on its reflection.
pub(super) static ONE: SpectrumTexture = SpectrumTexture::Uniform(Spectrum::Constant(1.0));

/// The principled material of Burley (2012, 2015) as Mitsuba 3 has it.
#[derive(Clone, Debug)]
pub struct PrincipledDesc {
    /// Albedo of the diffuse part, colour of the metal, squared colour of the glass.
    pub base_color: SpectrumTexture,
    /// Share of glass in what is not metal, a number. 0 for a material that lets nothing through.
    pub spec_trans: SpectrumTexture,
    /// The scalar parameters.
    pub lobes: PrincipledLobes,
    /// Textures of the parameters that vary; `lobes` then has their means, or 1 for a mesh attribute.
    pub textures: Vec<LobeTexture>,
    /// The film on its facets.
    pub thin_film: Option<Box<ThinFilmDesc>>,
}

/// The scalar parameters of a [`PrincipledDesc`], all from 0 to 1 except the index of refraction.
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

/// Selects a field of [`PrincipledLobes`].
pub(crate) type LobeParameter = fn(&mut PrincipledLobes) -> &mut f32;

/// A field of [`PrincipledLobes`] that varies over a surface.
#[derive(Clone, Debug)]
pub struct LobeTexture {
    /// The field.
    parameter: LobeParameter,
    /// The range to which its values are clamped.
    range: [f32; 2],
    /// Its values.
    pub(super) texture: SpectrumTexture,
}

impl PrincipledLobes {
    /// The parameters that `principled` and `principledthin` share, by name.
    pub(crate) const SHARED: &[(&str, LobeParameter)] = &[
        ("roughness", |lobes| &mut lobes.roughness),
        ("anisotropic", |lobes| &mut lobes.anisotropic),
        ("spec_tint", |lobes| &mut lobes.spec_tint),
        ("sheen", |lobes| &mut lobes.sheen),
        ("sheen_tint", |lobes| &mut lobes.sheen_tint),
        ("flatness", |lobes| &mut lobes.flatness),
    ];

    /// The index of refraction, which files give in several ways.
    pub(crate) const ETA: &[(&str, LobeParameter)] = &[("eta", |lobes| &mut lobes.eta)];

    /// The parameters that only `principled` has, by name.
    pub(crate) const COATED: &[(&str, LobeParameter)] = &[
        ("metallic", |lobes| &mut lobes.metallic),
        ("clearcoat", |lobes| &mut lobes.clearcoat),
        ("clearcoat_gloss", |lobes| &mut lobes.clearcoat_gloss),
    ];

    /// Mitsuba's defaults, with this index.
    pub(crate) fn new(eta: f32) -> Self {
        Self {
            roughness: 0.5,
            anisotropic: 0.0,
            metallic: 0.0,
            eta,
            spec_tint: 0.0,
            sheen: 0.0,
            sheen_tint: 0.0,
            flatness: 0.0,
            clearcoat: 0.0,
            clearcoat_gloss: 0.0,
        }
    }

    /// The value of one of `parameters` by its name, unless one of `textures` varies it.
    pub(super) fn number(
        &self,
        parameters: &[(&'static str, LobeParameter)],
        textures: &[LobeTexture],
        name: &str,
    ) -> Option<f32> {
        let (_, parameter) = parameters.iter().find(|(known, _)| *known == name)?;
        let mut fixed = *self;
        textures.iter().for_each(|varying| *(varying.parameter)(&mut fixed) = f32::NAN);
        Some(*parameter(&mut fixed)).filter(|value| !value.is_nan())
    }

    /// Changes one of `parameters`.
    pub(super) fn set_number(
        &mut self,
        parameters: &[(&'static str, LobeParameter)],
        name: &str,
        value: f32,
    ) {
        if let Some((_, parameter)) = parameters.iter().find(|(known, _)| *known == name) {
            *parameter(self) = value;
        }
    }

    /// The values at a point, with `textures` evaluated there.
    #[inline]
    pub fn at(mut self, textures: &[LobeTexture], at: &TexturePoint) -> Self {
        for LobeTexture { parameter, range: [least, most], texture } in textures {
            *parameter(&mut self) = texture.scalar(at).clamp(*least, *most);
        }
        self
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

impl LobeTexture {
    /// A texture of a field; sets the field to its `mean`.
    pub(crate) fn new(
        parameter: LobeParameter,
        range: [f32; 2],
        texture: SpectrumTexture,
        mean: &mut f32,
    ) -> Self {
        *mean = texture.mean_scalar().clamp(range[0], range[1]);
        Self { parameter, range, texture }
    }
}

impl BsdfPlugin for PrincipledDesc {
    const NAME: &'static str = "principled";

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

    fn number(&self, name: &str) -> Option<f32> {
        if name == "spec_trans" {
            // 0 makes it an opaque material, which has no such parameter to edit.
            return self.spec_trans.constant_scalar().filter(|share| *share > 0.0);
        }
        let of_lobes = || {
            [PrincipledLobes::SHARED, PrincipledLobes::COATED, PrincipledLobes::ETA]
                .iter()
                .find_map(|known| self.lobes.number(known, &self.textures, name))
        };
        self.thin_film.as_ref().and_then(|film| film.number(name)).or_else(of_lobes)
    }

    fn set_number(&mut self, name: &str, value: f32) {
        if name == "spec_trans" {
            self.spec_trans = Spectrum::Constant(value).into();
        }
        self.thin_film.iter_mut().for_each(|film| film.set_number(name, value));
        [PrincipledLobes::SHARED, PrincipledLobes::COATED, PrincipledLobes::ETA]
            .iter()
            .for_each(|known| self.lobes.set_number(known, name, value));
    }

    fn scalars(&self) -> Vec<&SpectrumTexture> {
        let of_film = self.thin_film.iter().flat_map(|film| [&film.weight, &film.thickness]);
        self.textures.iter().map(|varying| &varying.texture).chain(of_film).collect()
    }

    fn scalars_mut(&mut self) -> Vec<&mut SpectrumTexture> {
        let of_film = self.thin_film.iter_mut().flat_map(|film| {
            let ThinFilmDesc { weight, thickness, .. } = &mut **film;
            [weight, thickness]
        });
        self.textures.iter_mut().map(|varying| &mut varying.texture).chain(of_film).collect()
    }
}
