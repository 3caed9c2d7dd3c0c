//! Differences of averages in units of their standard errors, and what would have been noticed.

use super::areas::{AreaLayout, mean_and_variance};
use crate::image::compare::critical_value;
use crate::math::normal::{score_of_mean_square, score_of_t, t_of_score, upper_tail};
use crate::math::quantile::nearest_rank;
use crate::regress::evidence::Evidence;

/// Relative difference that rounding of single-precision sums may make: it counts as none.
pub const ROUNDING: f64 = 1e-6;

/// Relative standard error that is assumed at least, so that exact values can be compared: half a unit of the last place of an `f32`.
const LEAST_ERROR: f64 = 6e-8;

/// Degrees of freedom of variances of unknown origin.
const UNKNOWN_FREEDOM: f64 = 30.0;

/// Factor on variances of averages that were derived from variances of pixels, from several renderings and from a single one: what they
/// may be wrong by, because pixels are correlated.
const CAUTION: [f64; 2] = [1.25, 2.0];

/// Pixels and channels that count as one where nothing is known of their correlation.
const CORRELATED: f64 = 12.0;

/// Degrees of freedom of the variance of pixels.
pub fn freedom(evidence: &Evidence) -> f64 {
    if evidence.renderings > 1 { evidence.renderings as f64 - 1.0 } else { UNKNOWN_FREEDOM }
}

/// Score ([`crate::math::normal`]) of Welch's t, without sign, with the degrees of freedom by Welch and Satterthwaite: of a difference of
/// two means with these variances and their degrees of freedom.
pub fn welch_score(difference: f64, variance: [f64; 2], freedom: [f64; 2]) -> f64 {
    let sum = variance[0] + variance[1];
    if difference == 0.0 || sum <= 0.0 {
        return if difference == 0.0 { 0.0 } else { f64::INFINITY };
    }
    score_of_t(difference.abs() / sum.sqrt(), welch_freedom(variance, freedom))
}

/// Degrees of freedom of a sum of variances, of which one at least is positive.
fn welch_freedom(variance: [f64; 2], freedom: [f64; 2]) -> f64 {
    // In units of the sum, because squares of variances may underflow.
    let share = variance.map(|v| v / (variance[0] + variance[1]));
    1.0 / (share[0] * share[0] / freedom[0] + share[1] * share[1] / freedom[1])
}

/// One average of both evidences.
#[derive(Clone, Copy, Debug)]
pub struct Contrast {
    /// Its value now and in the reference.
    pub means: [f64; 2],
    /// Variances of these.
    pub variance: [f64; 2],
    /// Degrees of freedom of the variances.
    pub freedom: [f64; 2],
}

impl Contrast {
    /// Variance that rounding alone may explain.
    fn rounding(&self) -> f64 {
        let error = LEAST_ERROR * self.means[0].abs().max(self.means[1].abs());
        error * error
    }

    /// The difference by which both exceed the relative one that counts as none.
    fn excess(&self, relative: f64) -> f64 {
        let allowed = relative.max(ROUNDING) * self.means[0].abs().max(self.means[1].abs());
        ((self.means[0] - self.means[1]).abs() - allowed).max(0.0)
    }

    /// Score of the difference, without its sign, where a `relative` one counts as none.
    pub fn score(&self, relative: f64) -> f64 {
        welch_score(self.excess(relative), self.variance.map(|v| v + self.rounding()), self.freedom)
    }

    /// Standard error of the difference.
    pub fn error(&self) -> f64 {
        (self.variance[0] + self.variance[1]).sqrt()
    }

    /// Degrees of freedom of that error.
    fn joint_freedom(&self) -> f64 {
        welch_freedom(self.variance.map(|v| v + f64::MIN_POSITIVE), self.freedom)
    }

