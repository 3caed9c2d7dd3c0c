//! Plots as files of their own, for a README: their style is inside, on paper that is light or dark as the reader has it.

use crate::study::data::Study;
use crate::study::pages::plot::Size;
use crate::study::pages::sections::{curves, effects, prices};
use crate::study::pages::verdict;

/// Relative RMS error against seconds, all methods and peers.
pub fn convergence_svg(study: &Study) -> String {
    let lines = curves::overall(study);
    lines.draw(Size::Wide).standalone(&format!("{}: {}", verdict::name(study), lines.label))
}

/// Time to each error, by method.
pub fn prices_svg(study: &Study) -> String {
    let mut rows = prices::rows(study);
    for panel in &mut rows.panels {
        panel.title = "time, with 90 % intervals; hollow: the curve drawn further".into();
    }
    rows.draw(Size::Wide).standalone(&format!("{}: {}", verdict::name(study), rows.label))
}

/// What each effect costs and gives.
pub fn effects_svg(study: &Study) -> String {
    let rows = effects::rows(study);
    rows.draw(Size::Wide).standalone(&format!("{}: {}", verdict::name(study), rows.label))
}
