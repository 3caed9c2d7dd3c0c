//! Surfaces with a single direction of reflection or refraction.

use crate::scene::desc::BsdfDesc;

use super::entry::{Entry, by, possible};
use super::kinds::{strip, varnish};

pub(super) const ENTRY: Entry = Entry {
    name: "deltas",
    at_run_time: "the material that is met, one match per vertex (Bsdf::sample)",
    find: |used, _| {
        by(
            used.material(BsdfDesc::is_delta),
            "has a single direction of reflection or refraction",
            "every surface spreads light",
        )
    },
    refusal: possible,
    // Black mirrors and clear glass; smooth coats without shine.
    without: |desc| strip(desc, BsdfDesc::is_delta),
    with: |desc| varnish(desc, None),
};
