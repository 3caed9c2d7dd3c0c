//! The plan of a scene: which effects are on, and why; and the scene as planned.

use crate::scene::SceneDesc;
use crate::scene::desc::{IntegratorKind, Place};
use crate::spectrum::White;

use super::used::Used;
use super::{Effect, refusal, wavelengths};
use crate::tracer::scene::MaterialClass;

/// What is decided about one effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// Which.
    pub effect: Effect,
    /// It is simulated.
    pub on: bool,
    /// The object that calls for it, or why nothing does.
    pub reason: String,
    /// Where that object stands in the file.
    pub place: Option<Place>,
}

/// Decides all of [`Effect::ALL`], in their order, for a scene that is traced by `kind` (`Auto` counts as `Path`).
///
/// A pure function: what is decided depends on nothing that happens while paths are traced.
pub fn decide(desc: &SceneDesc, kind: IntegratorKind) -> Vec<Decision> {
    let used = Used::of(desc);
    let of = |effect: Effect| {
        let (on, (reason, place)) = match (effect.entry().find)(&used, kind) {
            Ok(found) => (true, found),
            Err(why_not) => (false, (why_not.to_string(), None)),
        };
        Decision { effect, on, reason, place }
    };
    Effect::ALL.map(of).into()
}

/// `desc` without everything that its plan calls off: what is traced. A right plan leaves the picture as it is, bit for bit, and
/// `--check-plan` finds one that is not right. What depends on the method is left to the method.
pub fn planned(desc: &SceneDesc) -> SceneDesc {
    let mut planned = desc.clone();
    for decision in decide(desc, IntegratorKind::Path) {
        if !decision.on && refusal(decision.effect, IntegratorKind::Path).is_none() {
            (decision.effect.entry().without)(&mut planned);
        }
    }
    planned
}

/// Which materials the surfaces of a planned scene are of.
pub fn material_class(desc: &SceneDesc) -> MaterialClass {
    let used = Used::of(desc);
    let has = |effect: Effect| (effect.entry().find)(&used, IntegratorKind::Path).is_ok();
    match (has(Effect::Glossy), has(Effect::Deltas)) {
        (true, _) => MaterialClass::General,
        (false, true) => MaterialClass::Specular,
        (false, false) => MaterialClass::Diffuse,
    }
}

/// The one white of a scene in which nothing has a colour: all values along a path are in proportion to its spectrum.
/// `None` where [`Effect::Wavelengths`] is on, and without light.
pub fn white(desc: &SceneDesc) -> Option<White> {
    let white = wavelengths::colors(&Used::of(desc)).err()?;
    white.filter(|_| !desc.integrator.spectral)
}
