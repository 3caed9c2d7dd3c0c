//! A choice between lights: which one a point asks.

use crate::scene::desc::{IntegratorKind, LightDesc, Place};
use crate::spectrum::Spectrum;

use super::entry::{Entry, Found};
use super::used::Used;

pub(super) const ENTRY: Entry = Entry {
    name: "light-choice",
    at_run_time: "how many lights the prepared scene has: one, few that are all evaluated, or a tree (LightSelector)",
    find,
    refusal: |_| Some("a light is chosen where there are several: leave the others out of the scene"),
    without: |_| (),
    // One lamp more.
    with: |desc| {
        let position = desc.camera.to_world.translation;
        desc.lights.push(LightDesc::Point {
            position,
            intensity: Spectrum::d65(1e-2),
            place: Place::default(),
        });
        desc.lights.len() + desc.shapes.iter().filter(|shape| shape.emission.is_some()).count() > 1
    },
};

fn find(used: &Used, _: IntegratorKind) -> Found {
    let mut all = used.emitters();
    match (all.next(), all.next()) {
        (Some(_), Some((_, second))) => Ok((format!("{} objects emit", 2 + all.count()), second)),
        (Some((_, place)), None) if used.faces() > 1 => {
            Ok((format!("the object that emits has {} faces", used.faces()), place))
        }
        (Some(_), None) => Err("one object emits"),
        (None, _) => Err("nothing emits"),
    }
}
