//! Surfaces with a single direction of reflection or refraction.

use crate::scene::SceneDesc;
use crate::scene::desc::BsdfDesc;
use crate::spectrum::Spectrum;
use crate::spectrum::dispersion::Ior;

use super::entry::{Entry, by, possible};
use super::kinds::{BLACK, is_delta, matt, shown};

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
    without,
    with: |desc| shown(desc, |b| matches!(b, BsdfDesc::Diffuse { .. })).map(coat).is_some(),
};

/// Black mirrors and clear glass; smooth coats without shine.
fn without(desc: &mut SceneDesc) {
    desc.bsdfs.iter_mut().filter(|bsdf| is_delta(bsdf)).for_each(|bsdf| match bsdf {
        BsdfDesc::Plastic { diffuse_reflectance, .. } => *bsdf = matt(diffuse_reflectance),
        _ => *bsdf = BLACK,
    });
}

/// Varnishes what is matt.
fn coat(bsdf: &mut BsdfDesc) {
    if let BsdfDesc::Diffuse { reflectance } = bsdf {
        *bsdf = BsdfDesc::Plastic {
            int_ior: Ior::Constant(1.5),
            ext_ior: Ior::Constant(1.0),
            diffuse_reflectance: reflectance.clone(),
            specular_reflectance: Spectrum::Constant(1.0),
            nonlinear: false,
        };
    }
}
