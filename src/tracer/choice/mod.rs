//! Which integrator suits a scene and a view: `--integrator auto`.
//!
//! ```text
//! RenderContext ─ Survey::of ─▶ lights, what is seen, direct light          9 k camera rays, 2 k paths
//!               ─ Trial::of ──▶ means, variances and cost of each candidate some thousand paths each, of bounded cost
//!               ─ decide ─────▶ IntegratorChoice { kind, reason, ratings }  least variance × cost
//!               ─ if several are close, longer trials of these, and `decide` again
//! ```
//!
//! [`Survey`] measures the scene: lights, and what mirrors and glass the picture shows. A trial traces up to 16 384 paths of a method,
//! four from each place of a coarse grid; its cost is counted by the events of some more, which are recorded ([`EventCounts`]). The least
//! variance × cost wins (`decide`), and photon mapping must win by a factor of 12, since few paths do not show its bias. Merging is
//! tried where the picture shows mirrors or glass. A variance from few paths does not contain what they did not find: a method that has
//! not hit its caustics yet looks good. So means are compared as well, and a method whose mean is significantly below another's somewhere is
//! charged for what it has not found; and methods within a factor of 3 of the best, photon
//! mapping excepted, are tried by four times as many paths. A method that
//! cannot show a part of the picture at all is excluded.
//!
//! Everything is a pure function of scene, view, picture size and depth settings. Seed and indices are fixed, and cost counts events
//! instead of time, so that the same scene gets the same method on every machine, at every load and from any number of threads.
//!
//! The window never waits for it: it begins with path tracing, changes over when the answer is there, and asks again half a
//! second after the last edit. The reason is printed and stands, with every rating, in the picture's file and in `--json`.

mod cost;
mod decide;
mod each;
mod survey;
mod trial;

pub use cost::EventCounts;
pub use decide::{IntegratorChoice, IntegratorRating};
pub use survey::Survey;

use cost::Costs;
use decide::decide;
use each::each;
use trial::Trial;

use super::integrator::RenderContext;

/// Survey, trials and decision. With several `threads` the trials run beside each other; the choice is the same.
pub fn choose(context: &RenderContext, threads: usize) -> IntegratorChoice {
    let (survey, costs) = (Survey::of(context), Costs::of(context, threads));
    let kinds = survey.candidates(context).collect();
    let mut trials = each(kinds, threads, |kind| Trial::of(context, kind, &costs));
    loop {
        let choice = decide(&survey, &trials);
        let close = choice.close();
        let is_due = |trial: &Trial| close.contains(&trial.kind) && !trial.is_long();
        if !trials.iter().any(is_due) {
            return choice;
        }
        // By its longer trial a method may fall behind one that had none yet.
        trials = each(trials, threads, |one| if is_due(&one) { one.lengthened(context) } else { one });
    }
}
