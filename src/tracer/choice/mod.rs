//! Which integrator suits a scene and a view: `--integrator auto`.
//!
//! ```text
//! RenderContext ─ Survey::of ─▶ lights, what is seen, lengths of walks          2 k walks from either end, 9 k camera rays
//!               ─ Trial::of ──▶ means and variances of each candidate           some thousand paths each, of bounded cost
//!               ─ decide ─────▶ IntegratorChoice { kind, reason, ratings }      least variance × cost
//! ```
//!
//! [`Survey`] measures the scene: lights, what mirrors and glass the picture shows, lengths of walks from either end. A
//! [`Trial`] traces up to 16 384 paths of a method, four from each place of a coarse grid. The least variance × cost wins
//! ([`decide()`]). Path tracing is kept where it is within a factor of 1.25 of it, and photon mapping must win by a factor of 6,
//! since few paths do not show its bias. Merging is tried where the picture shows mirrors or glass. A variance from few paths does not contain what they did not find: a method that has
//! not hit its caustics yet looks good. So means are compared as well, and a method whose mean is significantly below
//! another's somewhere is charged for what it has not found. A method that cannot show a part of the picture at all is excluded.
//!
//! Everything is a pure function of scene, view, picture size and depth settings. Seed and indices are fixed, and cost counts vertices
//! instead of time, so that the same scene gets the same method on every machine, at every load and from any number of threads.
//! The choice takes 40 to 160 ms of processor time on the scenes of `scenes/`.
//!
//! The window never waits for it: it begins with path tracing, changes over when the answer is there, and asks again half a
//! second after the last edit. The reason is printed and stands, with every rating, in the picture's file and in `--json`.

mod decide;
mod survey;
mod trial;

pub use decide::{IntegratorChoice, IntegratorRating, decide};
pub use survey::{SubpathLengths, Survey};
pub use trial::Trial;

use super::integrator::RenderContext;

/// Survey, trials and decision, one after the other.
pub fn choose(context: &RenderContext) -> IntegratorChoice {
    let survey = Survey::of(context);
    let trials: Vec<Trial> =
        survey.candidates(context).map(|kind| Trial::of(context, &survey, kind)).collect();
    decide(&survey, &trials)
}