    /// Smallest relative change that a two-sided test at this level finds with a probability of 90 %. `None` where the reference is 0.
    ///
    /// The noncentral t distribution is taken as normal with the moments of its denominator (Johnson and Welch, *Applications of the
    /// Non-Central t-Distribution*, Biometrika 31, 1940).
    fn detectable(&self, level: f64) -> Option<f64> {
        /// 90 % quantile of the standard normal distribution.
        const POWER: f64 = 1.281_551_6;
        let freedom = self.joint_freedom();
        let critical = t_of_score(critical_value(level), freedom);
        let shift =
            critical * (1.0 - 0.25 / freedom) + POWER * (1.0 + critical * critical / (2.0 * freedom)).sqrt();
        let found = shift * self.error() / self.means[1].abs();
        found.is_finite().then_some(found)
    }

    /// Whether so few renderings were made that this level needs more than three times the difference that exact variances would.
    fn is_powerless(&self, level: f64) -> bool {
        let z = critical_value(level);
        t_of_score(z, self.joint_freedom()) > 3.0 * z
    }
}

/// All averages that are compared.
#[derive(Clone, Debug)]
pub struct Contrasts {
    /// Of the whole picture: red, green and blue; where both evidences have renderings also the factor of brightness, weighted by the
    /// precision of the areas.
    pub whole: Vec<Contrast>,
    /// Of the areas, three channels each.
    pub areas: Vec<Contrast>,
    /// Number of areas and channels that vary independently, about.
    pub independent: f64,
}

/// The statistics of a comparison, all of them scores but for the mean square of scores.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AreaStatistics {
    /// Largest score of the whole picture.
    pub whole: f64,
    /// Mean square of the areas' scores: about 1 without a change.
    pub square: f64,
    /// Largest score of an area.
    pub area: f64,
}

impl Contrasts {
    /// From the renderings' areas where both have them, otherwise from the variances of pixels: those pixels for which `used` holds.
    pub fn of(now: &Evidence, reference: &Evidence, used: &[bool]) -> Self {
        match Renderings::of(now, reference) {
            Some(renderings) => renderings.contrasts(),
            None => from_pixels([now, reference], used),
        }
    }

    /// Whether single renderings of both sides vary about alike, in sum over the areas: within a factor of 2.
    pub fn have_equal_effort(&self, renderings: [usize; 2]) -> bool {
        let sums = self.sums_of_variances();
        let ratio = sums[0] * renderings[0] as f64 / (sums[1] * renderings[1] as f64);
        ratio.is_nan() || (0.5..=2.0).contains(&ratio)
    }

    fn sums_of_variances(&self) -> [f64; 2] {
        std::array::from_fn(|side| self.areas.iter().map(|contrast| contrast.variance[side]).sum())
    }

    /// With variances for Student's distribution: those of either side not below those of the other side in proportion.
    ///
    /// Rare bright paths make the side that found none too dark and too sure of it. In a comparison of sides of equal effort and number
    /// this happens to both alike; otherwise the side with fewer samples would differ in many areas.
    pub fn cautious(mut self) -> Self {
        let [now, reference] = self.sums_of_variances();
        if now > 0.0 && reference > 0.0 {
            let ratio = now / reference;
            // Where one variance of the whole picture is 0, the other one already is that of both (`from_pixels`).
            let whole = self.whole.iter_mut().filter(|contrast| contrast.variance.iter().all(|v| *v > 0.0));
            for Contrast { variance, .. } in self.areas.iter_mut().chain(whole) {
                *variance = [variance[0].max(ratio * variance[1]), variance[1].max(variance[0] / ratio)];
            }
        }
        self
    }

    /// The statistics, where a `relative` difference counts as none.
    pub fn statistics(&self, relative: f64) -> AreaStatistics {
        let score = |contrast: &Contrast| contrast.score(relative);
        let areas: Vec<f64> = self.areas.iter().map(score).collect();
        AreaStatistics {
            whole: self.whole.iter().map(score).fold(0.0, f64::max),
            square: areas.iter().map(|z| z * z).sum::<f64>() / areas.len().max(1) as f64,
            area: areas.iter().copied().fold(0.0, f64::max),
        }
    }

