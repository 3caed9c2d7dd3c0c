//! The page's sections, one file each. Every one begins with a sentence that is made from the figures, and says so where
//! there are none.

pub mod answer;
pub mod convergence;
pub mod curves;
pub mod display;
pub mod effects;
pub mod numeric;
pub mod origin;
pub mod pictures;
pub mod predictions;
pub mod prices;
pub mod snapshots;
pub mod stability;
