//! `distribution` and `alpha` of rough materials.

use super::params::Params;
use super::reader::Reader;
use crate::scene::desc::{Facets, Roughness};
use crate::scene::diagnostic::{FindingKind, SceneError};

/// Mitsuba's default.
const ALPHA: f64 = 0.1;

/// Mitsuba's smallest roughness; less is this much.
const SMOOTHEST: f64 = 1e-4;

/// Largest roughness that is read: a slope of this root mean square is a wall.
const ROUGHEST: f64 = 1e4;

/// The facets of a rough material: Beckmann with `alpha` = 0.1 unless given.
pub(crate) fn read(reader: &Reader<'_>, params: &Params<'_>) -> Result<Roughness, SceneError> {
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
    Ok(Roughness { facets, alpha })
}

/// One roughness, in the range that there is.
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
