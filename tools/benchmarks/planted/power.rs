//! Shares of trials with their intervals, and the power that a statement of a judgement promises.

use std::fmt;

use pointillist::image::compare::critical_value;
use pointillist::math::normal::{t_of_score, upper_tail};

/// 90 % quantile of the standard normal distribution: the power of `detectable`.
const POWER: f64 = 1.281_551_6;

/// Tests that share the probability of a false alarm of a look, and averages of the whole picture that share that of the first of them.
const TESTS: [f64; 2] = [4.0, 4.0];

/// Probability that at most `found` of `trials` succeed, each with the probability `p`: the sum of the binomial distribution.
pub fn at_most(found: u64, trials: u64, p: f64) -> f64 {
    if p <= 0.0 || found >= trials {
        return 1.0;
    }
    if p >= 1.0 {
        return 0.0;
    }
    let n = trials as f64;
    let term = |k: f64| {
        let ways = libm::lgamma(n + 1.0) - libm::lgamma(k + 1.0) - libm::lgamma(n - k + 1.0);
        (ways + k * p.ln() + (n - k) * (-p).ln_1p()).exp()
    };
    (0..=found).map(|k| term(k as f64)).sum::<f64>().min(1.0)
}

/// How many of so many trials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// Those that were found.
    pub found: u64,
    /// All.
    pub trials: u64,
}

impl Share {
    /// The share itself.
    pub fn value(self) -> f64 {
        self.found as f64 / self.trials as f64
    }

    /// The interval that contains the true share with a probability of at least 95 % (Clopper and Pearson, *The Use of Confidence or
    /// Fiducial Limits Illustrated in the Case of the Binomial*, Biometrika 26, 1934).
    pub fn interval(self) -> [f64; 2] {
        const TAIL: f64 = 0.025;
        let Self { found, trials } = self;
        // The p at which `falling`, a probability that falls with p, is this large.
        let solve = |wanted: f64, falling: &dyn Fn(f64) -> f64| {
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..50 {
                let p = 0.5 * (low + high);
                if falling(p) > wanted { low = p } else { high = p }
            }
            0.5 * (low + high)
        };
        let low = match found.checked_sub(1) {
            Some(fewer) => solve(1.0 - TAIL, &|p| at_most(fewer, trials, p)),
            None => 0.0,
        };
        let high = if found < trials { solve(TAIL, &|p| at_most(found, trials, p)) } else { 1.0 };
        [low, high]
    }
}

/// `97.5 % (94.3 to 99.2)`.
impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [low, high] = self.interval().map(|p| 100.0 * p);
        f.pad(&format!("{:.1} % ({low:.1} to {high:.1})", 100.0 * self.value()))
    }
}

/// What a judgement without a change states: "a change of brightness of `detectable` would have been found with 90 %".
#[derive(Clone, Copy, Debug)]
pub struct Statement {
    /// The relative change.
    pub detectable: f64,
    /// The relative change that counts as none.
    pub relative: f64,
    /// Probability of a false alarm of the look.
    pub false_alarm: f64,
    /// Renderings of the run and of the reference.
    pub renderings: [f64; 2],
}

impl Statement {
    /// The power that it promises for another `change` of brightness.
    ///
    /// With σ the relative standard error of the difference, k the critical value of Student's t with ν degrees of freedom and b² = k²/2ν,
    /// what is detectable is (k (1 − 1/4ν) + z.90 √(1 + b²)) σ: the noncentral t is taken as normal (see `Contrast::detectable`). So
    /// the power for c σ is Φ((c − k (1 − 1/4ν)) / √(1 + b²)).
    ///
    /// `spread` is by how much less than σ the differences of trials vary that are drawn from a pool of renderings: it takes the place of the 1.
    pub fn power(&self, change: f64, spread: f64) -> f64 {
        let freedom = self.freedom();
        let critical = t_of_score(critical_value(self.false_alarm / TESTS[0] / TESTS[1]), freedom);
        let (needed, square) = (critical * (1.0 - 0.25 / freedom), critical * critical / (2.0 * freedom));
        let stated = needed + POWER * (1.0 + square).sqrt();
        let beyond = (change.abs() - self.relative).max(0.0) / (self.detectable - self.relative);
        let power = upper_tail((needed - beyond * stated) / (spread * spread + square).sqrt());
        // Where nothing is detectable, or nothing varies.
        if power.is_nan() { 0.0 } else { power }
    }

