//! The parts of the page, one file each. Every one begins with a conclusion that is made from the numbers.

pub mod answer;
pub mod convergence;
pub mod display;
pub mod effects;
pub mod numeric;
pub mod pictures;
pub mod predictions;
pub mod prices;
pub mod stability;
