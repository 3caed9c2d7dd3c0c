//! The eye's point-spread function: the published components and their mixtures, and the function that X, Y and Z see.
//!
//! Components are functions of the angle θ to the source in **degrees**, with values per **steradian**: each of f₀ … f₃
//! integrates to 1 over the hemisphere (within the digits published; f₂ to 1.02), hence the mixtures do.
//! Source: Spencer et al. 1995, §4.1 (f₀ … f₂ and the photopic mixture after Vos 1984) and §4.2 (halo, scotopic,
//! mesopic).

use crate::client::settings::Adaptation;
use crate::color::cie::Rows;

/// Wavelength at which the halo was measured, nm.
pub const HALO_NM: f64 = 568.0;

/// Radius of the halo at [`HALO_NM`], degrees; it is proportional to wavelength.
pub const HALO_RADIUS: f64 = 3.0;

/// Spencer's f₀: the unscattered light, blurred by the optics. `2.61·10⁶ exp(−(θ/0.02)²)`.
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

/// Step of the table of halos, degrees: the narrowest feature, the halo at one wavelength, is 0.16° (1 σ) wide.
const STEP: f64 = 0.01;

/// Entries of the table.
const ENTRIES: usize = 600;

/// Wavelengths of the integral lie this many nm apart.
const LAMBDA_STEP: usize = 4;

/// The eye's point-spread function for an equal-energy spectrum, one function of angle for each of X, Y, Z.
pub struct GlareProfile {
    weights: [f64; 4],
    /// f₃ integrated over wavelength, at multiples of [`STEP`]; empty where there is no halo.
    halo: Vec<[f64; 3]>,
}

impl GlareProfile {
    /// The profile for a state of the eye.
    pub fn new(adaptation: Adaptation) -> Self {
        let weights = mixture(adaptation);
        Self { weights, halo: if weights[3] > 0.0 { halo() } else { Vec::new() } }
    }

    /// Whether the channels differ.
    pub fn is_chromatic(&self) -> bool {
        !self.halo.is_empty()
    }

    /// Range of angles in which the halo contributes, degrees.
    pub fn halo_range(&self) -> Option<[f64; 2]> {
        self.is_chromatic()
            .then_some([HALO_RADIUS * 380.0 / HALO_NM - 0.7, HALO_RADIUS * 780.0 / HALO_NM + 0.7])
    }

    /// Values for X, Y, Z at `degrees` from the source, per steradian.
    pub fn at(&self, degrees: f64) -> [f64; 3] {
        let [w0, w1, w2, w3] = self.weights;
        let mut grey = w1 * f1(degrees) + w2 * f2(degrees);
        if degrees < 0.2 {
            grey += w0 * f0(degrees);
        }
        let halo = self.halo_at(degrees);
        [0, 1, 2].map(|c| grey + w3 * halo[c])
    }

    /// Cubic interpolation of the table (Catmull–Rom); zero beyond it.
    fn halo_at(&self, degrees: f64) -> [f64; 3] {
        let t = degrees / STEP;
        let i = t as usize;
        if i < 1 || i + 2 >= self.halo.len() {
            return [0.0; 3];
        }
        let t = t - i as f64;
        let (t2, t3) = (t * t, t * t * t);
        let weights = [
            0.5 * (-t + 2.0 * t2 - t3),
            0.5 * (2.0 - 5.0 * t2 + 3.0 * t3),
            0.5 * (t + 4.0 * t2 - 3.0 * t3),
            0.5 * (t3 - t2),
        ];
        [0, 1, 2].map(|c| (0..4).map(|k| weights[k] * self.halo[i + k - 1][c]).sum::<f64>().max(0.0))
    }
}

/// `∫ c̄(λ) f₃(θ, λ) dλ / ∫ c̄(λ) dλ` for c̄ = x̄, ȳ, z̄, at multiples of [`STEP`].
fn halo() -> Vec<[f64; 3]> {
    let rows: Vec<(f64, [f64; 3])> = Rows::get()
        .iter()
        .step_by(LAMBDA_STEP)
        .map(|(lambda, row)| (f64::from(lambda), [row.x, row.y, row.z].map(f64::from)))
        .collect();
    let total = rows.iter().fold([0.0; 3], |sum, (_, row)| [0, 1, 2].map(|c| sum[c] + row[c]));
    (0..ENTRIES)
        .map(|i| {
            let degrees = i as f64 * STEP;
            let mut sum = [0.0; 3];
            for (lambda, row) in &rows {
                let value = f3(degrees, *lambda);
                for c in 0..3 {
                    sum[c] += row[c] / total[c] * value;
                }
            }
            sum
        })
        .collect()
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
            // Steps that grow with the angle, dense at the central spike.
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

    /// The angle at which the halo of a channel is brightest.
    fn radius(profile: &GlareProfile, channel: usize) -> f64 {
        let at = |i: &i32| f64::from(*i) * 0.005;
        (300..1100)
            .map(|i| at(&i))
            .max_by(|a, b| profile.halo_at(*a)[channel].total_cmp(&profile.halo_at(*b)[channel]))
            .expect("angles")
    }

    /// z̄ peaks near 446 nm, ȳ near 555, x̄ near 600: halos at 2.4°, 2.9°, 3.2°, the blue one inside.
    #[test]
    fn halos_of_longer_waves_are_wider() {
        let profile = GlareProfile::new(Adaptation::Scotopic);
        let [x, y, z] = [0, 1, 2].map(|c| radius(&profile, c));
        assert!(z < y && y < x, "radii {x} {y} {z}");
        assert!((z - 3.0 * 447.0 / 568.0).abs() < 0.05, "Z at {z}°");
        assert!((y - 3.0 * 556.0 / 568.0).abs() < 0.06, "Y at {y}°");
        assert!((x - 3.0 * 598.0 / 568.0).abs() < 0.06, "X at {x}°");
    }

    /// The table against the integral over every wavelength of the observer's table.
    #[test]
    fn the_table_equals_the_integral() {
        let profile = GlareProfile::new(Adaptation::Scotopic);
        let peak = profile.halo_at(2.9)[1];
        for i in 0..1200 {
            let degrees = 0.0043 + f64::from(i) * 0.005;
            let (mut sum, mut total) = ([0.0; 3], [0.0; 3]);
            for (lambda, row) in Rows::get().iter() {
                for c in 0..3 {
                    total[c] += f64::from(row[c]);
                    sum[c] += f64::from(row[c]) * f3(degrees, f64::from(lambda));
                }
            }
            let got = profile.halo_at(degrees);
            for c in 0..3 {
                let error = (got[c] - sum[c] / total[c]).abs() / peak;
                assert!(
                    error < 2e-4,
                    "channel {c} at {degrees}°: {} instead of {}",
                    got[c],
                    sum[c] / total[c]
                );
            }
        }
    }

    /// Daylight has no halo and no colour; it only falls.
    #[test]
    fn photopic_glare_is_grey_and_falls() {
        let profile = GlareProfile::new(Adaptation::Photopic);
        assert!(!profile.is_chromatic());
        let mut last = f64::INFINITY;
        for i in 0..9000 {
            let [x, y, z] = profile.at(f64::from(i) * 0.01);
            assert!(x == y && y == z && y > 0.0 && y < last, "at {}°", f64::from(i) * 0.01);
            last = y;
        }
    }
}
