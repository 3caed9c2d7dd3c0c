//! The style of methods: a colour that belongs to the method in every chart, and a marker and a dash for readers without colours.

use maud::{Markup, html};
use serde::Serialize;

use super::px;
use crate::study::data::{MethodResult, Study};

/// How a method is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct MethodStyle {
    /// CSS class of the colour: `m0` … `m7`, `p0` … `p2` for other programs.
    pub class: &'static str,
    /// Lengths of line and gap, as SVG and canvas take them.
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

const fn other_program(class: &'static str, dash: &'static str, marker: &'static str) -> MethodStyle {
    MethodStyle { class, dash, marker, hollow: true }
}

/// The program's methods in the order of `NAMES`, then those without a fixed style.
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
const NAMES: [&str; 4] = ["path", "bidirectional", "photon", "light"];

const OTHER_PROGRAMS: [MethodStyle; 3] = [
    other_program("p0", "", DIAMOND),
    other_program("p1", "7 3", SQUARE),
    other_program("p2", "3 3", TRIANGLE),
];

/// The style of a value that belongs to no method.
pub const PLAIN: MethodStyle = own("m0", "", CIRCLE);

/// The styles of a study's methods, in their order.
pub fn styles(methods: &[MethodResult]) -> Vec<MethodStyle> {
    let (mut unnamed, mut peers) = (0, 0);
    let style = |m: &MethodResult| {
        if m.peer {
            peers += 1;
            return OTHER_PROGRAMS[(peers - 1) % OTHER_PROGRAMS.len()];
        }
        let known = NAMES.iter().position(|name| *name == m.name);
        OWN[known.unwrap_or_else(|| {
            unnamed += 1;
            NAMES.len() + (unnamed - 1) % (OWN.len() - NAMES.len())
        })]
    };
    methods.iter().map(style).collect()
}

/// The style of the method of this name.
pub fn style_of(study: &Study, name: &str) -> MethodStyle {
    let place = study.methods.iter().position(|m| m.name == name);
    place.map_or(PLAIN, |i| styles(&study.methods)[i])
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
