//! A figure with what is known of its error.

use serde::{Deserialize, Serialize};

/// A figure with its 90 % interval, in whatever unit stands beside it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The best guess.
    #[serde(deserialize_with = "number")]
    pub value: f64,
    /// 5 % of the probability lies below.
    #[serde(deserialize_with = "number")]
    pub low: f64,
    /// 5 % lies above.
    #[serde(deserialize_with = "number")]
    pub high: f64,
}

/// Standard normal quantile of 95 %: half of a 90 % interval in standard deviations.
pub const Z90: f64 = 1.644_853_626_951;

impl Interval {
    /// A figure that is known exactly.
    pub const fn exact(value: f64) -> Self {
        Self { value, low: value, high: value }
    }

    /// `value` with a standard deviation of its logarithm: `value · exp(±1.645 σ)`.
    pub fn of_log(value: f64, sigma: f64) -> Self {
        let factor = (Z90 * sigma).exp();
        Self { value, low: value / factor, high: value * factor }
    }

    /// Mean and interval of independent figures, by Student's t; of one figure that figure alone. `None` of nothing.
    pub fn of_mean(figures: &[f64]) -> Option<Self> {
        let n = figures.len() as f64;
        let mean = figures.iter().sum::<f64>() / n;
        match figures.len() {
            0 => None,
            1 => Some(Self::exact(mean)),
            _ => {
                let variance = figures.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
                let half = student_95(n - 1.0) * (variance / n).sqrt();
                Some(Self { value: mean, low: mean - half, high: mean + half })
            }
        }
    }

    /// Median and its interval by order statistics: the ranks that a binomial distribution allows. Fewer than five figures allow
    /// none, and have their range. `None` of nothing.
    pub fn of_median(figures: &[f64]) -> Option<Self> {
        let mut sorted = figures.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let n = sorted.len();
        let value = *sorted.get(n / 2)?;
        // The most figures below which the median lies with 5 % at most.
        let (mut term, mut sum, mut low) = (0.5f64.powi(n as i32), 0.0, 0);
        for k in 0..n / 2 {
            sum += term;
            if sum > 0.05 {
                break;
            }
            low = k;
            term *= (n - k) as f64 / (k + 1) as f64;
        }
        Some(Self { value, low: sorted[low], high: sorted[n - 1 - low] })
    }

    /// The same figure in another unit.
    #[must_use]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let [a, b] = [f(self.low), f(self.high)];
        Self { value: f(self.value), low: a.min(b), high: a.max(b) }
    }

    /// True when `x` lies in the interval.
    pub fn holds(&self, x: f64) -> bool {
        (self.low..=self.high).contains(&x)
    }
}

/// JSON has no infinities: what was none is written as `null`, and read as no number.
fn number<'de, D: serde::Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(from)?.unwrap_or(f64::NAN))
}

/// The 95 % quantile of Student's t with `n` degrees of freedom, by the expansion of Cornish and Fisher around the normal
/// quantile (Abramowitz, Stegun 26.7.5); within 1 % from 3 degrees on, and exact for 1 and 2.
pub fn student_95(n: f64) -> f64 {
    if n < 1.5 {
        return 6.313_752;
    }
    if n < 2.5 {
        return 2.919_986;
    }
    let z = Z90;
    let g1 = (z.powi(3) + z) / 4.0;
    let g2 = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / 96.0;
    let g3 = (3.0 * z.powi(7) + 19.0 * z.powi(5) + 17.0 * z.powi(3) - 15.0 * z) / 384.0;
    z + g1 / n + g2 / (n * n) + g3 / n.powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (n, t) in [
            (1.0, 6.314),
            (2.0, 2.920),
            (3.0, 2.353),
            (5.0, 2.015),
            (10.0, 1.812),
            (30.0, 1.697),
            (1e6, 1.645),
        ] {
            assert!((student_95(n) / t - 1.0).abs() < 0.01, "{n}: {}", student_95(n));
        }
    }

    #[test]
    fn medians_do_not_care_for_one_wild_figure() {
        let figures: Vec<f64> = (0..16).map(|i| if i == 3 { 1e9 } else { f64::from(i) }).collect();
        let median = Interval::of_median(&figures).unwrap_or_default();
        assert!(
            (7.0..=9.0).contains(&median.value) && median.low >= 4.0 && median.high <= 13.0,
            "{median:?}"
        );
        assert_eq!(Interval::of_median(&[]), None);
        assert_eq!(Interval::of_median(&[2.0, 1.0]), Some(Interval { value: 2.0, low: 1.0, high: 2.0 }));
    }

    #[test]
    fn means_and_maps() {
        assert_eq!(Interval::of_mean(&[]), None);
        assert_eq!(Interval::of_mean(&[3.0]), Some(Interval::exact(3.0)));
        let mean = Interval::of_mean(&[1.0, 2.0, 3.0]).unwrap_or_default();
        assert!((mean.high - (2.0 + 2.92 / 3f64.sqrt())).abs() < 1e-3 && mean.value == 2.0);
        let inverse = Interval { value: 2.0, low: 1.0, high: 4.0 }.map(|x| 1.0 / x);
        assert_eq!(inverse, Interval { value: 0.5, low: 0.25, high: 1.0 });
        assert!(inverse.holds(0.25) && !inverse.holds(1.1));
    }
}
