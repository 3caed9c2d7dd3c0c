//! Complex indices of refraction η + ik of named metals.
//!
//! Copper, silver and gold are measured figures of Johnson and Christy 1972: their colour is an absorption edge in
//! the middle of the visible range, which a few oscillators do not follow. All others are the Lorentz–Drude model of
//! Rakić et al. 1998, fitted by its authors to the measurements of several laboratories (within about 5 % in the
//! visible range). Mitsuba's tables come from another collection and differ by as much.

use super::{LAMBDA_MAX, LAMBDA_MIN, Spectrum};

/// Planck's constant times the speed of light, in eV nm (CODATA 2018, exact).
const HC: f64 = 1239.841984;

/// Step of the tables made here, in nm. The curves are smooth over tens of nm.
const STEP: f32 = 5.0;

/// Parameters of A. D. Rakić, A. B. Djurišić, J. M. Elazar, M. L. Majewski, *Optical properties of metallic films for
/// vertical-cavity optoelectronic devices*, Appl. Opt. 37, 5271 (1998), tables 1 and 2; energies in eV.
struct LorentzDrude {
    name: &'static str,
    /// ω_p.
    plasma: f64,
    /// f₀ and Γ₀ of the free electrons.
    free: [f64; 2],
    /// f, Γ and ω of each oscillator of bound electrons.
    bound: [[f64; 3]; 4],
}

#[allow(clippy::approx_constant, reason = "an energy of platinum happens to be 3.141 eV")]
const LORENTZ_DRUDE: [LorentzDrude; 8] = [
    LorentzDrude {
        name: "Al",
        plasma: 14.98,
        free: [0.523, 0.047],
        bound: [[0.227, 0.333, 0.162], [0.050, 0.312, 1.544], [0.166, 1.351, 1.808], [0.030, 3.382, 3.473]],
    },
    LorentzDrude {
        name: "Be",
        plasma: 18.51,
        free: [0.084, 0.035],
        bound: [[0.031, 1.664, 0.100], [0.140, 3.395, 1.032], [0.530, 4.454, 3.183], [0.130, 1.802, 4.604]],
    },
    LorentzDrude {
        name: "Cr",
        plasma: 10.75,
        free: [0.168, 0.047],
        bound: [[0.151, 3.175, 0.121], [0.150, 1.305, 0.543], [1.149, 2.676, 1.970], [0.825, 1.335, 8.775]],
    },
    LorentzDrude {
        name: "Ni",
        plasma: 15.92,
        free: [0.096, 0.048],
        bound: [[0.100, 4.511, 0.174], [0.135, 1.334, 0.582], [0.106, 2.178, 1.597], [0.729, 6.292, 6.089]],
    },
    LorentzDrude {
        name: "Pd",
        plasma: 9.72,
        free: [0.330, 0.008],
        bound: [[0.649, 2.950, 0.336], [0.121, 0.555, 0.501], [0.638, 4.621, 1.659], [0.453, 3.236, 5.715]],
    },
    LorentzDrude {
        name: "Pt",
        plasma: 9.59,
        free: [0.333, 0.080],
        bound: [[0.191, 0.517, 0.780], [0.659, 1.838, 1.314], [0.547, 3.668, 3.141], [3.576, 8.517, 9.249]],
    },
    LorentzDrude {
        name: "Ti",
        plasma: 7.29,
        free: [0.148, 0.082],
        bound: [[0.899, 2.276, 0.777], [0.393, 2.518, 1.545], [0.187, 1.663, 2.509], [0.001, 1.762, 19.43]],
    },
    LorentzDrude {
        name: "W",
        plasma: 13.22,
        free: [0.206, 0.064],
        bound: [[0.054, 0.530, 1.004], [0.166, 1.281, 1.917], [0.706, 3.332, 3.580], [2.590, 5.836, 7.498]],
    },
];

/// Photon energies in eV at which Johnson and Christy measured, from 892 to 354 nm.
const ENERGIES: [f64; 18] = [
    1.39, 1.51, 1.64, 1.76, 1.88, 2.01, 2.14, 2.26, 2.38, 2.50, 2.63, 2.75, 2.88, 3.00, 3.12, 3.25, 3.37,
    3.50,
];

