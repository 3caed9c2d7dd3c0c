//! `distribution` and `alpha`: the parameters that all rough materials share.

use crate::scene::diagnostic::{FindingKind, SceneError};
use crate::scene::mitsuba::{Params, Reader};

/// Mitsuba's default roughness.
const ALPHA: f64 = 0.1;

/// Mitsuba's smallest roughness; lower values are raised to it.
const SMOOTHEST: f64 = 1e-4;

/// Largest roughness that is accepted.
const ROUGHEST: f64 = 1e4;

/// How the microfacets of a rough surface are spread: Mitsuba's `distribution` and `alpha`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    /// The family of distributions.
    pub facets: Facets,
    /// Root mean square slope (for Beckmann) along the two tangents.
    pub alpha: [f32; 2],
}

/// A family of distributions of microfacet normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facets {
    /// Gaussian slopes.
    Beckmann,
    /// Long tails (Trowbridge and Reitz).
    Ggx,
}

impl Roughness {
    /// Reads the parameters of a rough material: Beckmann with `alpha` = 0.1 unless given.
    pub(super) fn read(reader: &Reader<'_>, params: &Params<'_>) -> Result<Self, SceneError> {
        let facets = match params.string("distribution")?.map(|d| d.to_lowercase()).as_deref() {
            None | Some("beckmann") => Facets::Beckmann,
            Some("ggx") => Facets::Ggx,
            Some(_) => {
                let found = params.error("distribution", "there is no such distribution of facets");
                return Err(found.help("it is `beckmann` or `ggx`").error());
            }
        };
        let alpha = match [alpha(params, "alpha")?, alpha(params, "alpha_u")?, alpha(params, "alpha_v")?] {
            [both, None, None] => [both.unwrap_or(ALPHA as f32); 2],
            [None, Some(u), Some(v)] => [u, v],
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
        Ok(Self { facets, alpha })
    }
}

/// Reads one roughness; refuses what is out of range, and raises what is too small.
fn alpha(params: &Params<'_>, name: &'static str) -> Result<Option<f32>, SceneError> {
    let Some(v) = params.float(name)? else { return Ok(None) };
    if !(0.0..=ROUGHEST).contains(&v) {
        return Err(params.error(name, "a roughness is from 0 to 10000").error());
    }
    if v < SMOOTHEST {
        let found = params.error(name, "this roughness is raised to 0.0001");
        params.note(found.help("without roughness use the smooth material of the same kind").warning());
    }
    Ok(Some(v.max(SMOOTHEST) as f32))
}
