//! Pictures of figures, as SVG: curves on logarithmic axes, rows of bars or dots with their intervals, a map of regions.
//!
//! No plot fails: what is no figure is left out, what lies beyond an axis is drawn at its end. A plot is written for a
//! [`Size`](svg::Size); text then keeps its size on the screen, and a page shows the one that fits.

pub mod axis;
pub mod lines;
pub mod map;
pub mod rows;
pub mod style;
pub mod svg;

pub use lines::{Dot, Lines, Series};
pub use map::Map;
pub use rows::{Mark, Panel, Row, Rows};
pub use style::{Look, looks};
pub use svg::{STYLE, Size, Svg};
