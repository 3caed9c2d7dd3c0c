//! Indices of refraction of named media.
//!
//! Media with published dispersion have it; the others are constant, with the value Mitsuba 3 gives them
//! (`include/mitsuba/render/ior.h`, at the sodium D line). Mitsuba has no dispersion: where the two differ, as for
//! `bk7` (1.5168 here, 1.5046 there), a scene made for comparison must give the index as a number.

use glam::Vec4;

use super::{SampledSpectrum, SampledWavelengths};

/// Wavelength of the sodium D line in nm, at which one number for an index that depends on wavelength is taken.
pub const SODIUM_D: f32 = 589.3;

/// The lines at which catalogues of glass give indices, in nm: helium d, and F and C of hydrogen.
const HELIUM_D: f64 = 587.5618;
const FRAUNHOFER_F: f64 = 486.1327;
const FRAUNHOFER_C: f64 = 656.2725;

/// The index of refraction of a transparent medium.
#[derive(Clone, Debug, PartialEq)]
pub enum Ior {
    /// The same index at every wavelength.
    Constant(f32),
    /// n = a + b / λ², Cauchy's law cut after two terms.
    Cauchy {
        /// Index at infinite wavelength.
        a: f32,
        /// Dispersion in µm².
        b: f32,
    },
    /// n² = constant + Σ B λ² / (λ² − C), Sellmeier's law.
    Sellmeier(Sellmeier),
}

/// Coefficients of Sellmeier's law.
#[derive(Clone, Debug, PartialEq)]
pub struct Sellmeier {
    constant: f32,
    /// B (no unit) and C (µm²) of each term; a term that is not used has B = 0.
    terms: [[f32; 2]; TERMS],
}

/// Most terms that a published formula below has.
const TERMS: usize = 5;

/// Names and indices of `ior.h` of Mitsuba 3 for the media whose dispersion is not given by [`DISPERSIVE`].
const CONSTANT: [(&str, f32); 17] = [
    ("vacuum", 1.0),
    ("helium", 1.000036),
    ("hydrogen", 1.000132),
    ("air", 1.000277),
    ("carbon dioxide", 1.00045),
    ("acetone", 1.36),
    ("ethanol", 1.361),
    ("carbon tetrachloride", 1.461),
    ("glycerol", 1.4729),
    ("benzene", 1.501),
    ("silicone oil", 1.52045),
    ("bromine", 1.661),
    ("water ice", 1.31),
    ("pyrex", 1.470),
    ("polypropylene", 1.49),
    ("amber", 1.55),
    ("pet", 1.5750),
];

/// A name, the constant of Sellmeier's law, and B and C (µm²) of its terms.
type Formula = (&'static str, f64, &'static [[f64; 2]]);

/// Square of a resonance that a source gives as a wavelength in µm.
const fn sq(lambda: f64) -> f64 {
    lambda * lambda
}

/// Media with published dispersion over the visible range, at 20–25 °C.
const DISPERSIVE: [Formula; 12] = [
    // Daimon, Masumura 2007, Appl. Opt. 46, 3811: distilled water at 20.0 °C.
    (
        "water",
        1.0,
        &[
            [5.684027565e-1, 5.101829712e-3],
            [1.726177391e-1, 1.821153936e-2],
            [2.086189578e-2, 2.620722293e-2],
            [1.130748688e-1, 1.069792721e1],
        ],
    ),
    // Malitson 1965, J. Opt. Soc. Am. 55, 1205: fused silica.
    (
        "fused quartz",
        1.0,
        &[[0.6961663, sq(0.0684043)], [0.4079426, sq(0.1162414)], [0.8974794, sq(9.896161)]],
    ),
    // Sultanova, Kasarova, Nikolov 2009, Acta Phys. Pol. A 116, 585: PMMA, polycarbonate, polystyrene.
    ("acrylic glass", 1.0, &[[1.1819, 0.011313]]),
    ("polycarbonate", 1.0, &[[1.4182, 0.021304]]),
    ("polystyrene", 1.0, &[[1.4435, 0.020216]]),
    // Schott, optical glass data sheets: N-BK7, SF10, N-SF11, N-LASF9.
    ("bk7", 1.0, &[[1.03961212, 0.00600069867], [0.231792344, 0.0200179144], [1.01046945, 103.560653]]),
    ("sf10", 1.0, &[[1.61625977, 0.0127534559], [0.259229334, 0.0581983954], [1.07762317, 116.60768]]),
    ("sf11", 1.0, &[[1.73759695, 0.013188707], [0.313747346, 0.0623068142], [1.89878101, 155.23629]]),
    ("lasf9", 1.0, &[[2.00029547, 0.0121426017], [0.298926886, 0.0538736236], [1.80691843, 156.530829]]),
    // Li 1976, J. Phys. Chem. Ref. Data 5, 329. The three resonances beyond 40 µm act here through Σ B/C
    // alone, so they are one term.
    (
        "sodium chloride",
        1.00055,
        &[
            [0.19800, sq(0.050)],
            [0.48398, sq(0.100)],
            [0.38696, sq(0.128)],
            [0.25998, sq(0.158)],
            [(0.08796 / sq(40.50) + 3.17064 / sq(60.98) + 0.30038 / sq(120.34)) * sq(60.98), sq(60.98)],
        ],
    ),
    // Peter 1923, Z. Phys. 15, 358.
    ("diamond", 1.0, &[[0.3306, sq(0.1750)], [4.3356, sq(0.1060)]]),
    // Malitson, Dodge 1972, J. Opt. Soc. Am. 62, 1405: ordinary ray.
    ("sapphire", 1.0, &[[1.4313493, sq(0.0726631)], [0.65054713, sq(0.1193242)], [5.3414021, sq(18.028251)]]),
];

