//! The effects that lights, the camera and the method call for.

use crate::scene::desc::{BsdfDesc, IntegratorKind, LightDesc, PhotonUse, Place, ProjectionDesc, SceneDesc};
use crate::spectrum::Spectrum;

use super::entry::{Entry, never};
use super::used::{Used, by, known};

pub(super) const LIGHT_STREAM: Entry = Entry {
    name: "light-stream",
    at_run_time: "the method: its code asks for light samples or does not",
    find: |_, kind| match kind.streams() {
        [_, true] => Ok((format!("{} shows light paths to the camera", kind.traits().title), None)),
        [_, false] => Err("the method shows camera paths only"),
    },
    refusal: |_| Some("which streams there are is the method's: choose --integrator path or light"),
    without: |_| (),
    with: |desc| {
        desc.integrator.kind = IntegratorKind::Bidirectional;
        true
    },
};

pub(super) const ENVIRONMENT: Entry = Entry {
    name: "environment",
    at_run_time: "whether the prepared scene has such a light, where a ray leaves it (Lights::environment)",
    find: |used, _| {
        let light = used.environment().ok_or("no light comes from all around")?;
        Ok((format!("{}: light from all around", light.plugin()), known(light.place())))
    },
    refusal: never,
    // Lights in the scene only. What is all around stays where it is and gives no light, so that the scene need not be prepared anew.
    without: |desc| {
        let around = desc.lights.iter_mut().filter(|light| light.is_environment());
        around.for_each(|light| *light.spectrum_mut() = Spectrum::Constant(0.0));
    },
    // A dim sky: how bright it is does not change what it costs.
    with: |desc| {
        desc.lights.push(LightDesc::Constant { radiance: Spectrum::d65(1e-2), place: Place::default() });
        true
    },
};

pub(super) const LIGHT_CHOICE: Entry = Entry {
    name: "light-choice",
    at_run_time: "how many lights the prepared scene has: one, few that are all evaluated, or a tree (LightSelector)",
    find: |used, _| {
        let mut all = used.emitters();
        match (all.next(), all.next()) {
            (Some(_), Some((_, second))) => Ok((format!("{} objects emit", 2 + all.count()), second)),
            (Some((_, place)), None) if used.faces() > 1 => {
                Ok((format!("the object that emits has {} faces", used.faces()), place))
            }
            (Some(_), None) => Err("one object emits"),
            (None, _) => Err("nothing emits"),
        }
    },
    refusal: |_| Some("a light is chosen where there are several: leave the others out of the scene"),
    without: |_| (),
    // One lamp more.
    with: |desc| {
        let (position, intensity) = (desc.camera.to_world.translation, Spectrum::d65(1e-2));
        desc.lights.push(LightDesc::Point { position, intensity, place: Place::default() });
        desc.lights.len() + desc.shapes.iter().filter(|shape| shape.emission.is_some()).count() > 1
    },
};

pub(super) const LENS: Entry = Entry {
    name: "lens",
    at_run_time: "the radius of the prepared camera's lens, once per camera path (Camera::ray)",
    find: |used, _| {
        let camera = &used.desc.camera;
        let words = || format!("the lens has a radius of {}", camera.lens_radius());
        match (&camera.projection, camera.lens_radius() > 0.0) {
            (ProjectionDesc::Orthographic, _) => Err("the rays of the camera are parallel"),
            (ProjectionDesc::Perspective(_), true) => Ok((words(), known(camera.place))),
            (ProjectionDesc::Perspective(_), false) => Err("the camera is a pinhole"),
            _ => Err("the camera has no thin lens"),
        }
    },
    refusal: never,
    without: |desc| desc.camera = desc.camera.clone().with_lens_radius(0.0),
    // At f/50 of what is in focus; where the focus is does not change what it costs.
    with: |desc| {
        let Some(perspective) = desc.camera.perspective_mut() else { return false };
        let lens = &mut perspective.lens;
        if !(lens.focus_distance.is_normal() && lens.focus_distance > 0.0) {
            lens.focus_distance = 1.0;
        }
        lens.radius = 0.01 * lens.focus_distance;
        true
    },
};

pub(super) const CAUSTIC_PHOTONS: Entry = Entry {
    name: "caustic-photons",
    at_run_time: "the method; photons are kept where they land on something matt (PhotonDesc::caustics)",
    find: |used, kind| {
        photons(kind.has_photons(), used.desc.integrator.photons.caustics)?;
        if let Some(beam) = used.beam() {
            return by(Some(beam), "sends light that photons alone find", "");
        }
        by(used.material(BsdfDesc::is_specular), "may focus light", "nothing mirrors or refracts light")
    },
    refusal: |kind| match kind.traits().photons {
        PhotonUse::Merged => None,
        PhotonUse::None | PhotonUse::Gathered => without_photons(kind),
    },
    without: |desc| desc.integrator.photons.caustics = false,
    with: |desc| map_photons(desc, BsdfDesc::is_specular),
};

pub(super) const GATHER: Entry = Entry {
    name: "gather",
    at_run_time: "the method; rays are sent out where a path is first spread (PhotonDesc::gather)",
    find: |used, kind| {
        photons(kind.traits().photons == PhotonUse::Gathered, used.desc.integrator.photons.gather)?;
        by(used.material(BsdfDesc::is_diffuse), "spreads light", "nothing has a diffuse part")
    },
    refusal: without_photons,
    without: |desc| desc.integrator.photons.gather = false,
    with: |desc| map_photons(desc, BsdfDesc::is_diffuse),
};

/// Says why photons of one sort have no part, where the method has none or the user has forced them off.
fn photons(has: bool, wanted: bool) -> Result<(), &'static str> {
    match (has, wanted) {
        (true, true) => Ok(()),
        (true, false) => Err("forced off"),
        (false, _) => Err("the method has no photons of this sort"),
    }
}

/// The refusal of an effect that only photon mapping has. `Auto` may turn out to be photon mapping.
fn without_photons(kind: IntegratorKind) -> Option<&'static str> {
    let may_be = kind.traits().photons == PhotonUse::Gathered || kind == IntegratorKind::Auto;
    (!may_be).then_some("only photon mapping has photons: choose --integrator photon")
}

/// Traces by photon mapping; false where no material is such that photons of this sort arise.
fn map_photons(desc: &mut SceneDesc, is: fn(&BsdfDesc) -> bool) -> bool {
    desc.integrator.kind = IntegratorKind::Photon;
    Used::of(desc).material(is).is_some()
}
