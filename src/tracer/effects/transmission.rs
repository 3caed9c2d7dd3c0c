//! Surfaces that let light through.

use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfDesc, DielectricDesc};
use crate::spectrum::Spectrum;
use crate::spectrum::dispersion::Ior;

use super::entry::{Entry, by, possible};
use super::kinds::shown;

pub(super) const ENTRY: Entry = Entry {
    name: "transmission",
    at_run_time: "the material that is met, one match per vertex (Bsdf::sample)",
    find: |used, _| {
        by(used.material(BsdfDesc::transmits), "lets light through", "nothing lets light through")
    },
    refusal: possible,
    without,
    // Clear glass in place of something that mirrors.
    with: |desc| shown(desc, BsdfDesc::is_specular).map(|bsdf| *bsdf = glass()).is_some(),
};

/// Glass that reflects and lets nothing through.
fn without(desc: &mut SceneDesc) {
    for factor in desc.bsdfs.iter_mut().filter_map(|bsdf| bsdf.parts_mut().transmission) {
        *factor = Spectrum::Constant(0.0);
    }
}

fn glass() -> BsdfDesc {
    BsdfDesc::Dielectric(DielectricDesc {
        int_ior: Ior::Constant(1.5),
        ext_ior: Ior::Constant(1.0),
        specular_reflectance: Spectrum::Constant(1.0),
        specular_transmittance: Spectrum::Constant(1.0),
    })
}
