//! Sections of the page, one file each. Each begins with a conclusion derived from the numbers.

pub mod answer;
pub mod convergence;
pub mod display;
pub mod effects;
pub mod numeric;
pub mod pictures;
pub mod predictions;
pub mod prices;
pub mod stability;
