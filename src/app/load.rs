//! The scene of a command line: the file, with what the options say about it.

use miette::Result;

use super::args::effects::{Forced, last_of_each};
use super::args::scene::SceneArgs;
use super::tell;
use crate::scene::desc::{IntegratorKind, SceneDesc};
use crate::scene::{self, Loaded};
use crate::tracer::features::{Feature, decide, force_on, refusal, without};

/// What is traced.
pub struct Input {
    /// The scene, after all that is forced.
    pub loaded: Loaded,
    /// What was forced on and off against what the scene calls for.
    pub forced: Vec<Forced>,
}

/// Reads the scene; size and method are those of the command line.
///
/// # Errors
///
/// Whatever is wrong with the file.
pub fn read(source: &SceneArgs) -> Result<Loaded> {
    let mut loaded = scene::load(&source.scene, &source.defines)?;
    let desc = &mut loaded.desc;
    if let Some((width, height)) = source.size {
        (desc.film.width, desc.film.height) = (width, height);
        desc.film.crop = None;
    }
    desc.integrator.kind = source.integrator.map_or(desc.integrator.kind, IntegratorKind::from);
    Ok(loaded)
}

/// Reads the scene and forces on and off what the command line says.
///
/// # Errors
///
/// As [`read`], and what cannot be forced.
pub fn load(source: &SceneArgs) -> Result<Input> {
    let mut loaded = read(source)?;
    let forced = forced(&loaded.desc, source)?;
    forced.iter().try_for_each(|forced| force(&mut loaded.desc, *forced))?;
    Ok(Input { loaded, forced })
}

/// What the command line forces on and off that is not so already; the rest is told of, since it changes nothing.
///
/// # Errors
///
/// What cannot be forced.
pub fn forced(desc: &SceneDesc, source: &SceneArgs) -> Result<Vec<Forced>> {
    let kind = desc.integrator.kind;
    let plan = decide(desc, kind);
    let mut effective = Vec::new();
    for forced in last_of_each(&source.effects) {
        let Some(decision) = plan.iter().find(|decision| decision.feature == forced.feature) else {
            continue;
        };
        let open = kind == IntegratorKind::Auto && refusal(forced.feature, IntegratorKind::Path).is_some();
        if forced.on == decision.on && !open {
            tell(&format!("note: --effects {forced} changes nothing: {}", decision.reason));
            continue;
        }
        force(&mut desc.clone(), forced)?;
        effective.push(forced);
    }
    Ok(effective)
}

/// Forces one effect.
///
/// # Errors
///
/// When that is not possible.
pub fn force(desc: &mut SceneDesc, forced: Forced) -> Result<()> {
    let forcing: fn(&mut SceneDesc, Feature) -> Result<(), &'static str> =
        if forced.on { force_on } else { without };
    let impossible =
        |advice: &str| miette::miette!(help = advice.to_string(), "--effects {forced} is not possible here");
    forcing(desc, forced.feature).map_err(impossible)
}
