//! An entry of the table of effects.

use crate::scene::SceneDesc;
use crate::scene::desc::{IntegratorKind, Place};

use super::used::Used;

/// The table entry of an effect: when a scene calls for it and why, and how to make a scene without it and with it.
pub(super) struct Entry {
    /// Its name on the command line and in files.
    pub(super) name: &'static str,
    /// The decision that remains while paths are traced, and how often it is made; for the user.
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

/// The reason why a scene calls for an effect, or why it does not.
pub(super) type Found = Result<Reason, &'static str>;

/// The words that say what calls for an effect, and its place in the file.
pub(super) type Reason = (String, Option<Place>);

/// The refusal of an effect that can always be left out.
pub(super) fn never(_: IntegratorKind) -> Option<&'static str> {
    None
}
