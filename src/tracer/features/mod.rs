//! What a scene calls for, on the tracer's side: the one place that decides it.
//!
//! ```text
//! mod     the features
//! built   what this build holds
//! used    the materials and lights that take part in a scene
//! decide  which features are on, and why
//! force   a scene without one of them
//! ```
//!
//! The client's half is `client/decisions.rs`; `app/plan.rs` joins the two. A feature is an entry of [`Feature`], a line of
//! `decide`, and where it is simulated.

pub mod built;
mod decide;
mod force;
mod used;

pub use decide::{Decision, decide, white};
pub use force::{refusal, without};

/// Something that paths may have to deal with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// Samples that add up on the picture, from light paths.
    LightStream,
    /// Four wavelengths to a path; without it, all that the scene holds has one colour.
    Wavelengths,
    /// Glass whose index depends on the wavelength.
    Dispersion,
    /// Surfaces that let light through.
    Transmission,
    /// Mirrors, clear glass, smooth coats.
    Deltas,
    /// Rough metal, rough glass, rough coats.
    Glossy,
    /// Light from infinitely far.
    Environment,
    /// A choice between lights.
    LightChoice,
    /// A lens that blurs what is not in focus.
    Lens,
    /// Photons that have met mirrors, glass or coats only, looked up where they are seen.
    CausticPhotons,
    /// All other photons, gathered from one bounce away.
    Gather,
}

impl Feature {
    /// All of them, in the order of a table.
    pub const ALL: [Feature; 11] = [
        Feature::LightStream,
        Feature::Wavelengths,
        Feature::Dispersion,
        Feature::Transmission,
        Feature::Deltas,
        Feature::Glossy,
        Feature::Environment,
        Feature::LightChoice,
        Feature::Lens,
        Feature::CausticPhotons,
        Feature::Gather,
    ];

    /// The feature of this name.
    pub fn named(name: &str) -> Option<Feature> {
        Feature::ALL.into_iter().find(|feature| feature.name() == name)
    }

    /// What it is called on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Feature::LightStream => "light-stream",
            Feature::Wavelengths => "wavelengths",
            Feature::Dispersion => "dispersion",
            Feature::Transmission => "transmission",
            Feature::Deltas => "deltas",
            Feature::Glossy => "glossy",
            Feature::Environment => "environment",
            Feature::LightChoice => "light-choice",
            Feature::Lens => "lens",
            Feature::CausticPhotons => "caustic-photons",
            Feature::Gather => "gather",
        }
    }
}
