//! The audit of brightness: every unbiased method must give the picture the same mean luminance.
//!
//! Means come from the sums of samples and never from pictures, in which a pixel without samples would be black: the camera stream
//! gives the sum of luminance over the sum of weights, the light stream the sum of luminance over light paths. Each replicate of
//! each picture is one independent estimate, and their scatter tells the interval. Where single samples carry much of the light, the
//! scatter of a few estimates is too small more often than it is too large; an empirical Bernstein term, in proportion to the share
//! of the largest sample, covers what has not been sampled (Maurer, Pontil 2009).

use serde::{Deserialize, Serialize};

use crate::study::interval::{Interval, student, student_95};
use crate::study::replicates::Replicates;

/// Probability of a false alarm on either side, per method and study.
const FALSE_ALARM: f64 = 1e-5;

/// Smaller relative differences cause no alarm: single precision and spectral tables have as much.
const TOLERATED: f64 = 5e-4;

/// Factor of the largest sample's share in the empirical Bernstein bound, 7/3 · ln(2/δ), at the level of an alarm and of a 90 % interval.
const BERNSTEIN: [f64; 2] = [28.5, 7.0];

/// If there are enough others, estimates from less than this fraction of the longest one's paths are ignored: the variance of short renders
/// falls faster than with their paths and is not representative of long ones.
const SHORT: f64 = 0.05;

/// Number of estimates that count as enough.
const ENOUGH: usize = 4;

/// An independent estimate of the mean luminance of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeanLuminance {
    /// The estimate.
    pub value: f64,
    /// Number of paths of the estimate.
    pub paths: f64,
    /// Fraction contributed by its largest sample.
    pub largest: f64,
}

/// The brightness of one method's pictures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Brightness {
    /// Mean luminance over that of the other unbiased methods, with its 90 % interval.
    pub ratio: Interval,
    /// Whether the difference exceeds chance.
    pub alarm: bool,
}

/// The estimates of one method.
#[derive(Clone, Debug, Default)]
pub struct MethodMeans {
    /// Whether the method is biased by design: it is compared with others, but no other method is compared with it.
    pub biased: bool,
    /// Its independent estimates.
    pub means: Vec<MeanLuminance>,
}

/// Mean with its standard error and the fraction of its largest sample.
struct Pooled {
    mean: f64,
    error: f64,
    degrees: f64,
    largest: f64,
}

impl Replicates {
    /// Mean luminance of the picture in each replicate; `None` before it has traced paths.
    pub fn mean_luminances(&self) -> [Option<MeanLuminance>; 2] {
        // The largest sample of the picture, as a sum of luminance.
        let largest = self.largest.tiles().iter().map(|kept| f64::from(kept[0])).fold(0.0, f64::max);
        self.parts.each_ref().map(|part| {
            let sum = |sums: &[[f32; 4]], i: usize| sums.iter().map(|s| f64::from(s[i])).sum::<f64>();
            let (seen, weight) = (sum(&part.camera, 1), sum(&part.camera, 3));
            let mut mean = MeanLuminance {
                paths: part.paths.camera.max(part.paths.light) as f64,
                ..MeanLuminance::default()
            };
            if weight > 0.0 {
                mean.value += seen / weight;
                mean.largest = mean.largest.max(largest / weight);
            }
            if part.paths.light > 0 && !part.light.is_empty() {
                mean.value += sum(&part.light, 1) / part.paths.light as f64;
                // A sample belongs to one stream, but which is unknown, so the larger fraction is used.
                mean.largest = mean.largest.max(largest / part.paths.light as f64);
            }
            mean.largest /= mean.value.max(f64::MIN_POSITIVE);
            (mean.paths > 0.0 && mean.value > 0.0 && mean.value.is_finite()).then_some(mean)
        })
    }
}

/// Compares each method with the unbiased ones among the others, or with a given mean. `None` if there is nothing to compare with, or with
/// fewer than three estimates.
pub fn audit(methods: &[MethodMeans], given: Option<f64>) -> Vec<Option<Brightness>> {
    let pooled: Vec<Option<Pooled>> = methods.iter().map(|method| Pooled::of(&method.means)).collect();
    let compare = |i: usize| {
        let own = pooled[i].as_ref()?;
        let others = || {
            (0..methods.len()).filter(|&j| j != i && !methods[j].biased).filter_map(|j| pooled[j].as_ref())
        };
        let with = match given {
            Some(mean) => Pooled { mean, error: 0.0, degrees: f64::INFINITY, largest: 0.0 },
            None => Pooled::most_precise(others())?,
        };
        Some(own.compared(&with, methods[i].biased))
    };
    (0..methods.len()).map(compare).collect()
}

impl Pooled {
    /// Weighted mean of all estimates; their variances are assumed to be inversely proportional to their paths.
    fn of(means: &[MeanLuminance]) -> Option<Self> {
        if means.len() < 3 {
            return None;
        }
        let most = means.iter().map(|m| m.paths).fold(0.0, f64::max);
        let long: Vec<MeanLuminance> = means.iter().filter(|m| m.paths >= SHORT * most).copied().collect();
        let means = if long.len() >= ENOUGH { &long[..] } else { means };
        let paths: f64 = means.iter().map(|m| m.paths).sum();
        let mean = means.iter().map(|m| m.paths * m.value).sum::<f64>() / paths;
        let degrees = means.len() as f64 - 1.0;
        let unit = means.iter().map(|m| m.paths * (m.value - mean).powi(2)).sum::<f64>() / degrees;
        let largest =
            means.iter().map(|m| m.largest * m.value * m.paths).fold(0.0, f64::max) / (mean * paths);
        Some(Self { mean, error: (unit / paths).sqrt(), degrees, largest })
    }