    /// The area and channel of the largest score.
    pub fn largest(&self, relative: f64) -> Option<usize> {
        let scores = self.areas.iter().map(|contrast| contrast.score(relative)).enumerate();
        scores.filter(|(_, z)| *z > 0.0).max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
    }

    /// Probabilities of statistics as large if nothing changed, by the distributions of Student and χ²: whole picture, mean square, area. The
    /// variances should be [`Self::cautious`].
    pub fn p_values(&self, found: AreaStatistics) -> [f64; 3] {
        let varying = self.areas.iter().filter(|contrast| contrast.error() > 0.0).count();
        // Scores of areas that do not vary are 0, unless they changed, and then they are large. Where nothing varies, a change is certain.
        let share = varying as f64 / self.areas.len().max(1) as f64;
        let square = score_of_mean_square(found.square / share, self.independent);
        [
            bonferroni(found.whole, self.whole.len()),
            if found.square > 0.0 { upper_tail(square) } else { 1.0 },
            bonferroni(found.area, self.areas.len()),
        ]
    }

    /// Smallest relative change of the whole picture that a test at this level finds with 90 %.
    pub fn detectable(&self, level: f64) -> f64 {
        let each = level / self.whole.len().max(1) as f64;
        let found = self.whole.iter().filter_map(|contrast| contrast.detectable(each));
        found.min_by(f64::total_cmp).unwrap_or(0.0)
    }

    /// The same of an area: median over those that are not black.
    pub fn detectable_area(&self, level: f64) -> f64 {
        let each = level / self.areas.len().max(1) as f64;
        let mut found: Vec<f64> =
            self.areas.iter().filter_map(|contrast| contrast.detectable(each)).collect();
        found.sort_unstable_by(f64::total_cmp);
        nearest_rank(&found, 0.5).unwrap_or(0.0)
    }

    /// Whether there are too few renderings for this level, whatever is compared.
    pub fn is_powerless(&self, level: f64) -> bool {
        let each = level / self.whole.len().max(1) as f64;
        let noisy = || self.whole.iter().filter(|contrast| contrast.error() > 0.0);
        noisy().next().is_some() && noisy().all(|contrast| contrast.is_powerless(each))
    }
}

/// Probability that the largest of `count` scores, of either sign, is at least `score`: an upper bound.
pub fn bonferroni(score: f64, count: usize) -> f64 {
    (2.0 * upper_tail(score) * count as f64).min(1.0)
}

/// The averages of every rendering of both evidences: `[renderings][averages]`.
#[derive(Clone, Debug)]
pub struct Renderings {
    /// Now and in the reference.
    pub sides: [Vec<Vec<f64>>; 2],
    /// How many of the averages are of the whole picture; those of areas follow.
    pub whole: usize,
}

impl Renderings {
    /// `None` unless both have the areas of at least two renderings.
    pub fn of(now: &Evidence, reference: &Evidence) -> Option<Self> {
        let sides = [now, reference].map(averages);
        if sides.iter().any(|side| side.len() < 2) {
            return None;
        }
        let mut both = Self { sides, whole: 4 };
        // The factor of brightness: weights of least variance for a change in proportion to the areas' values, but none above what a
        // relative error of .1 % gets. They are the same for both sides, and do not depend on which rendering is of which.
        let weights: Vec<f64> = (3..both.count())
            .map(|column| {
                let all: Vec<f64> = both.sides.iter().flatten().map(|row| row[column]).collect();
                let (mean, variance) = mean_and_variance(all.into_iter());
                let least = 1e-3 * mean;
                if mean > 0.0 { mean / (variance + least * least) } else { 0.0 }
            })
            .collect();
        for row in both.sides.iter_mut().flatten() {
            let factor: f64 = row[3..].iter().zip(&weights).map(|(value, weight)| value * weight).sum();
            row.insert(3, factor);
        }
        Some(both)
    }

