//! A lens that blurs what is not in focus.

use super::entry::{Entry, possible};
use super::used::known;

pub(super) const ENTRY: Entry = Entry {
    name: "lens",
    at_run_time: "the radius of the prepared camera's lens, once per camera path (Camera::ray)",
    find: |used, _| {
        let camera = &used.desc.camera;
        let words = || format!("the lens has a radius of {}", camera.aperture_radius);
        (camera.aperture_radius > 0.0)
            .then(|| (words(), known(camera.place)))
            .ok_or("the camera is a pinhole")
    },
    refusal: possible,
    // A pinhole.
    without: |desc| desc.camera.aperture_radius = 0.0,
    // At f/50 of what is in focus; where the focus is does not change what it costs.
    with: |desc| {
        let camera = &mut desc.camera;
        if !(camera.focus_distance.is_normal() && camera.focus_distance > 0.0) {
            camera.focus_distance = 1.0;
        }
        camera.aperture_radius = 0.01 * camera.focus_distance;
        true
    },
};