impl Sellmeier {
    fn new(constant: f64, terms: &[[f64; 2]]) -> Self {
        let term = |i: usize| terms.get(i).map_or([0.0; 2], |t| t.map(|v| v as f32));
        Self { constant: constant as f32, terms: std::array::from_fn(term) }
    }

    /// The index at four wavelengths in nm; never below 1, also where coefficients make no sense.
    fn eval(&self, lambda: Vec4) -> Vec4 {
        let squared = lambda * lambda * 1e-6;
        let mut n2 = Vec4::splat(self.constant);
        for [b, c] in self.terms {
            if b == 0.0 {
                break;
            }
            n2 += squared * b / (squared - c);
        }
        // The order matters: `max` with the constant second takes NaN to 1.
        n2.max(Vec4::ONE).sqrt()
    }
}

impl Ior {
    /// The medium Mitsuba knows by this name (`air`, `water`, `bk7`, `diamond`, …), or one of ours (`sapphire`,
    /// `sf10`, …), whatever the case of its letters; `None` for any other.
    pub fn named(name: &str) -> Option<Self> {
        let same = |other: &str| other.eq_ignore_ascii_case(name);
        if let Some((_, constant, terms)) = DISPERSIVE.iter().find(|f| same(f.0)) {
            return Some(Ior::Sellmeier(Sellmeier::new(*constant, terms)));
        }
        CONSTANT.iter().find(|m| same(m.0)).map(|m| Ior::Constant(m.1))
    }

    /// Cauchy's law through the index at the helium d line with this Abbe number V = (n_d − 1) / (n_F − n_C).
    pub fn of_abbe_number(n_d: f32, abbe: f32) -> Self {
        let inverse_square = |nanometers: f64| 1e6 / (nanometers * nanometers);
        let spread = inverse_square(FRAUNHOFER_F) - inverse_square(FRAUNHOFER_C);
        let b = (f64::from(n_d) - 1.0) / (f64::from(abbe) * spread);
        Self::cauchy((f64::from(n_d) - b * inverse_square(HELIUM_D)) as f32, b as f32)
    }

    /// Cauchy's law n = a + b / λ², `b` in µm².
    pub fn cauchy(a: f32, b: f32) -> Self {
        if b == 0.0 { Ior::Constant(a) } else { Ior::Cauchy { a, b } }
    }

    /// The index at the wavelengths of a path.
    #[inline]
    pub fn sample(&self, lambda: &SampledWavelengths) -> SampledSpectrum {
        SampledSpectrum(self.eval(lambda.lambda()))
    }

    /// The index at any four wavelengths, in nm.
    #[inline]
    pub fn eval(&self, lambda: Vec4) -> Vec4 {
        match self {
            Ior::Constant(n) => Vec4::splat(*n),
            Ior::Cauchy { a, b } => *a + *b * 1e6 / (lambda * lambda),
            Ior::Sellmeier(law) => law.eval(lambda),
        }
    }

    /// The index as one number: at the helium d line, to which Abbe numbers belong; for a medium by name at the sodium line.
    pub fn nominal(&self) -> f32 {
        let line = if let Ior::Cauchy { .. } = self { HELIUM_D as f32 } else { SODIUM_D };
        self.eval(Vec4::splat(line)).x
    }

    /// A medium of another index, with the same Abbe number where this one disperses by Cauchy's law.
    pub(crate) fn with_index(&self, n: f32) -> Self {
        match self {
            Ior::Cauchy { a, b } => {
                let scale = (n - 1.0) / (self.nominal() - 1.0);
                let b = b * scale;
                let at_d = self.nominal() - a;
                Self::cauchy(n - at_d * scale, b)
            }
            _ => Ior::Constant(n),
        }
    }

