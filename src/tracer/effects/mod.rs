//! The effects of the tracer, and the plan of a scene: which of them it calls for, and why. Everything is decided here,
//! except for what the user forces off (`--effects -NAME`, applied to the description by `render/load.rs` before).
//!
//! ```text
//! mod        what an effect is; the plan of a scene (decide); the scene as planned
//! entry      what the table says of each effect
//! used       the materials and lights that take part in a scene
//! materials  the effects that materials and meshes call for
//! media      the effects that participating media call for
//! methods    the effects that lights, the camera and the method call for
//! ```
//!
//! The plan is made whenever a scene is prepared or edited, before anything is traced. [`decide`] asks every effect whether the scene calls for it
//! ([`Decision`] has the object that does, and its line). [`planned`] takes out of the description what nothing calls for
//! ([`without`]), and [`Scene::prepare`](crate::tracer::Scene::prepare) prepares what is left. So an effect that is
//! off costs nothing: there is no texture, lobe or light to evaluate, and [`material_class`] picks code that has no branch for it.
//! `--check-plan` traces paths without the plan too and compares. The client's half is `client/effect_list.rs`; `render/effect_plan.rs` joins the
//! two.
//!
//! # Adding an effect
//!
//! 1. An `Entry` (`entry.rs`) in `materials.rs` or `methods.rs`: its name, what decides it while paths are traced, what in a scene calls for it,
//!    why it cannot be left out of a method, and how it is taken out of a description and put into one. `LENS` is a short example.
//! 2. One line in the table below. The command line (`--effects`), `explain`, the window's panel and the study then know it.
//! 3. A scene that calls for it and one that does not in `tests/tracer/effects_plan.rs`. `effects_check.rs` there generates scenes of all
//!    effects and compares them with and without the plan.

mod entry;
mod materials;
mod media;
mod methods;
mod used;

use crate::scene::SceneDesc;
use crate::scene::desc::{IntegratorKind, Place};
use crate::spectrum::White;
use crate::tracer::scene::MaterialClass;

pub(in crate::tracer) use materials::at_sodium;

use entry::Entry;
use used::Used;

macro_rules! table {
    ($($(#[$doc:meta])* $effect:ident = $entry:path,)*) => {
        /// Something that paths simulate where a scene calls for it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        pub enum Effect {
            $($(#[$doc])* $effect,)*
        }

        impl Effect {
            /// All of them, in the order of a table.
            pub const ALL: [Effect; [$(Effect::$effect),*].len()] = [$(Effect::$effect),*];

            fn entry(self) -> &'static Entry {
                match self {
                    $(Effect::$effect => &$entry,)*
                }
            }
        }
    };
}

table! {
    /// Samples that add up on the picture, from light paths.
    LightStream = methods::LIGHT_STREAM,
    /// Four wavelengths to a path; without it, all that the scene holds has one colour.
    Wavelengths = materials::WAVELENGTHS,
    /// Glass whose index depends on the wavelength: colours part where light goes through.
    Dispersion = materials::DISPERSION,
    /// Surfaces that let light through.
    Transmission = materials::TRANSMISSION,
    /// Surfaces with a single direction of reflection or refraction: mirrors, clear glass, smooth coats.
    Deltas = materials::DELTAS,
    /// Surfaces between mirror and matt: rough metal, rough glass, rough coats.
    Glossy = materials::GLOSSY,
    /// Light from infinitely far, all around.
    Environment = methods::ENVIRONMENT,
    /// A choice between lights: which one a point asks.
    LightChoice = methods::LIGHT_CHOICE,
    /// A lens that blurs what is not in focus.
    Lens = methods::LENS,
    /// Normals that are interpolated between the corners of triangles: a mesh of facets that looks round.
    SmoothNormals = materials::SMOOTH_NORMALS,
    /// Surfaces that are not all there: rays go straight on where they meet nothing.
    Opacity = materials::OPACITY,
    /// Reflectances and other values that vary over a surface: pictures and checkerboards.
    Textures = materials::TEXTURES,
    /// Normals that pictures tilt: normal maps and bump maps.
    Bump = materials::BUMP,
    /// Participating media: fog, smoke, milk.
    Media = media::MEDIA,
    /// Media whose coefficients vary in space: smoke, clouds.
    GridMedia = media::GRID_MEDIA,
    /// Media whose extinction depends on the wavelength: colours part along a path.
    ChromaticMedia = media::CHROMATIC_MEDIA,
    /// Media that emit light: fire, plasma.
    EmissiveMedia = media::EMISSIVE_MEDIA,
    /// Photons that have met mirrors, glass or coats only, looked up where they are seen.
    CausticPhotons = methods::CAUSTIC_PHOTONS,
    /// All other photons, of light that was spread before: gathered from one bounce away.
    Gather = methods::GATHER,
}

impl Effect {
    /// The effect of this name.
    pub fn named(name: &str) -> Option<Effect> {
        Effect::ALL.into_iter().find(|effect| effect.name() == name)
    }

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// The decision that remains while paths are traced; for the user.
    pub fn at_run_time(self) -> &'static str {
        self.entry().at_run_time
    }
}

/// Takes `effect` out of `desc`. The entry of the effect says what is left instead. Changes nothing where it is off.
/// It fails with the [`refusal`] of the effect.
pub fn without(desc: &mut SceneDesc, effect: Effect) -> Result<(), &'static str> {
    refusal(effect, desc.integrator.kind).map_or(Ok(()), Err)?;
    (effect.entry().without)(desc);
    Ok(())
}