    /// Number of averages.
    pub fn count(&self) -> usize {
        self.sides[0].first().map_or(0, Vec::len)
    }

    /// Means and variances of the averages.
    fn contrasts(&self) -> Contrasts {
        let sizes: [f64; 2] = std::array::from_fn(|k| self.sides[k].len() as f64);
        let mut all: Vec<Contrast> = (0..self.count())
            .map(|column| {
                let moments: [(f64, f64); 2] =
                    std::array::from_fn(|k| mean_and_variance(self.sides[k].iter().map(|row| row[column])));
                Contrast {
                    means: moments.map(|(mean, _)| mean),
                    variance: std::array::from_fn(|k| moments[k].1 / sizes[k]),
                    freedom: sizes.map(|n| n - 1.0),
                }
            })
            .collect();
        let areas = all.split_off(self.whole);
        let more = if sizes[0] >= sizes[1] { 0 } else { 1 };
        let independent = independent(&self.sides[more], self.whole);
        Contrasts { whole: all, areas, independent }
    }
}

/// Averages of each rendering: red, green and blue of the whole picture, then those of the areas. Empty without areas.
fn averages(evidence: &Evidence) -> Vec<Vec<f64>> {
    let (width, height) = (evidence.mean.width(), evidence.mean.height());
    let sizes = AreaLayout::new(width, height).sizes(&vec![true; width * height]);
    let total = sizes.iter().sum::<f64>().max(1.0);
    let complete = evidence.areas.iter().filter(|areas| areas.len() == sizes.len());
    let rows = complete.map(|areas| {
        let mut row = vec![0.0; 3];
        for (area, size) in areas.iter().zip(&sizes) {
            for (sum, &value) in row.iter_mut().zip(area) {
                *sum += f64::from(value) * size / total;
            }
        }
        row.extend(areas.iter().flatten().map(|&value| f64::from(value)));
        row
    });
    rows.collect()
}

/// About how many of the averages behind the first `skipped` ones vary independently: (tr K)² / tr K² of their correlation matrix K, whose
/// second trace is estimated without bias (Bai and Saranadasa, *Effect of High Dimension*, Statistica Sinica 6, 1996).
fn independent(rows: &[Vec<f64>], skipped: usize) -> f64 {
    let n = rows.len();
    let columns = rows.first().map_or(0, Vec::len);
    let mut gram = vec![0.0; n * n];
    let mut varying = 0.0;
    for column in skipped..columns {
        let (mean, variance) = mean_and_variance(rows.iter().map(|row| row[column]));
        if variance > 0.0 {
            varying += 1.0;
            let scaled: Vec<f64> = rows.iter().map(|row| (row[column] - mean) / variance.sqrt()).collect();
            for (i, a) in scaled.iter().enumerate() {
                for (j, b) in scaled.iter().enumerate() {
                    gram[i * n + j] += a * b;
                }
            }
        }
    }
    if n < 4 {
        return (varying / CORRELATED).max(1.0);
    }
    let freedom = n as f64 - 1.0;
    let squares: f64 = gram.iter().map(|g| g * g).sum();
    let trace = freedom * varying;
    let second = (squares - trace * trace / freedom) / ((freedom - 1.0) * (freedom + 2.0));
    (varying * varying / second.max(varying).max(1.0)).max(1.0)
}

/// Sums over one side's pixels, by area and channel.
struct PixelSums {
    means: Vec<[f64; 3]>,
    /// Variance of the means if pixels were independent.
    variances: Vec<[f64; 3]>,
    whole: [f64; 3],
    whole_variance: [f64; 3],
}

