//! What the file of an effect says: when it takes part and why, and a scene without it and with it.

use crate::scene::SceneDesc;
use crate::scene::desc::{IntegratorKind, Place};

use super::used::{Object, Used};

/// One effect of the tracer. Its file holds one of these.
pub(super) struct Entry {
    /// Its name on the command line and in files.
    pub(super) name: &'static str,
    /// What decides it while paths are traced, and how often.
    pub(super) at_run_time: &'static str,
    /// Finds what calls for it, in a scene that is traced by this method.
    pub(super) find: fn(&Used, IntegratorKind) -> Found,
    /// Says why it cannot be left out of what this method traces, and what to do instead.
    pub(super) refusal: fn(IntegratorKind) -> Option<&'static str>,
    /// Takes it out of a description. Changes nothing where nothing calls for it.
    pub(super) without: fn(&mut SceneDesc),
    /// Puts a small example into a description; false if nothing there can carry it.
    pub(super) with: fn(&mut SceneDesc) -> bool,
}

/// What calls for an effect, or why nothing does.
pub(super) type Found = Result<Reason, &'static str>;

/// The words that say what calls for an effect, and its place in the file.
pub(super) type Reason = (String, Option<Place>);

/// The refusal of an effect that can always be left out.
pub(super) fn possible(_: IntegratorKind) -> Option<&'static str> {
    None
}

/// The refusal of an effect that only photon mapping has. `Auto` may turn out to be photon mapping.
pub(super) fn of_photons(kind: IntegratorKind) -> Option<&'static str> {
    let may_be = matches!(kind, IntegratorKind::Photon | IntegratorKind::Auto);
    (!may_be).then_some("only photon mapping has photons: choose --integrator photon")
}

/// Says that `object` calls for an effect and why, or why nothing does.
pub(super) fn by(object: Option<Object>, why: &str, why_not: &'static str) -> Found {
    let Object { name, place, others } = object.ok_or(why_not)?;
    let more = match others {
        0 => String::new(),
        n => format!(" ({n} more like it)"),
    };
    Ok((format!("{name} {why}{more}"), place))
}

/// Says the same words for all scenes.
pub(super) fn says(words: &str) -> Found {
    Ok((words.to_string(), None))
}
