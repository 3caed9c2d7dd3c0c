//! What a scene calls for, on the tracer's side: the one place that decides it.
//!
//! ```text
//! mod     the table of effects, one file each
//! entry   what such a file says: when it takes part and why, what decides it at run time, a scene without it, a scene with it
//! used    the materials and lights that take part in a scene
//! kinds   what kind each material is
//! decide  the plan of a scene; the scene as planned
//! ```
//!
//! [`Scene::prepare`](crate::tracer::Scene::prepare) makes ready what [`planned`] leaves: what the plan calls off is not there any
//! more. The client's half is `client/effect_list.rs`; `app/plan.rs` joins the two. A new effect is a line of the table below, a file
//! beside this one, and a test.

mod decide;
mod entry;
mod kinds;
mod used;

mod caustic_photons;
mod deltas;
mod dispersion;
mod environment;
mod gather;
mod glossy;
mod lens;
mod light_choice;
mod light_stream;
mod smooth_normals;
mod transmission;
mod wavelengths;

pub use decide::{Decision, decide, material_class, planned, white};

use crate::scene::SceneDesc;
use crate::scene::desc::IntegratorKind;
use entry::Entry;

macro_rules! table {
    ($($(#[$doc:meta])* $effect:ident = $file:ident,)*) => {
        /// Something that paths may have to deal with.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Effect {
            $($(#[$doc])* $effect,)*
        }

        impl Effect {
            /// All of them, in the order of a table.
            pub const ALL: [Effect; [$(Effect::$effect),*].len()] = [$(Effect::$effect),*];

            fn entry(self) -> &'static Entry {
                match self {
                    $(Effect::$effect => &$file::ENTRY,)*
                }
            }
        }
    };
}

table! {
    /// Samples that add up on the picture, from light paths.
    LightStream = light_stream,
    /// Four wavelengths to a path; without it, all that the scene holds has one colour.
    Wavelengths = wavelengths,
    /// Glass whose index depends on the wavelength.
    Dispersion = dispersion,
    /// Surfaces that let light through.
    Transmission = transmission,
    /// Mirrors, clear glass, smooth coats.
    Deltas = deltas,
    /// Rough metal, rough glass, rough coats.
    Glossy = glossy,
    /// Light from infinitely far.
    Environment = environment,
    /// A choice between lights.
    LightChoice = light_choice,
    /// A lens that blurs what is not in focus.
    Lens = lens,
    /// Normals that are interpolated over triangles.
    SmoothNormals = smooth_normals,
    /// Photons that have met mirrors, glass or coats only, looked up where they are seen.
    CausticPhotons = caustic_photons,
    /// All other photons, gathered from one bounce away.
    Gather = gather,
}

impl Effect {
    /// The effect of this name.
    pub fn named(name: &str) -> Option<Effect> {
        Effect::ALL.into_iter().find(|effect| effect.name() == name)
    }

    /// What it is called on the command line and in files.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// What decides it while paths are traced.
    pub fn at_run_time(self) -> &'static str {
        self.entry().at_run_time
    }
}

/// Takes `effect` out of `desc`; what is left instead stands in the file of the effect. Changes nothing where it is off.
///
/// # Errors
///
/// As [`refusal`].
pub fn without(desc: &mut SceneDesc, effect: Effect) -> Result<(), &'static str> {
    match refusal(effect, desc.integrator.kind) {
        Some(advice) => Err(advice),
        None => {
            (effect.entry().without)(desc);
            Ok(())
        }
    }
}

/// Why an effect cannot be left out of what is traced by `kind`: a sentence that says what to do instead.
pub fn refusal(effect: Effect, kind: IntegratorKind) -> Option<&'static str> {
    (effect.entry().refusal)(kind)
}

/// Has `effect` take part in `desc` although nothing calls for it.
///
/// # Errors
///
/// Where there is nothing to simulate: what to do instead.
pub fn force_on(desc: &mut SceneDesc, effect: Effect) -> Result<(), &'static str> {
    match effect {
        Effect::Wavelengths => {
            desc.integrator.spectral = true;
            Ok(())
        }
        Effect::LightStream => Err("choose --integrator bidirectional or light"),
        Effect::CausticPhotons | Effect::Gather => Err("choose --integrator photon"),
        Effect::Lens => Err("give the scene's camera an aperture: <sensor type=\"thinlens\">"),
        _ => Err("put something into the scene that calls for it"),
    }
}

/// Puts a small example of `effect` into `desc`, to see what it costs. False where nothing can carry it.
pub fn with(desc: &mut SceneDesc, effect: Effect) -> bool {
    (effect.entry().with)(desc)
}
