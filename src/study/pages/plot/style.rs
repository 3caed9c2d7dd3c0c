//! How methods look: a colour that belongs to the method in every picture, a marker and a dash for those who see no colours.

use crate::study::data::Method;

/// The look of a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Look {
    /// Class that sets colour and dash: `m0` … `m7`, `p0` … `p2` for peers.
    pub class: &'static str,
    /// See `Svg::marker`.
    pub marker: usize,
    /// Another program: hollow markers in grey.
    pub hollow: bool,
}

const OWN: [&str; 8] = ["m0", "m1", "m2", "m3", "m4", "m5", "m6", "m7"];
const PEERS: [&str; 3] = ["p0", "p1", "p2"];
const KNOWN: [&str; 4] = ["path", "bidirectional", "photon", "light"];

/// The looks of a study's methods, in their order.
pub fn looks(methods: &[Method]) -> Vec<Look> {
    let (mut others, mut peers) = (0, 0);
    let look = |m: &Method| {
        if m.peer {
            peers += 1;
            let n = peers - 1;
            return Look { class: PEERS[n % PEERS.len()], marker: [3, 1, 2, 0][n % 4], hollow: true };
        }
        let known = KNOWN.iter().position(|k| *k == m.name);
        let n = known.unwrap_or_else(|| {
            others += 1;
            KNOWN.len() + (others - 1) % (OWN.len() - KNOWN.len())
        });
        Look { class: OWN[n], marker: n, hollow: false }
    };
    methods.iter().map(look).collect()
}
