//! Surfaces between mirror and matt.

use crate::scene::SceneDesc;
use crate::scene::desc::{BsdfDesc, Facets, Roughness};
use crate::spectrum::Spectrum;
use crate::spectrum::dispersion::Ior;

use super::entry::{Entry, by, possible};
use super::kinds::{BLACK, is_glossy, matt, shown};

pub(super) const ENTRY: Entry = Entry {
    name: "glossy",
    at_run_time: "the material that is met, one match per vertex (Bsdf::sample, Bsdf::eval)",
    find: |used, _| by(used.material(is_glossy), "is rough", "nothing is between a mirror and matt"),
    refusal: possible,
    without,
    with: |desc| shown(desc, |b| matches!(b, BsdfDesc::Diffuse { .. })).map(coat).is_some(),
};

/// Black rough metal and glass; rough coats without shine.
fn without(desc: &mut SceneDesc) {
    desc.bsdfs.iter_mut().filter(|bsdf| is_glossy(bsdf)).for_each(|bsdf| match bsdf {
        BsdfDesc::RoughPlastic { diffuse_reflectance, .. } => *bsdf = matt(diffuse_reflectance),
        _ => *bsdf = BLACK,
    });
}

/// Varnishes what is matt, unevenly.
fn coat(bsdf: &mut BsdfDesc) {
    if let BsdfDesc::Diffuse { reflectance } = bsdf {
        *bsdf = BsdfDesc::RoughPlastic {
            int_ior: Ior::Constant(1.5),
            ext_ior: Ior::Constant(1.0),
            diffuse_reflectance: reflectance.clone(),
            specular_reflectance: Spectrum::Constant(1.0),
            nonlinear: false,
            roughness: Roughness { facets: Facets::Ggx, alpha: [0.1; 2] },
        };
    }
}
