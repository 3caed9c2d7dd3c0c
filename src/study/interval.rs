//! A number with its 90 % confidence interval.

use serde::{Deserialize, Serialize};

/// A number with its 90 % confidence interval, in whatever unit stands beside it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    /// The best estimate.
    #[serde(deserialize_with = "number")]
    pub value: f64,
    /// Lower bound: 5 % of the probability lies below.
    #[serde(deserialize_with = "number")]
    pub low: f64,
    /// Upper bound: 5 % of the probability lies above.
    #[serde(deserialize_with = "number")]
    pub high: f64,
}

/// Standard normal quantile of 95 %: half of a 90 % interval in standard deviations.
pub const Z90: f64 = 1.644_853_626_951;

impl Interval {
    /// A number that is known exactly.
    pub const fn exact(value: f64) -> Self {
        Self { value, low: value, high: value }
    }

    /// `value` with a standard deviation of its logarithm: `value · exp(±1.645 σ)`.
    pub fn of_log(value: f64, sigma: f64) -> Self {
        Self::of_logs(value, [sigma; 2])
    }

    /// As [`of_log`](Self::of_log), with separate standard deviations upwards and downwards.
    pub fn of_logs(value: f64, sigmas: [f64; 2]) -> Self {
        let [up, down] = sigmas.map(|sigma| (Z90 * sigma).exp());
        Self { value, low: value / down, high: value * up }
    }

    /// Mean and interval of independent numbers by Student's t; one number alone counts as exact. `None` without numbers.
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

    /// Median and its interval by order statistics: the ranks come from the binomial distribution. Fewer than five numbers allow no
    /// such interval and get their range. `None` without numbers.
    pub fn of_median(figures: &[f64]) -> Option<Self> {
        let mut sorted = figures.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let n = sorted.len();
        let value = *sorted.get(n / 2)?;
        // The largest rank below which the median lies with a probability of at most 5 %.
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

    /// A share of successes with Wilson's score interval. `None` without trials.
    pub fn of_share(successes: usize, trials: usize) -> Option<Self> {
        if trials == 0 {
            return None;
        }
        let (n, z2) = (trials as f64, Z90 * Z90);
        let p = successes.min(trials) as f64 / n;
        let middle = (p + z2 / (2.0 * n)) / (1.0 + z2 / n);
        let half = Z90 / (1.0 + z2 / n) * (p * (1.0 - p) / n + z2 / (4.0 * n * n)).sqrt();
        Some(Self { value: p, low: (middle - half).max(0.0), high: (middle + half).min(1.0) })
    }

    /// Applies a monotonic function to the value and both bounds.
    #[must_use]
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let [a, b] = [f(self.low), f(self.high)];
        Self { value: f(self.value), low: a.min(b), high: a.max(b) }
    }

    /// Orders the bounds around a finite value; bounds that are NaN are replaced by the value. `None` if the value is not finite.
    pub fn cleaned(&self) -> Option<Self> {
        let bound = |x: f64| if x.is_nan() { self.value } else { x };
        let (a, b) = (bound(self.low), bound(self.high));
        let (low, high) = (a.min(b).min(self.value), a.max(b).max(self.value));
        self.value.is_finite().then_some(Self { value: self.value, low, high })
    }

    /// Square root of a mean square; a negative value, which is noise, counts as 0.
    pub fn root(&self) -> Option<Self> {
        self.cleaned().map(|i| i.map(|x| x.max(0.0).sqrt()))
    }

    /// `self / other` of independent positive values, assumed to be lognormal.
    pub fn ratio(&self, other: &Self) -> Option<Self> {
        let sigma = |i: &Self| {
            let width = if i.low > 0.0 && i.high.is_finite() { (i.high / i.low).ln() } else { 0.0 };
            width / (2.0 * Z90)
        };
        let value = self.value / other.value;
        (self.value > 0.0 && other.value > 0.0 && value.is_finite())
            .then(|| Self::of_log(value, sigma(self).hypot(sigma(other))))
    }

    /// Expected value of a lognormal distribution with this interval.
    pub fn expected(&self) -> f64 {
        let known = self.low > 0.0 && self.high.is_finite();
        let sigma = if known { (self.high / self.low).ln() / (2.0 * Z90) } else { 0.0 };
        self.value * (0.5 * sigma * sigma).exp()
    }

    /// True when `x` lies in the interval.
    pub fn holds(&self, x: f64) -> bool {
        (self.low..=self.high).contains(&x)
    }
}

/// JSON has no infinities: they are written as `null` and read back as NaN.
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

/// The value that Student's t with `n` degrees of freedom exceeds with the probability `tail`, one-sided; degrees are rounded, and more than
/// 400 count as 400.
pub fn student(tail: f64, n: f64) -> f64 {
    let n = n.round().clamp(1.0, 400.0) as u32;
    let (mut low, mut high) = (0.0, 1e9);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if student_tail(middle, n) > tail { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// The probability that Student's t exceeds `t` ≥ 0, by the finite series for whole degrees of freedom (Abramowitz, Stegun 26.7.3 and
/// 26.7.4). It is exact but for the rounding of its difference from 1/2.
fn student_tail(t: f64, n: u32) -> f64 {
    let angle = (t / f64::from(n).sqrt()).atan();
    let (sine, square) = (angle.sin(), angle.cos().powi(2));
    let (mut term, mut sum) = (1.0, 0.0);
    let within = if n.is_multiple_of(2) {
        for k in 0..n / 2 {
            sum += term;
            term *= square * f64::from(2 * k + 1) / f64::from(2 * k + 2);
        }
        sine * sum
    } else {
        for k in 0..n / 2 {
            sum += term;
            term *= square * f64::from(2 * k + 2) / f64::from(2 * k + 3);
        }
        std::f64::consts::FRAC_2_PI * (angle + sine * angle.cos() * sum)
    };
    0.5 * (1.0 - within)
}
