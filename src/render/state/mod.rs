//! A render on disk: exact sums and their description, in one file that can be resumed, or merged with others.
//!
//! ```text
//! lanes ─▶ Recorder (whole chunks of indices) ─▶ ExactFilm, ExactReplicates ─▶ StateWriter ─▶ FILE.state
//! FILE.state … ─▶ StateFile ─▶ RenderState ─▶ pictures, error, another state
//! ```
//!
//! A sample is a pure function of scene, settings (including the picture size), seed and index, and fixed-point sums do not depend on the
//! order of their terms. So a state is a set of index ranges with the sums over them: resuming adds a range, merging is addition, and a
//! picture is independent of how its indices were divided.
//!
//! | file | what |
//! |---|---|
//! | [`header`] | what a state says of itself, and how two of them differ |
//! | [`identity`] | by what a scene and the machine's arithmetic are recognised |
//! | [`goal`] | which state a render keeps and goes on with, and until when |
//! | [`ranges`] | sets of indices |
//! | [`file`](mod@file) | the bytes: written, checked, added row by row |
//! | [`recorder`] | a render that keeps its state on disk |

pub mod file;
pub mod goal;
pub mod header;
pub mod identity;
pub mod ranges;
pub mod recorder;

#[cfg(test)]
mod tests;

pub use file::{RenderState, StateFile};
pub use goal::{KeptState, OpenState, PlannedGoal};
pub use header::{RenderGoal, Share, StateHeader};
pub use identity::{Identity, hash_of_files};
pub use ranges::IndexRanges;
pub use recorder::Recorder;
