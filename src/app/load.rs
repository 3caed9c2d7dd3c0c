//! The scene of a command line: the file, with what the options say about it.

use miette::Result;

use super::args::scene::SceneArgs;
use crate::scene::desc::IntegratorKind;
use crate::scene::{self, Loaded};
use crate::tracer::features;

/// Reads the scene; size, method and effects that are forced off are those of the command line.
///
/// # Errors
///
/// Whatever is wrong with the file, and what cannot be forced off.
pub fn load(source: &SceneArgs) -> Result<Loaded> {
    let mut loaded = scene::load(&source.scene, &source.defines)?;
    let desc = &mut loaded.desc;
    if let Some((width, height)) = source.size {
        (desc.film.width, desc.film.height) = (width, height);
        desc.film.crop = None;
    }
    desc.integrator.kind = source.integrator.map_or(desc.integrator.kind, IntegratorKind::from);
    for forced in source.effects.iter().filter(|forced| !forced.on) {
        features::without(desc, forced.feature).map_err(|advice| {
            miette::miette!(help = advice, "--effects -{} is not possible here", forced.feature.name())
        })?;
    }
    Ok(loaded)
}
