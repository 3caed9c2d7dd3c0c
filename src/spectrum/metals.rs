//! Complex indices of refraction η + ik of named metals.
//!
//! Copper, silver and gold are measured figures of Johnson and Christy 1972: their colour is an absorption edge in
//! the middle of the visible range, which a few oscillators do not follow. Eight others are the Lorentz–Drude model of
//! Rakić et al. 1998, fitted by its authors to the measurements of several laboratories (within about 5 % in the
//! visible range). Mitsuba's tables come from another collection and differ by as much.
//!
//! The rest of Mitsuba's list (other metals, carbides, nitrides, crystals) stands in `metals.csv`, with its sources; six of them, for
//! which no public figures cover the visible range, are not known: Cu₂O, CuO, HgTe, Se, SnTe and Te.

use super::{LAMBDA_MAX, LAMBDA_MIN, Spectrum};

/// Planck's constant times the speed of light, in eV nm (CODATA 2018, exact).
const HC: f64 = 1239.841984;

/// Step of the tables made here, in nm. The curves are smooth over tens of nm.
const STEP: f32 = 5.0;

/// A. D. Rakić, A. B. Djurišić, J. M. Elazar, M. L. Majewski, *Optical properties of metallic films for vertical-cavity
/// optoelectronic devices*, Appl. Opt. 37, 5271 (1998), table 1 and the free electrons of table 2; energies in eV: the symbol, ω_p,
/// then f₀ and Γ₀.
const LORENTZ_DRUDE: [(&str, f64, [f64; 2]); 8] = [
    ("Al", 14.98, [0.523, 0.047]),
    ("Be", 18.51, [0.084, 0.035]),
    ("Cr", 10.75, [0.168, 0.047]),
    ("Ni", 15.92, [0.096, 0.048]),
    ("Pd", 9.72, [0.330, 0.008]),
    ("Pt", 9.59, [0.333, 0.080]),
    ("Ti", 7.29, [0.148, 0.082]),
    ("W", 13.22, [0.206, 0.064]),
];

/// Their table 2, in the order of [`LORENTZ_DRUDE`]: f, Γ and ω of each oscillator of bound electrons.
#[allow(clippy::approx_constant, reason = "an energy of platinum happens to be 3.141 eV")]
const BOUND: [[[f64; 3]; 4]; 8] = [
    [[0.227, 0.333, 0.162], [0.050, 0.312, 1.544], [0.166, 1.351, 1.808], [0.030, 3.382, 3.473]],
    [[0.031, 1.664, 0.100], [0.140, 3.395, 1.032], [0.530, 4.454, 3.183], [0.130, 1.802, 4.604]],
    [[0.151, 3.175, 0.121], [0.150, 1.305, 0.543], [1.149, 2.676, 1.970], [0.825, 1.335, 8.775]],
    [[0.100, 4.511, 0.174], [0.135, 1.334, 0.582], [0.106, 2.178, 1.597], [0.729, 6.292, 6.089]],
    [[0.649, 2.950, 0.336], [0.121, 0.555, 0.501], [0.638, 4.621, 1.659], [0.453, 3.236, 5.715]],
    [[0.191, 0.517, 0.780], [0.659, 1.838, 1.314], [0.547, 3.668, 3.141], [3.576, 8.517, 9.249]],
    [[0.899, 2.276, 0.777], [0.393, 2.518, 1.545], [0.187, 1.663, 2.509], [0.001, 1.762, 19.43]],
    [[0.054, 0.530, 1.004], [0.166, 1.281, 1.917], [0.706, 3.332, 3.580], [2.590, 5.836, 7.498]],
];

/// The metals of [`MEASURED`].
const NOBLE: [&str; 3] = ["Cu", "Ag", "Au"];

/// P. B. Johnson, R. W. Christy, *Optical constants of the noble metals*, Phys. Rev. B 6, 4370 (1972), table I: the photon energy
/// in eV, then η and k of each of [`NOBLE`].
const MEASURED: [[f64; 7]; 18] = [
    [1.39, 0.30, 5.768, 0.04, 6.312, 0.17, 5.663],
    [1.51, 0.26, 5.180, 0.04, 5.727, 0.16, 5.083],
    [1.64, 0.24, 4.665, 0.03, 5.242, 0.14, 4.542],
    [1.76, 0.21, 4.205, 0.04, 4.838, 0.13, 4.103],
    [1.88, 0.22, 3.747, 0.05, 4.483, 0.14, 3.697],
    [2.01, 0.30, 3.205, 0.06, 4.152, 0.21, 3.272],
    [2.14, 0.70, 2.704, 0.05, 3.858, 0.29, 2.863],
    [2.26, 1.02, 2.577, 0.06, 3.586, 0.43, 2.455],
    [2.38, 1.18, 2.608, 0.05, 3.324, 0.62, 2.081],
    [2.50, 1.22, 2.564, 0.05, 3.093, 1.04, 1.833],
    [2.63, 1.25, 2.483, 0.05, 2.869, 1.31, 1.849],
    [2.75, 1.24, 2.397, 0.04, 2.657, 1.38, 1.914],
    [2.88, 1.25, 2.305, 0.04, 2.462, 1.45, 1.948],
    [3.00, 1.28, 2.207, 0.05, 2.275, 1.46, 1.958],
    [3.12, 1.32, 2.116, 0.05, 2.070, 1.47, 1.952],
    [3.25, 1.33, 2.045, 0.05, 1.864, 1.46, 1.933],
    [3.37, 1.36, 1.975, 0.07, 1.657, 1.48, 1.895],
    [3.50, 1.37, 1.916, 0.10, 1.419, 1.50, 1.866],
];

