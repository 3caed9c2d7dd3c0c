//! The published components of the eye's point-spread function and their mixtures.
//!
//! All are functions of the angle θ to the source in **degrees**, with values per **steradian**: each of f₀ … f₃
//! integrates to 1 over the hemisphere (within the digits published; f₂ to 1.02), hence the mixtures do.
//! Source: Spencer et al. 1995, §4.1 (f₀ … f₂ and the photopic mixture after Vos 1984) and §4.2 (halo, scotopic,
//! mesopic).

use crate::client::settings::Adaptation;

/// Wavelength at which the halo was measured, nm.
pub const HALO_NM: f64 = 568.0;

/// Radius of the halo at [`HALO_NM`], degrees; it is proportional to wavelength.
pub const HALO_RADIUS: f64 = 3.0;

/// Spencer's f₀: the light that is not scattered, blurred by the optics. `2.61·10⁶ exp(−(θ/0.02)²)`.
pub fn f0(degrees: f64) -> f64 {
    2.61e6 * (-(degrees / 0.02).powi(2)).exp()
}

/// Spencer's f₁: the inner part of the bloom. `20.91 / (θ + 0.02)³`.
pub fn f1(degrees: f64) -> f64 {
    20.91 / (degrees + 0.02).powi(3)
}

/// Spencer's f₂: the outer part of the bloom. `72.37 / (θ + 0.02)²`.
pub fn f2(degrees: f64) -> f64 {
    72.37 / (degrees + 0.02).powi(2)
}

/// Spencer's f₃: the lenticular halo at `lambda` nm. `436.9 (568/λ) exp(−19.75 (θ − 3λ/568)²)`.
pub fn f3(degrees: f64, lambda: f64) -> f64 {
    436.9 * (HALO_NM / lambda) * (-19.75 * (degrees - HALO_RADIUS * lambda / HALO_NM).powi(2)).exp()
}

/// The parts of f₀ … f₃ in the eye's point-spread function; they sum to 1.
///
/// The halo needs the outer lens, which only a wide pupil lets through: none of it in daylight.
pub fn mixture(adaptation: Adaptation) -> [f64; 4] {
    match adaptation {
        Adaptation::Photopic => [0.384, 0.478, 0.138, 0.0],
        Adaptation::Mesopic => [0.368, 0.478, 0.138, 0.016],
        Adaptation::Scotopic => [0.282, 0.478, 0.207, 0.033],
    }
}

/// The eye's point-spread function at `degrees` for light of `lambda` nm, per steradian.
pub fn point_spread(adaptation: Adaptation, degrees: f64, lambda: f64) -> f64 {
    let [w0, w1, w2, w3] = mixture(adaptation);
    w0 * f0(degrees) + w1 * f1(degrees) + w2 * f2(degrees) + w3 * f3(degrees, lambda)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values worked out by hand from the printed formulas.
    #[test]
    fn values_are_those_of_the_formulas() {
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-4, "{a} instead of {b}");
        near(f0(0.02), 2.61e6 / std::f64::consts::E);
        near(f1(0.98), 20.91);
        near(f2(0.98), 72.37);
        near(f3(3.0, 568.0), 436.9);
        near(f3(4.0, 568.0), 436.9 * 2.646_57e-9);
        // 0.384·0 + 0.478·20.91 + 0.138·72.37 = 9.99498 + 9.98706
        near(point_spread(Adaptation::Photopic, 0.98, 568.0), 19.98204);
        // 0.478·20.91/27.5436 + 0.207·72.37/9.1204 + 0.033·436.9 at 3°
        near(point_spread(Adaptation::Scotopic, 3.0, 568.0), 0.362_878 + 1.642_537 + 14.4177);
        near(point_spread(Adaptation::Mesopic, 3.0, 568.0), 0.362_878 + 1.095_024 + 6.9904);
    }

    /// Over the hemisphere every component is one whole, within the digits published.
    #[test]
    fn components_and_mixtures_are_normalised() {
        let whole = |f: &dyn Fn(f64) -> f64| {
            // Steps that grow with the angle: dense where the spike is.
            let steps = 200_000;
            let top = (90.0f64 / 0.001 + 1.0).ln();
            let at = |i: f64| 0.001 * ((top * i / steps as f64).exp() - 1.0);
            (0..steps)
                .map(|i| {
                    let (a, b) = (at(f64::from(i)), at(f64::from(i) + 1.0));
                    let middle = 0.5 * (a + b);
                    f(middle) * std::f64::consts::TAU * middle.to_radians().sin() * (b - a).to_radians()
                })
                .sum::<f64>()
        };
        assert!((whole(&f0) - 1.0).abs() < 0.002, "f0: {}", whole(&f0));
        assert!((whole(&f1) - 1.0).abs() < 0.003, "f1: {}", whole(&f1));
        assert!((whole(&f2) - 1.0).abs() < 0.06, "f2: {}", whole(&f2));
        for lambda in [420.0, 568.0, 680.0] {
            let f3 = |t: f64| f3(t, lambda);
            assert!((whole(&f3) - 1.0).abs() < 0.004, "f3 at {lambda} nm: {}", whole(&f3));
        }
        for adaptation in [Adaptation::Photopic, Adaptation::Mesopic, Adaptation::Scotopic] {
            assert!((mixture(adaptation).iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }
}
