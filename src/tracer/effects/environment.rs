//! Light from infinitely far, all around.

use crate::scene::SceneDesc;
use crate::scene::desc::{LightDesc, Place};
use crate::spectrum::Spectrum;

use super::entry::{Entry, possible};
use super::used::known;

pub(super) const ENTRY: Entry = Entry {
    name: "environment",
    at_run_time: "whether the prepared scene has such a light, where a ray leaves it (Lights::environment)",
    find: |used, _| match used.environment() {
        Some(light @ LightDesc::Map { .. }) => {
            Ok(("envmap: light from all around".to_string(), known(light.place())))
        }
        Some(light) => Ok(("constant: light from all around".to_string(), known(light.place()))),
        None => Err("no light is infinitely far"),
    },
    refusal: possible,
    without,
    // A dim sky: how bright it is does not change what it costs.
    with: |desc| {
        desc.lights.push(LightDesc::Constant { radiance: Spectrum::d65(1e-2), place: Place::default() });
        true
    },
};

/// Lights in the scene only. What is all around stays where it is and gives no light, so that the scene need not be prepared anew.
fn without(desc: &mut SceneDesc) {
    let around = desc.lights.iter_mut().filter(|light| light.is_environment());
    around.for_each(|light| *light.spectrum_mut() = Spectrum::Constant(0.0));
}
