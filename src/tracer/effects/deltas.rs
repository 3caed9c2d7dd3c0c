//! Surfaces with a single direction of reflection or refraction.

use super::entry::{Entry, by, possible};
use super::kinds::{is_delta, strip, varnish};

pub(super) const ENTRY: Entry = Entry {
    name: "deltas",
    at_run_time: "the material that is met, one match per vertex (Bsdf::sample)",
    find: |used, _| {
        by(
            used.material(is_delta),
            "has a single direction of reflection or refraction",
            "every surface spreads light",
        )
    },
    refusal: possible,
    // Black mirrors and clear glass; smooth coats without shine.
    without: |desc| strip(desc, is_delta),
    with: |desc| varnish(desc, None),
};