    /// True when the index depends on wavelength.
    pub fn is_dispersive(&self) -> bool {
        !matches!(self, Ior::Constant(_))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// n at the helium d line, and the Abbe number (n_d − 1) / (n_F − n_C).
    fn catalogue(ior: &Ior) -> (f32, f32) {
        let n = ior.eval(Vec4::new(587.5618, 486.1327, 656.2725, 500.0));
        (n.x, (n.x - 1.0) / (n.y - n.z))
    }

    #[test]
    fn index_and_abbe_number_are_the_published_ones() {
        // n_d, V_d, tolerances. Schott data sheets for the glasses; for the rest the sources in the table or
        // handbooks (Handbook of Optics II, ch. 33; Sultanova 2009, table 1), which round as the tolerances show.
        let published = [
            ("bk7", 1.51680, 64.17, 1e-5, 0.02),
            ("sf10", 1.72825, 28.41, 1e-5, 0.02),
            ("sf11", 1.78472, 25.68, 1e-5, 0.02),
            ("lasf9", 1.85025, 32.17, 1e-5, 0.02),
            ("fused quartz", 1.45846, 67.82, 1e-5, 0.05),
            ("sapphire", 1.76817, 72.2, 1e-4, 0.3),
            ("water", 1.3333, 55.8, 3e-4, 0.5),
            ("sodium chloride", 1.5441, 42.8, 5e-4, 0.5),
            ("diamond", 2.4175, 55.3, 1e-3, 1.0),
            // One term fitted from 437 to 1052 nm: it spreads the visible range a little too far.
            ("acrylic glass", 1.491, 57.4, 2e-3, 4.5),
            ("polycarbonate", 1.585, 30.0, 2e-3, 2.5),
            ("polystyrene", 1.591, 31.0, 2e-3, 2.5),
        ];
        for (name, n, v, n_tolerance, v_tolerance) in published {
            let ior = Ior::named(name).expect(name);
            let got = catalogue(&ior);
            println!("{name:16} n_d {:.5} ({n}) V_d {:.2} ({v})", got.0, got.1);
            assert!((got.0 - n).abs() <= n_tolerance, "{name}: n_d {} should be {n}", got.0);
            assert!((got.1 - v).abs() <= v_tolerance, "{name}: V_d {} should be {v}", got.1);
            assert!(ior.is_dispersive());
        }
    }

    #[test]
    fn every_name_of_mitsuba_is_known_and_close_to_its_value() {
        let mitsuba = [
            ("water", 1.3330),
            ("fused quartz", 1.458),
            ("acrylic glass", 1.49),
            ("bk7", 1.5046),
            ("sodium chloride", 1.544),
            ("diamond", 2.419),
        ];
        for (name, n) in CONSTANT.into_iter().chain(mitsuba) {
            let (got, _) = catalogue(&Ior::named(name).expect(name));
            assert!((got - n).abs() < 0.0125, "{name}: {got} {n}");
        }
        assert_eq!(Ior::named("BK7"), Ior::named("bk7"));
        assert_eq!(Ior::named("unobtainium"), None);
    }

    #[test]
    fn laws_from_coefficients() {
        let cauchy = Ior::cauchy(1.5046, 0.0042);
        assert!((catalogue(&cauchy).0 - (1.5046 + 0.0042 / (0.5875618 * 0.5875618))).abs() < 1e-6);
        assert_eq!(Ior::cauchy(1.5, 0.0), Ior::Constant(1.5));
        for (n_d, abbe) in [(1.5168, 64.17), (1.78472, 25.68), (1.5, 1.0), (1.0003, 89.3)] {
            let (n, v) = catalogue(&Ior::of_abbe_number(n_d, abbe));
            assert!((n - n_d).abs() < 1e-6, "{n_d}: {n}");
            // Rounding of the indices, which differ little.
            let rounding = 4.0 * f32::EPSILON * n_d * abbe / (n_d - 1.0);
            assert!((v / abbe - 1.0).abs() < rounding, "{abbe}: {v}");
        }
    }

    #[test]
    fn dispersion_is_normal_and_nonsense_stays_finite() {
        let lambda = |i: u32| Vec4::splat(360.0 + i as f32);
        for (name, ..) in DISPERSIVE {
            let ior = Ior::named(name).expect(name);
            let falls = (0..470).all(|i| ior.eval(lambda(i)).x > ior.eval(lambda(i + 1)).x);
            assert!(falls, "{name} must bend blue more than red");
        }
        // A resonance in the middle of the visible range.
        let wild = Sellmeier::new(1.0, &[[1.0, 0.25]]);
        for i in 0..=470 {
            let n = wild.eval(lambda(i)).x;
            assert!(n >= 1.0 && !n.is_nan(), "{i}: {n}");
        }
    }
}