/// P. B. Johnson, R. W. Christy, *Optical constants of the noble metals*, Phys. Rev. B 6, 4370 (1972), table I: name, then
/// η and k at [`ENERGIES`].
const MEASURED: [(&str, [f64; 18], [f64; 18]); 3] = [
    (
        "Cu",
        [
            0.30, 0.26, 0.24, 0.21, 0.22, 0.30, 0.70, 1.02, 1.18, 1.22, 1.25, 1.24, 1.25, 1.28, 1.32, 1.33,
            1.36, 1.37,
        ],
        [
            5.768, 5.180, 4.665, 4.205, 3.747, 3.205, 2.704, 2.577, 2.608, 2.564, 2.483, 2.397, 2.305, 2.207,
            2.116, 2.045, 1.975, 1.916,
        ],
    ),
    (
        "Ag",
        [
            0.04, 0.04, 0.03, 0.04, 0.05, 0.06, 0.05, 0.06, 0.05, 0.05, 0.05, 0.04, 0.04, 0.05, 0.05, 0.05,
            0.07, 0.10,
        ],
        [
            6.312, 5.727, 5.242, 4.838, 4.483, 4.152, 3.858, 3.586, 3.324, 3.093, 2.869, 2.657, 2.462, 2.275,
            2.070, 1.864, 1.657, 1.419,
        ],
    ),
    (
        "Au",
        [
            0.17, 0.16, 0.14, 0.13, 0.14, 0.21, 0.29, 0.43, 0.62, 1.04, 1.31, 1.38, 1.45, 1.46, 1.47, 1.46,
            1.48, 1.50,
        ],
        [
            5.663, 5.083, 4.542, 4.103, 3.697, 3.272, 2.863, 2.455, 2.081, 1.833, 1.849, 1.914, 1.948, 1.958,
            1.952, 1.933, 1.895, 1.866,
        ],
    ),
];

/// The real part η and the imaginary part k of the index of the metal with this chemical symbol (`Au`, `Cu`, …;
/// see [`names`]), or `None`.
pub fn named(name: &str) -> Option<(Spectrum, Spectrum)> {
    if let Some((_, eta, k)) = MEASURED.iter().find(|m| m.0 == name) {
        return tables(|energy| [interpolate(eta, energy), interpolate(k, energy)]);
    }
    let model = LORENTZ_DRUDE.iter().find(|m| m.name == name)?;
    tables(|energy| model.index(energy))
}

/// Every name that [`named`] knows.
pub fn names() -> impl Iterator<Item = &'static str> {
    MEASURED.iter().map(|m| m.0).chain(LORENTZ_DRUDE.iter().map(|m| m.name))
}

/// Two spectra over the simulated range from a function of photon energy in eV to η and k.
fn tables(index: impl Fn(f64) -> [f64; 2]) -> Option<(Spectrum, Spectrum)> {
    let count = ((LAMBDA_MAX - LAMBDA_MIN) / STEP) as usize + 1;
    let rows: Vec<(f32, [f64; 2])> = (0..count)
        .map(|i| LAMBDA_MIN + STEP * i as f32)
        .map(|lambda| (lambda, index(HC / f64::from(lambda))))
        .collect();
    let part = |which: usize| {
        let points: Vec<_> = rows.iter().map(|(lambda, v)| (*lambda, v[which] as f32)).collect();
        Spectrum::table(&points)
    };
    Some((part(0)?, part(1)?))
}

/// Linear interpolation of figures at [`ENERGIES`].
fn interpolate(figures: &[f64; 18], energy: f64) -> f64 {
    let i = ENERGIES.partition_point(|e| *e <= energy).clamp(1, ENERGIES.len() - 1);
    let t = (energy - ENERGIES[i - 1]) / (ENERGIES[i] - ENERGIES[i - 1]);
    figures[i - 1] + (figures[i] - figures[i - 1]) * t
}

impl LorentzDrude {
    /// η and k at a photon energy in eV: the root of the permittivity of their eqs. 1–3.
    fn index(&self, energy: f64) -> [f64; 2] {
        let plasma = self.plasma * self.plasma;
        // ε = 1 − f₀ ω_p² / (ω (ω + iΓ₀)) + Σ f ω_p² / (ω_j² − ω² − iωΓ)
        let [f, damping] = self.free;
        let drude = f * plasma / (energy * (energy * energy + damping * damping));
        let (mut re, mut im) = (1.0 - drude * energy, drude * damping);
        for [f, damping, resonance] in self.bound {
            let away = resonance * resonance - energy * energy;
            let loss = energy * damping;
            let scale = f * plasma / (away * away + loss * loss);
            re += scale * away;
            im += scale * loss;
        }
        let size = re.hypot(im);
        [((size + re) / 2.0).sqrt(), ((size - re) / 2.0).sqrt()]
    }
}
