//! Glass whose index depends on the wavelength: colours part where light goes through.

use glam::Vec4;

use crate::scene::SceneDesc;
use crate::scene::desc::BsdfDesc;
use crate::spectrum::dispersion::{Ior, SODIUM_D};

use super::entry::{Entry, by, possible};
use super::kinds::{disperses, shown};

pub(super) const ENTRY: Entry = Entry {
    name: "dispersion",
    at_run_time: "the indices at a path's wavelengths, where it meets glass (Bsdf::parts_colors)",
    find: |used, _| {
        by(
            used.material(disperses),
            "has an index that depends on the wavelength",
            "no transparent material has an index that depends on the wavelength",
        )
    },
    refusal: possible,
    without,
    with: |desc| {
        let inside = shown(desc, BsdfDesc::transmits).and_then(|bsdf| bsdf.parts_mut().int_ior);
        inside.map(|index| *index = crown(index)).is_some()
    },
};

/// Indices at the sodium line.
fn without(desc: &mut SceneDesc) {
    for bsdf in desc.bsdfs.iter_mut().filter(|bsdf| disperses(bsdf)) {
        let parts = bsdf.parts_mut();
        [parts.int_ior, parts.ext_ior].into_iter().flatten().for_each(at_sodium);
    }
}

pub(super) fn at_sodium(ior: &mut Ior) {
    *ior = Ior::Constant(ior.eval(Vec4::splat(SODIUM_D)).x);
}

/// As heavy at the sodium line, and dispersive as a crown glass is (b of N-BK7 by Cauchy's law).
fn crown(ior: &Ior) -> Ior {
    let b = 0.0042;
    Ior::Cauchy { a: ior.eval(Vec4::splat(SODIUM_D)).x - b / (SODIUM_D * 1e-3).powi(2), b }
}
