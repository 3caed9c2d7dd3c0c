//! Reports of a study for readers: a summary for the terminal, one HTML page, CSV, and standalone charts.
//!
//! All functions are pure, from [`Study`] to text: no rendering, file access or clock. Every sentence is derived from the numbers, and a
//! missing part names the command that measures it.
//!
//! - `verdict`: conclusions that all outputs share
//! - `page`: the page of a scene and the index of scenes; `sections` has its seven parts and the box at the top, `parts` what they
//!   are made of
//! - `chart`: the SVG of charts, in a page or alone
//!
//! A page is one file that fetches nothing and has no scripts. Numbers that are not finite appear as “—” and are left out of charts; no content of a
//! study makes a page fail, and the template escapes every name.

pub(crate) mod chart;
mod csv;
mod page;
pub(crate) mod parts;
#[cfg(test)]
mod sample;
mod sections;
mod terminal;
#[cfg(test)]
mod tests;
mod verdict;

pub use csv::csv;
pub(crate) use page::document;
pub use page::{html, index};
pub use terminal::terminal;
pub use verdict::fastest;

use crate::study::data::Study;
use chart::{ChartSize, Drawing};
use sections::{convergence, effects, prices};

/// Standalone SVG files of the charts, with the suffixes of their names.
pub fn svg_files(study: &Study) -> [(&'static str, String); 3] {
    let named =
        |drawing: Drawing, label: &str| drawing.standalone(&format!("{}: {label}", verdict::name(study)));
    let (curves, mut times, effects) =
        (convergence::overall(study), prices::chart(study), effects::chart(study));
    for panel in &mut times.panels {
        panel.title = "time, with 90 % intervals; hollow: extrapolated".into();
    }
    [
        ("convergence.svg", named(curves.draw(ChartSize::Wide), curves.label)),
        ("prices.svg", named(times.draw(ChartSize::Wide), &times.label)),
        ("effects.svg", named(effects.draw(ChartSize::Wide), &effects.label)),
    ]
}
