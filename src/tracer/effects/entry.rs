//! What the plan knows of an effect.

use crate::scene::SceneDesc;
use crate::scene::desc::{IntegratorKind, Place};

use super::used::{Object, Used};

/// One effect of the tracer: its file holds one of these.
pub(super) struct Entry {
    /// What it is called on the command line and in files.
    pub(super) name: &'static str,
    /// What decides it while paths are traced, and how often.
    pub(super) at_run_time: &'static str,
    /// What calls for it, in a scene that is traced by this method.
    pub(super) find: fn(&Used, IntegratorKind) -> Found,
    /// Why it cannot be left out of what this method traces: a sentence that says what to do instead.
    pub(super) refusal: fn(IntegratorKind) -> Option<&'static str>,
    /// Takes it out of a description. Where nothing calls for it this changes nothing.
    pub(super) without: fn(&mut SceneDesc),
    /// Puts a small example into a description; false where nothing can carry it.
    pub(super) with: fn(&mut SceneDesc) -> bool,
}

/// What calls for an effect, or why nothing does.
pub(super) type Found = Result<Reason, &'static str>;

/// What calls for an effect, in words, and where it stands in the file.
pub(super) type Reason = (String, Option<Place>);

/// For what can always be left out.
pub(super) fn possible(_: IntegratorKind) -> Option<&'static str> {
    None
}

/// For what only photon mapping has. Which method `Auto` is stands not yet: it may be that one.
pub(super) fn of_photons(kind: IntegratorKind) -> Option<&'static str> {
    let may_be = matches!(kind, IntegratorKind::Photon | IntegratorKind::Auto);
    (!may_be).then_some("only photon mapping has photons: choose --integrator photon")
}

/// The object that calls for something and why, or why nothing does.
pub(super) fn by(object: Option<Object>, why: &str, why_not: &'static str) -> Found {
    let Object { name, place, others } = object.ok_or(why_not)?;
    let more = match others {
        0 => String::new(),
        n => format!(" ({n} more like it)"),
    };
    Ok((format!("{name} {why}{more}"), place))
}

/// The same words for all scenes.
pub(super) fn says(words: &str) -> Found {
    Ok((words.to_string(), None))
}
