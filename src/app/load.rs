//! The scene of a command line: the file, with what the options say about it.

use miette::Result;

use super::args::scene::SceneArgs;
use crate::scene::desc::IntegratorKind;
use crate::scene::{self, Loaded};
use crate::tracer::features::{self, Feature};

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

/// Reads the scene and takes out of it what the command line forces off.
///
/// # Errors
///
/// As [`read`], and what cannot be forced off.
pub fn load(source: &SceneArgs) -> Result<Loaded> {
    let mut loaded = read(source)?;
    for forced in forced_off(source) {
        features::without(&mut loaded.desc, forced).map_err(|advice| impossible(forced, advice))?;
    }
    Ok(loaded)
}

/// The effects that the command line forces off.
pub fn forced_off(source: &SceneArgs) -> impl Iterator<Item = Feature> {
    source.effects.iter().filter(|forced| !forced.on).map(|forced| forced.feature)
}

/// What cannot be forced off, and what to do instead.
pub fn impossible(feature: Feature, advice: impl std::fmt::Display) -> miette::Report {
    miette::miette!(help = advice.to_string(), "--effects -{} is not possible here", feature.name())
}