/// Published figures of everything else: a name, then η and k every [`COLLECTED_STEP`] nm over the simulated range.
const COLLECTED: &str = include_str!("metals.csv");

const COLLECTED_STEP: f32 = 10.0;

/// The real part η and the imaginary part k of the index of the metal with this chemical symbol (`Au`, `Cu`, …;
/// see [`names`]), or `None`. Mitsuba has some of them twice, as `Nb` and `Nb_palik`: either name will do.
pub fn named(name: &str) -> Option<(Spectrum, Spectrum)> {
    let name = name.strip_suffix("_palik").unwrap_or(name);
    if let Some(metal) = NOBLE.iter().position(|noble| *noble == name) {
        return tables(|energy| [1, 2].map(|part| interpolate(2 * metal + part, energy)));
    }
    match LORENTZ_DRUDE.iter().position(|known| known.0 == name) {
        Some(metal) => tables(|energy| lorentz_drude(metal, energy)),
        None => collected().find(|row| row.0 == name).and_then(|row| pairs(row.1)),
    }
}

/// The rows of [`COLLECTED`]: a name and its figures.
fn collected() -> impl Iterator<Item = (&'static str, &'static str)> {
    COLLECTED.lines().filter(|row| !row.starts_with('#')).filter_map(|row| row.split_once(','))
}

/// Two spectra from figures that alternate.
fn pairs(figures: &str) -> Option<(Spectrum, Spectrum)> {
    let figures: Vec<f32> = figures.split(',').map_while(|figure| figure.parse().ok()).collect();
    let part = |which: usize| {
        let point = |(i, pair): (usize, &[f32])| (LAMBDA_MIN + COLLECTED_STEP * i as f32, pair[which]);
        Spectrum::table(&figures.chunks_exact(2).enumerate().map(point).collect::<Vec<_>>())
    };
    Some((part(0)?, part(1)?))
}

/// Every name that [`named`] knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    let known = NOBLE.into_iter().chain(LORENTZ_DRUDE.iter().map(|metal| metal.0));
    known.chain(collected().map(|row| row.0))
}

/// Two spectra over the simulated range from a function of photon energy in eV to η and k.
fn tables(index: impl Fn(f64) -> [f64; 2]) -> Option<(Spectrum, Spectrum)> {
    let count = ((LAMBDA_MAX - LAMBDA_MIN) / STEP) as usize + 1;
    let lambdas = || (0..count).map(|i| LAMBDA_MIN + STEP * i as f32);
    let part = |which: usize| {
        let point = |lambda: f32| (lambda, index(HC / f64::from(lambda))[which] as f32);
        Spectrum::table(&lambdas().map(point).collect::<Vec<_>>())
    };
    Some((part(0)?, part(1)?))
}

/// Linear interpolation in a column of [`MEASURED`].
fn interpolate(column: usize, energy: f64) -> f64 {
    let i = MEASURED.partition_point(|row| row[0] <= energy).clamp(1, MEASURED.len() - 1);
    let (low, high) = (MEASURED[i - 1], MEASURED[i]);
    let t = (energy - low[0]) / (high[0] - low[0]);
    low[column] + (high[column] - low[column]) * t
}

/// η and k of one of [`LORENTZ_DRUDE`] at a photon energy in eV: the root of the permittivity of their eqs. 1–3.
fn lorentz_drude(metal: usize, energy: f64) -> [f64; 2] {
    let (_, plasma, [f, damping]) = LORENTZ_DRUDE[metal];
    let plasma = plasma * plasma;
    // ε = 1 − f₀ ω_p² / (ω (ω + iΓ₀)) + Σ f ω_p² / (ω_j² − ω² − iωΓ)
    let drude = f * plasma / (energy * (energy * energy + damping * damping));
    let (mut re, mut im) = (1.0 - drude * energy, drude * damping);
    for [f, damping, resonance] in BOUND[metal] {
        let away = resonance * resonance - energy * energy;
        let loss = energy * damping;
        let scale = f * plasma / (away * away + loss * loss);
        re += scale * away;
        im += scale * loss;
    }
    let size = re.hypot(im);
    [((size + re) / 2.0).sqrt(), ((size - re) / 2.0).sqrt()]
}
