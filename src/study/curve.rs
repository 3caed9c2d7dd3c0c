//! Error against samples: a power law, fitted to checkpoints as a line through the logarithms.

use crate::study::interval::{Interval, Z90};

/// The error of a picture at one moment of its render.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Checkpoint {
    /// Seconds since the render began.
    pub seconds: f64,
    /// Paths so far.
    pub samples: f64,
    /// Relative error.
    pub error: f64,
    /// Standard deviation of the logarithm of `error`.
    pub deviation: f64,
}

/// `ln error = level − slope · ln(samples / self.samples)`, with the covariance of level and slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// Samples of the last checkpoint.
    pub samples: f64,
    /// Logarithm of the error there.
    pub level: f64,
    /// Slope, positive where the error falls.
    pub slope: f64,
    /// Variance of `level`, covariance, variance of `slope`.
    pub covariance: [f64; 3],
}

/// Prior of the slope: mean and standard deviation over long renders of ten scenes, from 16 samples per pixel on (`tools/study_check`).
const PRIOR_SLOPE: (f64, f64) = (0.54, 0.05);

/// The prior for methods with blur, which falls more slowly than noise and dominates long renders.
const BLURRED_SLOPE: (f64, f64) = (0.47, 0.08);

/// Standard deviation, in ln error, of real curves around a power law, in addition to noise.
const SEQUENCE_DEVIATION: f64 = 0.03;

/// Checkpoints whose sample counts are within this factor share most samples, so only one of them enters a fit.
const MIN_SAMPLE_RATIO: f64 = 1.5;

/// Most checkpoints in a fit, since earlier ones may have another slope.
const MAX_CHECKPOINTS: usize = 6;

impl PowerLaw {
    /// Fits the last checkpoints of one render with the prior of the slope; `blurs`: the method has photon blur. `None` if no checkpoint
    /// has an error.
    pub fn new(checkpoints: &[Checkpoint], blurs: bool) -> Option<Self> {
        Self::with(checkpoints, Some(if blurs { BLURRED_SLOPE } else { PRIOR_SLOPE }))
    }

    /// Fits independent points without a prior. `None` for fewer than two.
    pub fn free(checkpoints: &[Checkpoint]) -> Option<Self> {
        (checkpoints.len() >= 2).then(|| Self::with(checkpoints, None)).flatten()
    }

    fn with(checkpoints: &[Checkpoint], prior: Option<(f64, f64)>) -> Option<Self> {
        let usable = |c: &&Checkpoint| c.error > 0.0 && c.samples > 0.0 && c.error.is_finite();
        let last = *checkpoints.iter().rfind(usable)?;
        // Weighted least squares; the prior counts as an additional observation of the slope.
        let precision = prior.map_or(0.0, |(_, deviation)| deviation.powi(-2));
        let (mut n, mut x1, mut x2) = (0.0, 0.0, precision);
        let (mut y1, mut xy) = (0.0, prior.map_or(0.0, |(slope, _)| precision * slope));
        let (mut next, mut used) = (f64::INFINITY, 0);
        for checkpoint in checkpoints.iter().rev().filter(usable) {
            if prior.is_some() && (checkpoint.samples > next || used == MAX_CHECKPOINTS) {
                continue;
            }
            (next, used) = (checkpoint.samples / MIN_SAMPLE_RATIO, used + 1);
            let weight = 1.0 / (checkpoint.deviation.powi(2) + SEQUENCE_DEVIATION * SEQUENCE_DEVIATION);
            let x = -(checkpoint.samples / last.samples).ln();
            let y = checkpoint.error.ln();
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
        let half = Z90 * self.covariance[2].max(0.0).sqrt();
        Interval { value: -self.slope, low: -self.slope - half, high: -self.slope + half }
    }

    /// Predicted error at this number of samples.
    pub fn error(&self, samples: f64) -> f64 {
        (self.level - self.slope * (samples / self.samples).ln()).exp()
    }

    /// Natural logarithm of the factor of samples until `error`, counted from the last checkpoint, and its standard deviation;
    /// negative if the error is reached already. `None` where the error does not fall.
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

    fn checkpoints(slope: f64, deviation: f64) -> Vec<Checkpoint> {
        (0..20)
            .map(|i| {
                let samples = 1000.0 * 1.25f64.powi(i);
                Checkpoint { seconds: samples / 500.0, samples, error: samples.powf(-slope), deviation }
            })
            .collect()
    }

    #[test]
    fn a_power_law_is_found_and_extrapolated() {
        let checkpoints = checkpoints(0.7, 0.001);
        let fit = PowerLaw::new(&checkpoints, false).expect("twenty checkpoints");
        assert!((fit.slope - 0.7).abs() < 0.02, "{}", fit.slope);
        let (x, deviation) = fit.until(fit.error(4.0 * fit.samples)).expect("it falls");
        assert!((x - 4f64.ln()).abs() < 1e-9 && deviation > 0.0 && deviation < 0.3);
        assert!(fit.slope().holds(-0.7));
        let free = PowerLaw::free(&checkpoints).expect("twenty checkpoints");
        assert!((free.slope - 0.7).abs() < 1e-6);
    }

    #[test]
    fn without_a_second_checkpoint_the_prior_decides() {
        assert_eq!(PowerLaw::new(&[], false), None);
        let one = PowerLaw::new(&checkpoints(0.7, 0.1)[..1], false).expect("one checkpoint");
        assert!((one.slope - PRIOR_SLOPE.0).abs() < 1e-9);
        let blurred = PowerLaw::new(&checkpoints(0.7, 0.1)[..1], true).expect("one checkpoint");
        assert!((blurred.slope - BLURRED_SLOPE.0).abs() < 1e-9);
        assert_eq!(PowerLaw::free(&checkpoints(0.7, 0.1)[..1]), None);
        // With noise as large as the decrease, the fit stays close to the prior.
        let noisy = PowerLaw::new(&checkpoints(0.2, 2.0), false).expect("twenty checkpoints");
        assert!((noisy.slope - PRIOR_SLOPE.0).abs() < 0.1);
        let broken = Checkpoint { error: f64::NAN, samples: 1.0, ..Checkpoint::default() };
        assert_eq!(PowerLaw::new(&[broken], false), None);
        // An increasing error never reaches the target.
        assert_eq!(PowerLaw::free(&checkpoints(-0.5, 0.01)).and_then(|fit| fit.until(1e-9)), None);
    }
}
