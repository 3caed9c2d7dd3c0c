//! `distribution` and `alpha`: the parameters that all rough materials share. `alpha` may be a texture.

use super::values::{Number, number};
use super::{Params, Reader};
use crate::scene::desc::texture::SpectrumTexture;
use crate::scene::desc::{AlphaTexture, Facets, Roughness};
use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::spectrum::Spectrum;

/// Mitsuba's default roughness.
const ALPHA: f64 = 0.1;

/// Mitsuba's smallest roughness; lower values are raised to it.
const SMOOTHEST: f64 = 1e-4;

/// Largest roughness that is accepted.
const ROUGHEST: f64 = 1e4;

/// Roughness as a file says it.
pub(super) struct ReadRoughness {
    /// Where it varies, its mean.
    pub(super) roughness: Roughness,
    /// How it varies.
    pub(super) alpha: Option<Box<AlphaTexture>>,
}

impl ReadRoughness {
    /// Reads the parameters of a rough material: Beckmann with `alpha` = 0.1 unless given.
    pub(super) fn read(reader: &mut Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let facets = match params.string("distribution")?.map(|d| d.to_lowercase()).as_deref() {
            None | Some("beckmann") => Facets::Beckmann,
            Some("ggx") => Facets::Ggx,
            Some(_) => {
                let found = params.error("distribution", "there is no such distribution of facets");
                return Err(found.help("it is `beckmann` or `ggx`").error());
            }
        };
        let mut alpha = |name| alpha(reader, params, name);
        let (roughness, texture) = match [alpha("alpha")?, alpha("alpha_u")?, alpha("alpha_v")?] {
            [both, None, None] => {
                let both = both.unwrap_or(Spectrum::Constant(ALPHA as f32).into());
                ([mean(&both); 2], both.varies().then_some(AlphaTexture::Isotropic(both)))
            }
            [None, Some(u), Some(v)] => {
                let varies = u.varies() || v.varies();
                ([mean(&u), mean(&v)], varies.then_some(AlphaTexture::Anisotropic([u, v])))
            }
            [None, u, _] => {
                let given = if u.is_some() { "alpha_u" } else { "alpha_v" };
                return Err(params.error(given, "`alpha_u` and `alpha_v` are given together").error());
            }
            _ => return Err(params.error("alpha", "either `alpha`, or `alpha_u` and `alpha_v`").error()),
        };
        if !params.boolean("sample_visible", true)? {
            let span = params.get("sample_visible").map_or(params.span(), |e| e.span);
            let message = "`sample_visible` is always true here: the picture is the same, with less noise";
            params.note(reader.document.finding(FindingKind::Parameter, span, message).advice());
        }
        Ok(Self { roughness: Roughness { facets, alpha: roughness }, alpha: texture.map(Box::new) })
    }

    /// Reads `alpha_u` and `alpha_v`, each [`ALPHA`] unless given.
    pub(super) fn along_tangents(
        reader: &mut Reader<'_>,
        params: &Params<'_>,
        facets: Facets,
    ) -> Result<Self, SceneError> {
        let mut along = |name| {
            params.default(name, ALPHA);
            let given = alpha(reader, params, name)?;
            Ok(given.unwrap_or(Spectrum::Constant(ALPHA as f32).into()))
        };
        let alphas = [along("alpha_u")?, along("alpha_v")?];
        let roughness = Roughness { facets, alpha: alphas.each_ref().map(mean) };
        let varies = alphas.iter().any(SpectrumTexture::varies);
        Ok(Self { roughness, alpha: varies.then(|| Box::new(AlphaTexture::Anisotropic(alphas))) })
    }

    /// The roughness as one number for the whole surface.
    pub(super) fn uniform(self, params: &Params<'_>) -> Roughness {
        if self.alpha.is_some() {
            let message = "the roughness of this material is one number: the mean of the texture counts";
            params.note(params.error("alpha", message).warning());
        }
        self.roughness
    }
}

/// The mean of a roughness.
fn mean(alpha: &SpectrumTexture) -> f32 {
    alpha.mean_scalar().max(SMOOTHEST as f32)
}

/// Reads one roughness; refuses a number that is out of range, and raises one that is too small.
pub(super) fn alpha(
    reader: &mut Reader<'_>,
    params: &Params<'_>,
    name: &'static str,
) -> Result<Option<SpectrumTexture>, SceneError> {
    let v = match number(reader, params, name)? {
        None => return Ok(None),
        Some(Number::Varying(texture)) => return Ok(Some(texture)),
        Some(Number::Uniform(v)) => v,
    };
    if !(0.0..=ROUGHEST).contains(&v) {
        return Err(params.error(name, "a roughness is from 0 to 10000").error());
    }
    if v < SMOOTHEST {
        let found = params.error(name, "this roughness is raised to 0.0001");
        params.note(found.help("without roughness use the smooth material of the same kind").warning());
    }
    Ok(Some(Spectrum::Constant(v.max(SMOOTHEST) as f32).into()))
}
