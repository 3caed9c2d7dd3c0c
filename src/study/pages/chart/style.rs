//! Styles of methods: a colour per method, the same in every chart, with a marker and a dash pattern for readers who cannot distinguish
//! colours.

use maud::{Markup, html};

use super::px;
use crate::study::data::{MethodResult, Study};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MethodStyle {
    /// CSS class of the colour: `m0` … `m7`, `p0` … `p2` for other programs.
    pub class: &'static str,
    /// Dash pattern: lengths of line and gap, as in SVG.
    pub dash: &'static str,
    /// Outline of the marker: an SVG path of about radius 1 around the origin.
    pub marker: &'static str,
    /// Markers of other programs are hollow.
    pub hollow: bool,
}

const CIRCLE: &str = "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0-2 0Z";
const SQUARE: &str = "M-.9-.9H.9V.9H-.9Z";
const TRIANGLE: &str = "M0-1.2L1.1.8H-1.1Z";
const DIAMOND: &str = "M0-1.3L1.3 0L0 1.3L-1.3 0Z";

const fn own(class: &'static str, dash: &'static str, marker: &'static str) -> MethodStyle {
    MethodStyle { class, dash, marker, hollow: false }
}

const fn peer(class: &'static str, dash: &'static str, marker: &'static str) -> MethodStyle {
    MethodStyle { class, dash, marker, hollow: true }
}

/// The program's methods in the order of `NAMES`, followed by styles for any others.
const OWN: [MethodStyle; 8] = [
    own("m0", "", CIRCLE),
    own("m1", "9 3", SQUARE),
    own("m2", "5 3", TRIANGLE),
    own("m3", "9 3 2 3", DIAMOND),
    own("m4", "12 3 2 3 2 3", "M0 1.2L1.1-.8H-1.1Z"),
    own("m5", "3 2", "M-.5-1.2H.5V1.2H-.5Z"),
    own("m6", "", "M-1.2-.5H1.2V.5H-1.2Z"),
    own("m7", "7 5", "M0-1.2L1.1-.4L.7 1H-.7L-1.1-.4Z"),
];
const NAMES: [&str; 5] = ["path", "bidirectional", "photon", "light", "vcm"];

/// Other programs, in order of appearance.
const PEERS: [MethodStyle; 3] =
    [peer("p0", "", DIAMOND), peer("p1", "7 3", SQUARE), peer("p2", "3 3", TRIANGLE)];

/// Style of values that belong to no method.
pub const PLAIN: MethodStyle = own("m0", "", CIRCLE);

/// The methods of a study in their order, each with its style.
pub fn styled(study: &Study) -> impl Iterator<Item = (&MethodResult, MethodStyle)> {
    let mut unnamed = OWN[NAMES.len()..].iter().cycle();
    let mut peers = PEERS.iter().cycle();
    let mut style = move |m: &MethodResult| match NAMES.iter().position(|name| *name == m.name) {
        _ if m.peer => peers.next(),
        Some(known) => OWN.get(known),
        None => unnamed.next(),
    };
    study.methods.iter().map(move |m| (m, style(m).copied().unwrap_or(PLAIN)))
}

pub fn style_of(study: &Study, name: &str) -> MethodStyle {
    styled(study).find(|(m, _)| m.name == name).map_or(PLAIN, |(_, style)| style)
}

impl MethodStyle {
    /// The marker at a place, with the radius `r`.
    pub fn marker(&self, [x, y]: [f64; 2], r: f64) -> Markup {
        let class = if self.hollow { "hollow" } else { "solid" };
        html! { path class=(class) d=(self.marker) transform={ "translate(" (px(x)) " " (px(y)) ")scale(" (px(r)) ")" } {} }
    }
}

/// The marker of a method within text.
pub fn key(style: MethodStyle) -> Markup {
    html! { svg.chart.key viewBox="0 0 14 14" aria-hidden="true" { g class=(style.class) { (style.marker([7.0, 7.0], 5.0)) } } }
}
