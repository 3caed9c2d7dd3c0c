//! Photons of light that was spread before, gathered from one bounce away.

use crate::scene::desc::{BsdfDesc, IntegratorKind};

use super::entry::{Entry, by, of_photons};

pub(super) const ENTRY: Entry = Entry {
    name: "gather",
    at_run_time: "the method; rays are sent out where a path is first spread (PhotonDesc::gather)",
    find: |used, kind| match kind {
        IntegratorKind::Photon if !used.desc.integrator.photons.gather => Err("forced off"),
        IntegratorKind::Photon => {
            by(used.material(BsdfDesc::is_diffuse), "spreads light", "nothing has a diffuse part")
        }
        _ => Err("the method has no photons"),
    },
    refusal: of_photons,
    // Without light that was spread before.
    without: |desc| desc.integrator.photons.gather = false,
    with: |desc| {
        desc.integrator.kind = IntegratorKind::Photon;
        super::used::Used::of(desc).material(BsdfDesc::is_diffuse).is_some()
    },
};