/// Why an effect cannot be left out of what is traced by `kind`: a sentence that says what to do instead.
pub fn refusal(effect: Effect, kind: IntegratorKind) -> Option<&'static str> {
    (effect.entry().refusal)(kind)
}

/// Forces `effect` to take part in `desc` although nothing calls for it.
///
/// # Errors
///
/// If there is nothing to simulate, with what to do instead.
pub fn force_on(desc: &mut SceneDesc, effect: Effect) -> Result<(), &'static str> {
    match effect {
        Effect::Wavelengths => {
            desc.integrator.spectral = true;
            Ok(())
        }
        Effect::Media if desc.names_media() => {
            desc.integrator.surfaces_only = false;
            Ok(())
        }
        Effect::LightStream => Err("choose --integrator bidirectional or light"),
        Effect::CausticPhotons | Effect::Gather => Err("choose --integrator photon"),
        Effect::Lens => Err("give the scene's camera an aperture: <sensor type=\"thinlens\">"),
        _ => Err("put something into the scene that calls for it"),
    }
}

/// Puts a small example of `effect` into `desc`, to measure its cost. False if nothing in the scene can carry it.
pub fn with(desc: &mut SceneDesc, effect: Effect) -> bool {
    (effect.entry().with)(desc)
}

/// The decision about one effect.
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// The effect.
    pub effect: Effect,
    /// True if it is simulated.
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

/// `desc` without the effects that its plan calls off: what is traced. A right plan leaves the picture as it is, bit for bit, and
/// `--check-plan` finds a wrong one. Effects that depend on the method are left to the method.
pub fn planned(desc: &SceneDesc) -> SceneDesc {
    let mut planned = desc.clone();
    for decision in decide(desc, IntegratorKind::Path) {
        if !decision.on && refusal(decision.effect, IntegratorKind::Path).is_none() {
            (decision.effect.entry().without)(&mut planned);
        }
    }
    planned
}

/// The class of the materials of a planned scene.
pub fn material_class(desc: &SceneDesc) -> MaterialClass {
    let used = Used::of(desc);
    let has = |effect: Effect| (effect.entry().find)(&used, IntegratorKind::Path).is_ok();
    match (has(Effect::Glossy), has(Effect::Deltas)) {
        _ if desc.has_media() => MaterialClass::InMedia,
        _ if used.mixes() => MaterialClass::Mixed,
        _ if used.other_diffuse() => MaterialClass::General,
        (true, _) => MaterialClass::General,
        (false, true) => MaterialClass::Specular,
        (false, false) => MaterialClass::Diffuse,
    }
}

/// The one white of a scene in which nothing has a colour: all values along a path are in proportion to its spectrum.
/// `None` where [`Effect::Wavelengths`] is on, and without light.
pub fn white(desc: &SceneDesc) -> Option<White> {
    let white = materials::colors(&Used::of(desc)).err()?;
    white.filter(|_| !desc.integrator.spectral)
}
