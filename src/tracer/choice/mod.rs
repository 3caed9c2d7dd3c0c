//! Which method of light transport suits a scene and a view: `--integrator auto`.
//!
//! ```text
//! RenderContext ─ Survey::of ─▶ lights, what is seen, lengths of walks          2 k walks from either end, 9 k camera rays
//!       ─ Trial::of ──▶ means and variances of each candidate           some thousand paths each, a bounded number of vertices
//!       ─ decide ─────▶ Choice { kind, reason }                         least variance × cost
//! ```
//!
//! Everything is a pure function of scene, view and depth settings: fixed seed and indices, and vertices instead of a
//! clock (`cost`), so the same scene gets the same method on every machine and at every load.
//!
//! A variance from few paths is blind to what they do not find: a method that has not met its caustics yet looks good.
//! So means are compared as well ([`decide`]), and what cannot show a thing at all is out.

mod cost;
mod decide;
mod grid;
mod survey;
mod trial;
mod words;

pub use decide::{Choice, Rating, decide};
pub use survey::{Lengths, Survey};
pub use trial::Trial;

use super::integrator::RenderContext;
use crate::scene::desc::IntegratorKind;

/// What is tried. Another method is one more line here, one in [`Trial::of`], one in `cost`.
pub const CANDIDATES: [IntegratorKind; 4] =
    [IntegratorKind::Path, IntegratorKind::Light, IntegratorKind::Bidirectional, IntegratorKind::Photon];

/// Survey, trials and decision, one after the other.
pub fn choose(context: &RenderContext) -> Choice {
    let survey = Survey::of(context);
    let trials = CANDIDATES.map(|kind| Trial::of(context, &survey, kind));
    decide(&survey, &trials)
}
