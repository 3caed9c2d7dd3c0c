//! Integrators and samplers: read for depths and counts.

use super::document::ElementId;
use super::params::Params;
use super::reader::Reader;
use super::suggest;
use super::value::shorten;
use crate::scene::desc::{IntegratorDesc, IntegratorKind, PhotonDesc};
use crate::scene::diagnostic::SceneError;

/// Every integrator; anything else is rendered by path tracing, with a warning. `ptracer` is
/// Mitsuba's name of particle tracing; the last three are not in Mitsuba 3.
const KINDS: &[(&str, IntegratorKind)] = &[
    ("path", IntegratorKind::Path),
    ("ptracer", IntegratorKind::Light),
    ("light", IntegratorKind::Light),
    ("bidirectional", IntegratorKind::Bidirectional),
    ("photon", IntegratorKind::Photon),
    ("auto", IntegratorKind::Auto),
];

/// Samplers of Mitsuba. The program has a sequence of its own and takes only the count.
const SAMPLERS: &[&str] = &["independent", "stratified", "multijitter", "orthogonal", "ldsampler"];

pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<IntegratorDesc, SceneError> {
    let params = Params::new(reader.document, id)?;
    params.without_effect(&["samples_per_pass", "block_size", "timeout"]);
    let kind = match KINDS.iter().find(|(name, _)| *name == params.plugin()) {
        Some((_, kind)) => *kind,
        None => {
            let name = shorten(params.plugin());
            let found = params.type_fault(format!("there is no integrator `{name}`: path tracing is used"));
            let names: Vec<&str> = KINDS.iter().map(|k| k.0).collect();
            params.note(found.help(suggest::hint(params.plugin(), &names)).warning());
            IntegratorKind::Path
        }
    };
    let max_depth =
        match params.integer("max_depth")? {
            None | Some(-1) => None,
            Some(n) => Some(u32::try_from(n).map_err(|_| {
                params.error("max_depth", "a depth is -1 (unlimited) or not negative").error()
            })?),
        };
    let rr_depth = params.integer("rr_depth")?.unwrap_or(i64::from(IntegratorDesc::default().rr_depth));
    let rr_depth = u32::try_from(rr_depth).ok().filter(|d| *d > 0).ok_or_else(|| {
        params.error("rr_depth", "the depth at which roulette starts is above zero").error()
    })?;
    let hide_emitters = params.boolean("hide_emitters", false)?;
    let photons = match kind {
        IntegratorKind::Photon | IntegratorKind::Auto => photons(&params)?,
        _ => PhotonDesc::default(),
    };
    reader.finish(params);
    Ok(IntegratorDesc { kind, max_depth, rr_depth, hide_emitters, spectral: false, photons })
}

/// Parameters of our own `photon`, and of `auto`, which may choose it, after those that renderers with photon maps have.
fn photons(params: &Params<'_>) -> Result<PhotonDesc, SceneError> {
    let initial_radius = params.float("initial_radius")?.map(|r| r as f32);
    if initial_radius.is_some_and(|r| !(1e-12..=1e12).contains(&r)) {
        return Err(params.error("initial_radius", "a radius is from 1e-12 to 1e12").error());
    }
    let alpha = params.float("alpha")?;
    if alpha.is_some_and(|a| !(0.0..1.0).contains(&a)) {
        return Err(params.error("alpha", "alpha is at least 0 and below 1").error());
    }
    let lookup_size = params.integer("lookup_size")?.map(|n| n.clamp(0, 1 << 20) as u32);
    if lookup_size.is_some_and(|n| !(2..=4096).contains(&n)) {
        return Err(params.error("lookup_size", "a lookup takes from 2 to 4096 photons").error());
    }
    Ok(PhotonDesc { initial_radius, alpha, lookup_size, ..PhotonDesc::default() })
}

/// The sample count of a sampler of any type.
pub(crate) fn sampler(reader: &mut Reader<'_>, id: ElementId) -> Result<Option<u64>, SceneError> {
    let params = Params::new(reader.document, id)?;
    params.without_effect(&["seed", "jitter", "strength"]);
    if !SAMPLERS.contains(&params.plugin()) {
        let found = params.type_fault(format!("the sampler `{}` is not known", shorten(params.plugin())));
        params.note(found.help("only its sample_count is used").warning());
    }
    let count = params.integer("sample_count")?;
    if count.is_some_and(|n| !(1..=1 << 40).contains(&n)) {
        return Err(params.error("sample_count", "a sample count is above 0 and not above 2^40").error());
    }
    reader.finish(params);
    Ok(count.map(|n| n as u64))
}
