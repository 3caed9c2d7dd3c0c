//! The plan of a scene: which features are on, and why; and the scene as planned.

use crate::scene::SceneDesc;
use crate::scene::desc::{IntegratorKind, Place};
use crate::spectrum::White;

use super::used::Used;
use super::{Feature, refusal, wavelengths};
use crate::tracer::scene::Finish;

/// What is decided about one feature.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// Which.
    pub feature: Feature,
    /// It is simulated.
    pub on: bool,
    /// The object that calls for it, or why nothing does.
    pub reason: String,
    /// Where that object stands in the file.
    pub place: Option<Place>,
}

/// Decides all of [`Feature::ALL`], in their order, for a scene that is traced by `kind` (`Auto` counts as `Path`).
///
/// A pure function: what is decided depends on nothing that happens while paths are traced.
pub fn decide(desc: &SceneDesc, kind: IntegratorKind) -> Vec<Decision> {
    let used = Used::of(desc);
    let of = |feature: Feature| {
        let (on, (reason, place)) = match (feature.entry().find)(&used, kind) {
            Ok(found) => (true, found),
            Err(why_not) => (false, (why_not.to_string(), None)),
        };
        Decision { feature, on, reason, place }
    };
    Feature::ALL.map(of).into()
}

/// `desc` without everything that its plan calls off: what is traced. A right plan leaves the picture as it is, bit for bit, and
/// `--check-plan` finds one that is not right. What depends on the method is left to the method.
pub fn planned(desc: &SceneDesc) -> SceneDesc {
    let mut planned = desc.clone();
    for decision in decide(desc, IntegratorKind::Path) {
        if !decision.on && refusal(decision.feature, IntegratorKind::Path).is_none() {
            (decision.feature.entry().without)(&mut planned);
        }
    }
    planned
}

/// Which materials the surfaces of a planned scene are of.
pub fn finish(desc: &SceneDesc) -> Finish {
    let used = Used::of(desc);
    let has = |feature: Feature| (feature.entry().find)(&used, IntegratorKind::Path).is_ok();
    match (has(Feature::Glossy), has(Feature::Deltas)) {
        (true, _) => Finish::Any,
        (false, true) => Finish::Smooth,
        (false, false) => Finish::Matt,
    }
}

/// The one white of a scene in which nothing has a colour: all values along a path are in proportion to its spectrum.
/// `None` where [`Feature::Wavelengths`] is on, and without light.
pub fn white(desc: &SceneDesc) -> Option<White> {
    let white = wavelengths::colors(&Used::of(desc)).err()?;
    white.filter(|_| !desc.integrator.spectral)
}
