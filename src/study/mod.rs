//! How wrong a picture is, and what it costs to make it less so: analysis only. `app` runs the renders that it needs.

pub mod analysis;
pub mod curve;
pub mod data;
pub mod error;
pub mod interval;
pub mod measured;
mod method;
pub mod pages;
pub mod prediction;
pub mod replicates;
pub mod smooth;
pub mod watch;
pub mod words;

pub use error::{ErrorField, Figures, Part};
pub use interval::Interval;
pub use replicates::Replicates;
pub use watch::{Quantity, State, Target, Watch};
