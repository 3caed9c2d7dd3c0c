//! Integrators and samplers: read for depths and counts.
//!
//! `light`, `bidirectional`, `photon`, `vcm` and `auto` are not in Mitsuba 3.

use super::document::ElementId;
use super::params::Params;
use super::reader::Reader;
use super::unsupported;
use crate::scene::desc::aov::{self, AovDesc, AovKind, AovList};
use crate::scene::desc::{IntegratorDesc, IntegratorKind, NoLight, PhotonDesc};
use crate::scene::diagnostic::{FindingKind, SceneError, shorten};
use crate::scene::limits;
use crate::scene::suggest;

/// Names of the integrators that are read with all their parameters.
pub(super) fn ours() -> impl Iterator<Item = &'static str> {
    IntegratorKind::all().flat_map(|kind| kind.traits().plugins).copied()
}

/// Integrators of Mitsuba 3, then of 0.6, for which a method of ours shows the same light: only depths are read, with a
/// remark. Any other is a warning and `auto`; one that holds an integrator stands back for that.
pub const FOREIGN: &[(&str, IntegratorKind)] = &[
    (DIRECT, IntegratorKind::Path),
    (AOV, IntegratorKind::Path),
    ("prb", IntegratorKind::Path),
    ("prb_basic", IntegratorKind::Path),
    ("prbvolpath", IntegratorKind::Path),
    ("prb_projective", IntegratorKind::Path),
    ("volpath_simple", IntegratorKind::Path),
    ("vpl", IntegratorKind::Bidirectional),
    ("bdpt", IntegratorKind::Bidirectional),
    ("mlt", IntegratorKind::Bidirectional),
    ("pssmlt", IntegratorKind::Bidirectional),
    ("erpt", IntegratorKind::Bidirectional),
    ("ppm", IntegratorKind::Photon),
    ("sppm", IntegratorKind::Photon),
    ("photonmapper", IntegratorKind::Photon),
];

/// Integrators of Mitsuba that know surfaces only: media are left out of their pictures.
const SURFACES_ONLY: &[&str] = &["path", DIRECT, "ptracer", "prb", "prb_basic", "prb_projective"];

/// Direct light only: paths of at most two segments.
const DIRECT: &str = "direct";

/// Layers beside the picture of an integrator in it.
const AOV: &str = "aov";

/// Samplers of Mitsuba 3 and 0.6. The program has a sequence of its own and takes only the count.
pub(super) const SAMPLERS: &[&str] =
    &["independent", "stratified", "multijitter", "orthogonal", "ldsampler", "halton", "hammersley", "sobol"];

/// Reads an integrator, or the one inside it.
pub(crate) fn read(reader: &mut Reader<'_>, id: ElementId) -> Result<IntegratorDesc, SceneError> {
    read_nested(reader, id, 0)
}

fn read_nested(reader: &mut Reader<'_>, id: ElementId, depth: usize) -> Result<IntegratorDesc, SceneError> {
    let params = Params::new(reader.document, id)?;
    let aovs = if params.plugin() == AOV { aovs(&params)? } else { Vec::new() };
    let own = IntegratorKind::all().find(|kind| kind.traits().plugins.contains(&params.plugin()));
    let name = shorten(params.plugin());
    if own.is_none()
        && let Some((inner, _)) = params.objects("integrator").first().copied()
    {
        if depth >= limits::REFERENCE_DEPTH {
            let message = "this integrator contains itself, or too many others within each other";
            return Err(params.fault(FindingKind::Reference, message).error());
        }
        if aovs.is_empty() {
            let found =
                params.type_fault(format!("`{name}` is left out: the integrator in it renders the picture"));
            params.note(found.advice());
        }
        if params.objects("integrator").len() > 1 {
            let found = params
                .type_fault(format!("`{name}` holds several integrators: the first renders the picture"));
            params.note(found.advice());
        }
        params.rest_without_effect();
        reader.finish(params);
        let mut read = read_nested(reader, inner, depth + 1)?;
        if !aovs.is_empty() {
            read.aovs = aovs;
        }
        return Ok(read);
    }
    params.without_effect(&["samples_per_pass", "block_size", "timeout", "strict_normals"]);
    let foreign = || FOREIGN.iter().find(|(name, _)| *name == params.plugin()).map(|(_, kind)| *kind);
    let kind = own.or_else(foreign).unwrap_or(IntegratorKind::Auto);
    if let Some(NoLight { remark, help, .. }) = kind.traits().no_light {
        params.note(params.type_fault(remark).help(help).advice());
    } else if own.is_none() && kind != IntegratorKind::Auto {
        let found = params.type_fault(format!("`{}` renders the light of `{name}`", kind.name()));
        params.note(found.help("another method: --integrator").advice());
    } else if own.is_none() {
        let message = match unsupported::why("integrator", params.plugin()) {
            Some(why) => format!("`{name}` is not supported: {why}"),
            None => format!("there is no integrator `{name}`: `auto` chooses the method"),
        };
        let names: Vec<&str> = ours().collect();
        params.note(params.type_fault(message).help(suggest::hint(params.plugin(), &names)).warning());
    }
    params.default("max_depth", if params.plugin() == DIRECT { 2 } else { -1 });
    let max_depth =
        match params.integer("max_depth")? {
            None if params.plugin() == DIRECT => Some(2),
            None | Some(-1) => None,
            Some(n) => Some(u32::try_from(n).map_err(|_| {
                params.error("max_depth", "a depth is -1 (unlimited) or not negative").error()
            })?),
        };
    let rr_depth = params.integer_or("rr_depth", i64::from(IntegratorDesc::default().rr_depth))?;
    let rr_depth = u32::try_from(rr_depth).ok().filter(|d| *d > 0).ok_or_else(|| {
        params.error("rr_depth", "the depth at which roulette starts is above zero").error()
    })?;
    let hide_emitters = params.boolean("hide_emitters", false)?;
    let surfaces_only = SURFACES_ONLY.contains(&params.plugin());
    let photons = match own {
        Some(kind) if kind.has_photons() || kind == IntegratorKind::Auto => photons(&params)?,
        _ => PhotonDesc::default(),
    };
    if own.is_none() {
        params.rest_without_effect();
    }
    reader.finish(params);
    Ok(IntegratorDesc {
        kind,
        max_depth,
        rr_depth,
        hide_emitters,
        surfaces_only,
        spectral: false,
        photons,
        aovs,
    })
}

/// The layers that an `aov` asks for.
fn aovs(params: &Params<'_>) -> Result<Vec<AovDesc>, SceneError> {
    let text = params.string("aovs")?.unwrap_or_default();
    let AovList { layers, left_out } = aov::parse(&text).map_err(|e| params.error("aovs", e).error())?;
    if !left_out.is_empty() {
        let found = params.error("aovs", format!("these layers are left out: {}", left_out.join(", ")));
        params.note(found.help(format!("known here: {}", AovKind::names().join(", "))).warning());
    }
    Ok(layers)
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
    params.without_effect(&["seed", "jitter", "strength", "dimension", "scramble"]);
    if !SAMPLERS.contains(&params.plugin()) {
        let found = params.type_fault(format!("the sampler `{}` is not known", shorten(params.plugin())));
        params.note(found.help("only its sample_count is used").advice());
    }
    let count = params.integer("sample_count")?;
    if count.is_some_and(|n| !(1..=1 << 40).contains(&n)) {
        return Err(params.error("sample_count", "a sample count is above 0 and not above 2^40").error());
    }
    reader.finish(params);
    Ok(count.map(|n| n as u64))
}