    /// Degrees of freedom by Welch and Satterthwaite, of renderings that vary alike on both sides.
    fn freedom(&self) -> f64 {
        let parts = self.renderings.map(|n| 1.0 / n);
        let squares: f64 = parts.iter().zip(self.renderings).map(|(part, n)| part * part / (n - 1.0)).sum();
        (parts[0] + parts[1]).powi(2) / squares
    }
}

#[cfg(test)]
mod tests {
    use pointillist::math::random::Random;

    use super::*;

    /// Tables of Clopper and Pearson; the last by (α/2)^(1/n).
    #[test]
    fn intervals_are_those_of_the_tables() {
        let known = [
            (0, 10, [0.0, 0.3085]),
            (5, 10, [0.1871, 0.8129]),
            (10, 1000, [0.0048, 0.0183]),
            (200, 200, [0.9817, 1.0]),
        ];
        for (found, trials, interval) in known {
            let made = Share { found, trials }.interval();
            for (a, b) in made.into_iter().zip(interval) {
                assert!((a - b).abs() < 6e-5, "{found} of {trials}: {made:?}");
            }
        }
        assert_eq!(Share { found: 195, trials: 200 }.to_string(), "97.5 % (94.3 to 99.2)");
    }

    #[test]
    fn binomial_sums_are_exact() {
        // Of three coins: 1, 3, 3, 1 of 8.
        for (found, sum) in [(0, 0.125), (1, 0.5), (2, 0.875), (3, 1.0)] {
            assert!((at_most(found, 3, 0.5) - sum).abs() < 1e-12);
        }
        assert_eq!((at_most(0, 3, 0.0), at_most(2, 3, 1.0), at_most(3, 3, 1.0)), (1.0, 0.0, 1.0));
    }

    fn statement(detectable: f64, relative: f64) -> Statement {
        Statement { detectable, relative, false_alarm: 1e-3, renderings: [8.0, 8.0] }
    }

    #[test]
    fn what_is_detectable_is_promised_with_ninety_per_cent() {
        for made in [statement(0.01, 0.0), statement(0.01, 0.002)] {
            assert!((made.power(0.01, 1.0) - 0.9).abs() < 1e-6);
            assert!((made.power(-0.01, 1.0) - 0.9).abs() < 1e-6);
            assert!(made.power(0.0, 1.0) < 1e-3 && made.power(0.03, 1.0) > 0.999);
            assert!(made.power(0.01, 0.9) > 0.9 && made.power(0.003, 0.9) < made.power(0.003, 1.0));
        }
        assert!(statement(f64::INFINITY, 0.0).power(0.1, 1.0) < 1e-3);
    }

    /// The t tests of 8 normal values each, at the level of the whole picture, against the promise. A share of 4000 has a standard error of .8 %
    /// at most, and the normal approximation of the noncentral t is within 2 %.
    #[test]
    fn the_promise_is_the_power_of_a_t_test() {
        let mut random = Random(3);
        let mut normal = || {
            let radius = (-2.0 * (1.0 - random.f64()).ln()).sqrt();
            radius * (std::f64::consts::TAU * random.f64()).cos()
        };
        let (n, trials) = (8, 4000);
        let critical = t_of_score(critical_value(1e-3 / 16.0), 14.0);
        for change in [2.0, 3.0, 4.0] {
            let mut found = 0;
            for _ in 0..trials {
                let moments = [0.0, change].map(|mean| {
                    let values: Vec<f64> = (0..n).map(|_| mean + normal()).collect();
                    let mean = values.iter().sum::<f64>() / f64::from(n);
                    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
                    (mean, squares / f64::from(n * (n - 1)))
                });
                let error = (moments[0].1 + moments[1].1).sqrt();
                found += usize::from((moments[1].0 - moments[0].0).abs() > critical * error);
            }
            // Detectable in units of the spread of a single value: σ is half of it.
            let square = critical * critical / 28.0;
            let stated = 0.5 * (critical * (1.0 - 0.25 / 14.0) + POWER * (1.0 + square).sqrt());
            let promised = statement(stated, 0.0).power(change, 1.0);
            let share = found as f64 / f64::from(trials);
            assert!((share - promised).abs() < 0.045, "{change}: {share} of {promised}");
        }
    }
}
