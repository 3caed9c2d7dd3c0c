//! A study as people read it: a table for the terminal, one HTML page, CSV, and plots as files of their own.
//!
//! Everything here is a function from [`Study`](crate::study::data::Study) to text; it renders nothing, reads no file and asks no
//! clock. What a reader has to know comes first: which method to use, how long an error takes, what is dearest, what to be
//! wary of. Every sentence is made from the figures, and what is missing is said with the command that gets it.
//!
//! - `verdict`: what follows from the figures, used by all outputs alike, so that they cannot disagree
//! - `sections`: the page's seven parts, one file each, with the box at the top and the origin at the end
//! - `plot`: SVG with axes, bands, intervals; the same drawing stands in a page (whose style it takes) or alone
//! - `number`, `escape`: figures with the digits that their intervals bear out; text from outside made harmless
//!
//! The page is XML as well as HTML, holds its pictures, fetches nothing and runs nothing. Figures that are not finite appear as
//! “—” and are left out of plots; no content of a study makes it fail.

mod csv;
mod escape;
mod html;
mod index;
mod number;
mod parts;
mod plot;
#[cfg(test)]
mod sample;
mod sections;
mod standalone;
mod table;
#[cfg(test)]
mod tests;
mod verdict;

pub use csv::csv;
pub use html::html;
pub use index::index;
pub use standalone::{convergence_svg, effects_svg, prices_svg};
pub use table::terminal;