impl PixelSums {
    fn of(evidence: &Evidence, used: &[bool]) -> Self {
        let layout = AreaLayout::new(evidence.mean.width(), evidence.mean.height());
        let total = used.iter().filter(|used| **used).count().max(1) as f64;
        let sum_of = |sums: &[[f64; 3]], by: f64| -> [f64; 3] {
            std::array::from_fn(|c| sums.iter().map(|sum| sum[c]).sum::<f64>() / by)
        };
        let sums = layout.sums(&evidence.variance, used);
        let sizes = layout.sizes(used);
        let variances = sums.iter().zip(&sizes).map(|(sum, n)| sum.map(|s| s / (n * n).max(1.0)));
        Self {
            means: layout.means(&evidence.mean, used),
            variances: variances.collect(),
            whole: sum_of(&layout.sums(&evidence.mean, used), total),
            whole_variance: sum_of(&sums, total * total),
        }
    }
}

/// Contrasts where at least one side has no renderings: the variance of its averages is that of its pixels, times what the correlation of
/// neighbouring pixels adds in the other side, or in the differences of both; and times [`CAUTION`].
fn from_pixels(sides: [&Evidence; 2], used: &[bool]) -> Contrasts {
    let sums = sides.map(|side| PixelSums::of(side, used));
    let caution = sides.map(|side| if side.renderings > 1 { CAUTION[0] } else { CAUTION[1] });
    let spread = sides.map(|side| {
        let rows = averages(side);
        if rows.len() < 2 { Vec::new() } else { rows }
    });
    let known = spread.iter().position(|rows| !rows.is_empty());
    // Variance of every average of the side that has renderings.
    let spread_of = |side: usize, column: usize| {
        let rows = &spread[side];
        mean_and_variance(rows.iter().map(|row| row[column])).1 / rows.len() as f64
    };
    let count = sums[0].means.len();
    let columns = || (0..count).flat_map(|area| (0..3).map(move |c| (area, c)));
    let ratios = columns().map(|(area, c)| match known {
        Some(side) => {
            let freedom = spread[side].len() as f64 - 1.0;
            // Median of χ² over its mean.
            let median = (1.0 - 2.0 / (9.0 * freedom)).powi(3);
            spread_of(side, 3 + 3 * area + c) / sums[side].variances[area][c] / median
        }
        None => {
            let difference = sums[0].means[area][c] - sums[1].means[area][c];
            // Median of χ² with one degree of freedom.
            difference * difference / (sums[0].variances[area][c] + sums[1].variances[area][c]) / 0.4549
        }
    });
    let mut ratios: Vec<f64> = ratios.filter(|ratio| ratio.is_finite()).collect();
    ratios.sort_unstable_by(f64::total_cmp);
    let correlation = nearest_rank(&ratios, 0.5).unwrap_or(1.0).max(1.0);
    let pixel_freedom = sides.map(freedom);
    let areas: Vec<Contrast> = columns()
        .map(|(area, c)| Contrast {
            means: std::array::from_fn(|side| sums[side].means[area][c]),
            variance: std::array::from_fn(|side| match known {
                Some(known) if known == side => spread_of(side, 3 + 3 * area + c),
                _ => sums[side].variances[area][c] * correlation * caution[side],
            }),
            freedom: pixel_freedom,
        })
        .collect();
    let whole = (0..3).map(|c| {
        let pixels: [f64; 2] = std::array::from_fn(|side| sums[side].whole_variance[c] * caution[side]);
        let (variance, freedom) = match known {
            // Both vary alike, so that the spread of the one says how much the other varies.
            Some(side) if pixels[side] > 0.0 => {
                let both = 1.0 + pixels[1 - side] / (pixels[side] / caution[side]);
                ([spread_of(side, c) * both, 0.0], [pixel_freedom[side]; 2])
            }
            _ => (pixels.map(|v| v * correlation), pixel_freedom),
        };
        Contrast { means: std::array::from_fn(|side| sums[side].whole[c]), variance, freedom }
    });
    let varying = areas.iter().filter(|contrast| contrast.error() > 0.0).count() as f64;
    let independent = known.map_or((varying / CORRELATED).max(1.0), |side| independent(&spread[side], 3));
    Contrasts { whole: whole.collect(), areas, independent }
}
