//! Surfaces between mirror and matt.

use crate::scene::desc::{BsdfDesc, Facets, Roughness};

use super::entry::{Entry, by, possible};
use super::kinds::{strip, varnish};

pub(super) const ENTRY: Entry = Entry {
    name: "glossy",
    at_run_time: "the material that is met, one match per vertex (Bsdf::sample, Bsdf::eval)",
    find: |used, _| {
        by(used.material(BsdfDesc::is_glossy), "is rough", "nothing is between a mirror and matt")
    },
    refusal: possible,
    // Black rough metal and glass; rough coats without shine.
    without: |desc| strip(desc, BsdfDesc::is_glossy),
    with: |desc| varnish(desc, Some(Roughness { facets: Facets::Ggx, alpha: [0.1; 2] })),
};
