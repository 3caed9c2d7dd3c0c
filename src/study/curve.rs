//! Error against samples: a line through the logarithms, with what is known of it.

use crate::study::interval::Interval;

/// One look at a picture that is being rendered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// Seconds since the render began.
    pub seconds: f64,
    /// Paths so far.
    pub samples: f64,
    /// Relative error.
    pub error: f64,
    /// Standard deviation of the logarithm of `error`.
    pub deviation: f64,
}

/// `ln error = level − slope · ln(samples / reference)` with the covariance of both, `reference` being the samples of the last look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// Samples of the last look.
    pub samples: f64,
    /// Logarithm of the error there.
    pub level: f64,
    /// Slope, positive where the error falls.
    pub slope: f64,
    /// Variance of `level`, covariance, variance of `slope`.
    pub covariance: [f64; 3],
}

/// Slope that is expected before anything is seen, and its standard deviation: what the project's scenes have
/// (`tools/bench replicates`).
const EXPECTED: (f64, f64) = (0.58, 0.1);

/// What the curve of a low-discrepancy sequence departs from a line: standard deviation of the logarithm, besides chance.
const WAVES: f64 = 0.03;

/// Looks that are nearer than this factor of samples share nearly all of them: one of them stands for both.
const APART: f64 = 1.5;

/// Looks that a fit uses: older ones may have had another slope.
const USED: usize = 6;

impl Fit {
    /// A line through the last looks; `None` of none with an error.
    pub fn new(looks: &[Look]) -> Option<Self> {
        Self::with(looks, Some(EXPECTED))
    }

    /// The same from independent points without an expectation; `None` of fewer than two.
    pub fn free(looks: &[Look]) -> Option<Self> {
        (looks.len() >= 2).then(|| Self::with(looks, None)).flatten()
    }

    fn with(looks: &[Look], expected: Option<(f64, f64)>) -> Option<Self> {
        let usable = |look: &&Look| look.error > 0.0 && look.samples > 0.0 && look.error.is_finite();
        let last = *looks.iter().rfind(usable)?;
        // Normal equations, the slope's expectation among them.
        let precision = expected.map_or(0.0, |(_, deviation)| deviation.powi(-2));
        let (mut n, mut x1, mut x2) = (0.0, 0.0, precision);
        let (mut y1, mut xy) = (0.0, expected.map_or(0.0, |(slope, _)| precision * slope));
        let (mut next, mut used) = (f64::INFINITY, 0);
        for look in looks.iter().rev().filter(usable) {
            if expected.is_some() && (look.samples > next || used == USED) {
                continue;
            }
            (next, used) = (look.samples / APART, used + 1);
            let weight = 1.0 / (look.deviation.powi(2) + WAVES * WAVES);
            let x = -(look.samples / last.samples).ln();
            let y = look.error.ln();
            n += weight;
            x1 += weight * x;
            x2 += weight * x * x;
            y1 += weight * y;
            xy += weight * x * y;
        }
        let determinant = n * x2 - x1 * x1;
        (determinant > 1e-9 * n * x2).then(|| Self {
            samples: last.samples,
            level: (x2 * y1 - x1 * xy) / determinant,
            slope: (n * xy - x1 * y1) / determinant,
            covariance: [x2, -x1, n].map(|c| c / determinant),
        })
    }

    /// The slope of error against samples, negative where the error falls, with its interval.
    pub fn slope(&self) -> Interval {
        let half = crate::study::interval::Z90 * self.covariance[2].max(0.0).sqrt();
        Interval { value: -self.slope, low: -self.slope - half, high: -self.slope + half }
    }

    /// The error at so many samples.
    pub fn error(&self, samples: f64) -> f64 {
        (self.level - self.slope * (samples / self.samples).ln()).exp()
    }

    /// Natural logarithm of samples until `error`, relative to the last look, and its standard deviation; negative if it is reached.
    /// `None` where the error does not fall.
    pub fn until(&self, error: f64) -> Option<(f64, f64)> {
        let [level, both, slope] = self.covariance;
        if !(self.slope > 0.05 && error > 0.0) {
            return None;
        }
        let x = (self.level - error.ln()) / self.slope;
        let variance = (level - 2.0 * x * both + x * x * slope) / self.slope.powi(2);
        Some((x, variance.max(0.0).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn looks(slope: f64, deviation: f64) -> Vec<Look> {
        (0..20)
            .map(|i| {
                let samples = 1000.0 * 1.25f64.powi(i);
                Look { seconds: samples / 500.0, samples, error: samples.powf(-slope), deviation }
            })
            .collect()
    }

    #[test]
    fn a_line_is_found_and_drawn_further() {
        let looks = looks(0.7, 0.001);
        let fit = Fit::new(&looks).expect("twenty looks");
        assert!((fit.slope - 0.7).abs() < 0.02, "{}", fit.slope);
        let (x, deviation) = fit.until(fit.error(4.0 * fit.samples)).expect("it falls");
        assert!((x - 4f64.ln()).abs() < 1e-9 && deviation > 0.0 && deviation < 0.3);
        assert!(fit.slope().holds(-0.7));
        let free = Fit::free(&looks).expect("twenty looks");
        assert!((free.slope - 0.7).abs() < 1e-6);
    }

    #[test]
    fn without_a_second_look_the_expectation_speaks() {
        assert_eq!(Fit::new(&[]), None);
        let one = Fit::new(&looks(0.7, 0.1)[..1]).expect("one look");
        assert!((one.slope - EXPECTED.0).abs() < 1e-9);
        assert_eq!(Fit::free(&looks(0.7, 0.1)[..1]), None);
        // Noise that is as large as the fall teaches little.
        let noisy = Fit::new(&looks(0.2, 2.0)).expect("twenty looks");
        assert!((noisy.slope - EXPECTED.0).abs() < 0.1);
        let broken = Look { error: f64::NAN, samples: 1.0, ..Look::default() };
        assert_eq!(Fit::new(&[broken]), None);
        // An error that grows is never small enough.
        assert_eq!(Fit::free(&looks(-0.5, 0.01)).and_then(|fit| fit.until(1e-9)), None);
    }
}
