//! Photons that have met mirrors, glass or coats only, looked up where they are seen.

use crate::scene::desc::{BsdfDesc, IntegratorKind};

use super::entry::{Entry, by, of_photons};

pub(super) const ENTRY: Entry = Entry {
    name: "caustic-photons",
    at_run_time: "the method; photons are kept where they land on something matt (PhotonDesc::caustics)",
    find: |used, kind| match kind {
        IntegratorKind::Photon if !used.desc.integrator.photons.caustics => Err("forced off"),
        IntegratorKind::Photon => {
            by(used.material(BsdfDesc::is_specular), "may focus light", "nothing mirrors or refracts light")
        }
        _ => Err("the method has no photons"),
    },
    refusal: of_photons,
    // Without what mirrors and glass focus.
    without: |desc| desc.integrator.photons.caustics = false,
    with: |desc| {
        desc.integrator.kind = IntegratorKind::Photon;
        super::used::Used::of(desc).material(BsdfDesc::is_specular).is_some()
    },
};