    /// The method that makes the alarm most sensitive; a mean of several would inherit the worst of their tails.
    fn most_precise<'a>(all: impl Iterator<Item = &'a Self>) -> Option<Self> {
        let best = all.min_by(|a, b| a.half(0).iter().sum::<f64>().total_cmp(&b.half(0).iter().sum()))?;
        Some(Self { ..*best })
    }

    /// Half-widths of the relative interval at the level of an alarm (0) or of 90 % (1): from the scatter, and from the largest sample.
    fn half(&self, level: usize) -> [f64; 2] {
        let t = match level {
            0 => student(FALSE_ALARM, self.degrees),
            _ => student_95(self.degrees),
        };
        [t * self.error / self.mean.abs().max(f64::MIN_POSITIVE), BERNSTEIN[level] * self.largest]
    }

    fn compared(&self, with: &Self, biased: bool) -> Brightness {
        let ratio = self.mean / with.mean;
        // Both in units of the mean that is compared with.
        let half = |level: usize| {
            let [a, b] = self.half(level).map(|half| half * ratio.abs());
            let [c, d] = with.half(level);
            a.hypot(c) + b + d
        };
        let alarm = !biased && (ratio - 1.0).abs() > half(0).max(TOLERATED);
        let half = half(1);
        let ratio = Interval { value: ratio, low: (ratio - half).max(0.0), high: ratio + half };
        Brightness { ratio, alarm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    /// Estimates of `runs` pictures of growing length. `draw` yields a sample; an estimate is the mean of as many samples as it has paths.
    fn estimates(
        runs: usize,
        paths: f64,
        random: &mut Random,
        draw: fn(&mut Random) -> f64,
    ) -> Vec<MeanLuminance> {
        let one = |i: usize, random: &mut Random| {
            let n = paths * 2f64.powi(i as i32 / 2);
            let (mut sum, mut largest) = (0.0, 0.0f64);
            for _ in 0..n as usize {
                let sample = draw(random);
                (sum, largest) = (sum + sample, largest.max(sample));
            }
            MeanLuminance { value: sum / n, paths: n, largest: largest / sum }
        };
        (0..2 * runs).map(|i| one(i, random)).collect()
    }

    fn exponential(random: &mut Random) -> f64 {
        -(1.0 - random.f64()).ln()
    }

    /// A Pareto tail of exponent 1.5, whose variance is infinite, with the mean 1.
    fn pareto(random: &mut Random) -> f64 {
        (1.0 - random.f64()).powf(-1.0 / 1.5) / 3.0
    }

    /// One sample in 300 carries as much as all others together.
    fn rare(random: &mut Random) -> f64 {
        if random.f64() < 1.0 / 300.0 { 150.0 } else { 150.0 / 299.0 }
    }

    /// A thousand studies of four equal methods, one with few estimates, raise no alarm.
    #[test]
    fn clean_studies_raise_no_alarm() {
        for (seed, draw) in [(1, exponential as fn(&mut Random) -> f64), (2, pareto), (3, rare)] {
            let mut random = Random(seed);
            let mut held = [0usize; 2];
            for study in 0..1000 {
                let mut method =
                    |runs| MethodMeans { biased: false, means: estimates(runs, 60.0, &mut random, draw) };
                let methods = [method(2), method(3), method(5), method(4)];
                for found in audit(&methods, None).into_iter().flatten() {
                    assert!(!found.alarm, "seed {seed}, study {study}: {found:?}");
                    held = [held[0] + usize::from(found.ratio.holds(1.0)), held[1] + 1];
                }
            }
            assert!(held[0] as f64 > 0.88 * held[1] as f64, "seed {seed}: {held:?}");
        }
    }

    /// The scatter that path tracing and bidirectional tracing have in the Cornell box after 10 s: 5·10⁻⁵ of the mean.
    #[test]
    fn a_small_factor_is_found_where_noise_allows_it() {
        let mut random = Random(4);
        let mut means = |factor: f64| {
            let mut normal = || (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
            let mean = |i: i32| {
                let paths = 1e5 * 2f64.powi(i / 2);
                let value = factor * (1.0 + 5e-5 * normal() * (1e7 / paths).sqrt());
                MeanLuminance { value, paths, largest: 10.0 / paths }
            };
            MethodMeans { biased: false, means: (0..14).map(mean).collect() }
        };
        let mut found = 0;
        for _ in 0..200 {
            let alarms = audit(&[means(1.0), means(1.002)], None);
            found += usize::from(alarms[1].is_some_and(|b| b.alarm));
            let given = audit(&[means(1.002)], Some(1.0));
            assert!(given[0].is_some_and(|b| (b.ratio.value - 1.002).abs() < 5e-4));
        }
        assert!(found >= 190, "{found} of 200");
        let biased = MethodMeans { biased: true, ..means(1.1) };
        assert!(audit(&[means(1.0), biased], None)[1].is_some_and(|b| !b.alarm && b.ratio.low > 1.05));
        assert!(audit(&[means(1.0)], None)[0].is_none());
    }
}
