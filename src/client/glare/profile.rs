//! The point-spread function as X, Y and Z see it.

use crate::client::glare::components::{HALO_NM, HALO_RADIUS, f0, f1, f2, f3, mixture};
use crate::client::settings::Adaptation;
use crate::color::cie::Rows;

/// Step of the table of halos, degrees: the narrowest feature, the halo at one wavelength, is 0.16° (1 σ) wide.
const STEP: f64 = 0.01;

/// Entries of the table.
const ENTRIES: usize = 600;

/// Wavelengths of the integral lie this many nm apart.
const LAMBDA_STEP: usize = 4;

/// The eye's point-spread function for an equal-energy spectrum, one function of angle for each of X, Y, Z.
pub struct Profile {
    weights: [f64; 4],
    /// f₃ integrated over wavelength, at multiples of [`STEP`]; empty where there is no halo.
    halo: Vec<[f64; 3]>,
}

impl Profile {
    /// The profile for a state of the eye.
    pub fn new(adaptation: Adaptation) -> Self {
        let weights = mixture(adaptation);
        Self { weights, halo: if weights[3] > 0.0 { halo() } else { Vec::new() } }
    }

    /// Whether the channels differ.
    pub fn is_chromatic(&self) -> bool {
        !self.halo.is_empty()
    }

    /// Angles between which the halo matters, degrees; nothing matters beyond.
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

    /// The angle at which the halo of a channel is brightest.
    fn radius(profile: &Profile, channel: usize) -> f64 {
        let at = |i: &i32| f64::from(*i) * 0.005;
        (300..1100)
            .map(|i| at(&i))
            .max_by(|a, b| profile.halo_at(*a)[channel].total_cmp(&profile.halo_at(*b)[channel]))
            .expect("angles")
    }

    /// z̄ peaks near 446 nm, ȳ near 555, x̄ near 600: halos at 2.4°, 2.9°, 3.2°, the blue one inside.
    #[test]
    fn halos_of_longer_waves_are_wider() {
        let profile = Profile::new(Adaptation::Scotopic);
        let [x, y, z] = [0, 1, 2].map(|c| radius(&profile, c));
        assert!(z < y && y < x, "radii {x} {y} {z}");
        assert!((z - 3.0 * 447.0 / 568.0).abs() < 0.05, "Z at {z}°");
        assert!((y - 3.0 * 556.0 / 568.0).abs() < 0.06, "Y at {y}°");
        assert!((x - 3.0 * 598.0 / 568.0).abs() < 0.06, "X at {x}°");
    }

    /// The table against the integral over every wavelength of the observer's table.
    #[test]
    fn the_table_equals_the_integral() {
        let profile = Profile::new(Adaptation::Scotopic);
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
        let profile = Profile::new(Adaptation::Photopic);
        assert!(!profile.is_chromatic());
        let mut last = f64::INFINITY;
        for i in 0..9000 {
            let [x, y, z] = profile.at(f64::from(i) * 0.01);
            assert!(x == y && y == z && y > 0.0 && y < last, "at {}°", f64::from(i) * 0.01);
            last = y;
        }
    }
}
