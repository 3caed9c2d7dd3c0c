//! Probabilities by exchanging renderings between both sets.
//!
//! If nothing changed, every assignment of the renderings to the two sets is equally probable, whatever their distribution is: fireflies,
//! correlation of neighbouring pixels and channels, and that of quasi-Monte Carlo points within a rendering are in every assignment
//! alike. The share of assignments whose statistic is as large as the one found is the p value. The statistics are studentised, so that
//! it also holds, for many renderings, where the effort of both sets differs a little (Chung and Romano, *Exact and Asymptotically Robust
//! Permutation Tests*, Ann. Stat. 41, 2013).

use super::contrast::{AreaStatistics, Renderings, welch_score};
use crate::math::normal::{score_of_mean_square, upper_tail};
use crate::math::random::Random;

/// Most assignments that are drawn.
const DRAWS: usize = 4000;

/// Once this many were as large as the one found, no more are drawn (Besag and Clifford, *Sequential Monte Carlo p-Values*, Biometrika 78,
/// 1991).
const ENOUGH: usize = 20;

/// With fewer assignments than this, the one found is itself drawn too often for the tail to be known.
const FEWEST_ASSIGNMENTS: f64 = 800.0;

/// Variance that is added in units of the total one, against rounding of sums of squares.
const ROUNDING_OF_SQUARES: f64 = 1e-12;

/// Relative variance that rounding of single-precision values may make.
const ROUNDING_OF_VALUES: f64 = 4e-15;

/// The most that are drawn for the whole picture, which has few averages: about a second.
const MOST_DRAWS: f64 = (1 << 20) as f64;

/// For the whole picture draws are made until this many are expected to be beyond the level.
const DRAWS_BEYOND: f64 = 10.0;

/// So many assignments must there be for each draw, so that the one found is not drawn itself.
const ASSIGNMENTS_PER_DRAW: f64 = 40.0;

/// An extrapolated p value of the whole picture above this multiple of the level is left as it is: what distributions other than the normal one
/// make of it is less than that.
const FAR_ABOVE: f64 = 30.0;

/// P values of the largest score of the whole picture, of the mean square of the areas' scores, and of the largest of an area. `None` where too few
/// assignments exist.
///
/// The p value of the whole picture is compared with `level`. Where it is extrapolated and not far above that, more assignments are drawn:
/// a few averages may have any distribution. The mean square of the areas is a sum of hundreds or thousands, and so nearly distributed as χ²;
/// and one of 200 of the largest of so many areas is far out in the tail of each, which is only continued from there.
pub fn p_values(renderings: &Renderings, found: AreaStatistics, level: f64) -> Option<[f64; 3]> {
    let sizes: [usize; 2] = std::array::from_fn(|k| renderings.sides[k].len());
    let few = sizes[0].min(sizes[1]);
    let assignments = assignments(sizes[0] + sizes[1], few);
    if assignments < FEWEST_ASSIGNMENTS {
        return None;
    }
    let mut pool = Pool::of(renderings);
    let [whole, square, area] = draw(&pool, few, DRAWS, found);
    let is_drawn = whole.is_decided();
    let mut whole = whole.p_value(upper_tail);
    let draws = (DRAWS_BEYOND / level).min(assignments / ASSIGNMENTS_PER_DRAW).min(MOST_DRAWS) as usize;
    if !is_drawn && whole < FAR_ABOVE * level && draws > DRAWS {
        pool.keep_whole();
        let [more, ..] = draw(&pool, few, draws, AreaStatistics { square: 0.0, area: 0.0, ..found });
        whole = more.p_value(upper_tail);
    }
    Some([whole, square.p_value_of_mean_square(), area.p_value(upper_tail)])
}

/// Draws assignments of which one set has `few` renderings, until all statistics are decided.
fn draw(pool: &Pool, few: usize, draws: usize, found: AreaStatistics) -> [Tally; 3] {
    let mut counts = [found.whole, found.square, found.area].map(Tally::new);
    let mut order: Vec<usize> = (0..pool.rows.len()).collect();
    // The same in every run.
    let mut random = Random(0x5eed);
    for _ in 0..draws {
        if counts.iter().all(Tally::is_decided) {
            break;
        }
        for i in 0..few {
            let other = i + random.below(order.len() - i);
            order.swap(i, other);
        }
        let AreaStatistics { whole, square, area } = pool.statistics(&order[..few]);
        for (count, value) in counts.iter_mut().zip([whole, square, area]) {
            count.add(value);
        }
    }
    counts
}

/// Number of ways to choose `few` of `all`.
fn assignments(all: usize, few: usize) -> f64 {
    (0..few).map(|i| (all - i) as f64 / (i + 1) as f64).product()
}

/// All renderings, each average as its deviation from the mean of all in units of their spread.
struct Pool {
    rows: Vec<Vec<f64>>,
    whole: usize,
    /// Sum of the squares of each average over the renderings.
    squares: Vec<f64>,
    /// Variance of each average that is taken for rounding.
    rounding: Vec<f64>,
}

impl Pool {
    fn of(renderings: &Renderings) -> Self {
        let mut rows: Vec<Vec<f64>> = renderings.sides.iter().flatten().cloned().collect();
        let n = rows.len() as f64;
        let (mut squares, mut rounding) = (Vec::new(), Vec::new());
        for column in 0..renderings.count() {
            let mean = rows.iter().map(|row| row[column]).sum::<f64>() / n;
            let sum: f64 = rows.iter().map(|row| (row[column] - mean).powi(2)).sum();
            let spread = if sum > 0.0 { (sum / n).sqrt() } else { 1.0 };
            for row in &mut rows {
                row[column] = (row[column] - mean) / spread;
            }
            squares.push(if sum > 0.0 { n } else { 0.0 });
            rounding.push(ROUNDING_OF_SQUARES + ROUNDING_OF_VALUES * (mean / spread).powi(2));
        }
        Self { rows, whole: renderings.whole, squares, rounding }
    }

    /// Forgets the areas.
    fn keep_whole(&mut self) {
        self.rows.iter_mut().for_each(|row| row.truncate(self.whole));
        self.squares.truncate(self.whole);
        self.rounding.truncate(self.whole);
    }

    /// The statistics if these renderings were one of the sets.
    fn statistics(&self, chosen: &[usize]) -> AreaStatistics {
        let count = self.squares.len();
        let (mut sums, mut squares) = (vec![0.0; count], vec![0.0; count]);
        for &rendering in chosen {
            for ((sum, square), value) in sums.iter_mut().zip(&mut squares).zip(&self.rows[rendering]) {
                *sum += value;
                *square += value * value;
            }
        }
        let n = [chosen.len() as f64, (self.rows.len() - chosen.len()) as f64];
        let mut statistics = AreaStatistics { whole: 0.0, square: 0.0, area: 0.0 };
        for column in 0..count {
            // The deviations of all renderings add to 0.
            let sum = [sums[column], -sums[column]];
            let square = [squares[column], self.squares[column] - squares[column]];
            let variance: [f64; 2] = std::array::from_fn(|k| {
                let within = (square[k] - sum[k] * sum[k] / n[k]).max(0.0);
                within / ((n[k] - 1.0) * n[k]) + self.rounding[column]
            });
            let difference = sum[0] / n[0] - sum[1] / n[1];
            let score = welch_score(difference, variance, [n[0] - 1.0, n[1] - 1.0]);
            if column < self.whole {
                statistics.whole = statistics.whole.max(score);
            } else {
                statistics.area = statistics.area.max(score);
                statistics.square += score * score;
            }
        }
        statistics.square /= (count - self.whole).max(1) as f64;
        statistics
    }
}

/// How often a statistic was as large as the one found.
struct Tally {
    found: f64,
    drawn: Vec<f64>,
    as_large: usize,
}

impl Tally {
    fn new(found: f64) -> Self {
        Self { found, drawn: Vec::new(), as_large: 0 }
    }

    fn is_decided(&self) -> bool {
        self.as_large >= ENOUGH
    }

    fn add(&mut self, value: f64) {
        if !self.is_decided() {
            self.drawn.push(value);
            self.as_large += usize::from(value >= self.found);
        }
    }

    /// The share that was as large or, where these are too few, the share of the [`ENOUGH`] largest times the ratio of `tail` at the one
    /// found to that at the least of these: the tail that was drawn is continued by one of this shape.
    fn p_value(mut self, tail: impl Fn(f64) -> f64) -> f64 {
        let share = ENOUGH as f64 / self.drawn.len().max(ENOUGH) as f64;
        if self.is_decided() {
            return share;
        }
        self.drawn.sort_unstable_by(|a, b| b.total_cmp(a));
        let last = self.drawn.get(ENOUGH - 1).copied().unwrap_or(0.0);
        share * (tail(self.found) / tail(last)).min(1.0)
    }

    /// For a mean square: the shape is that of χ² with as many degrees of freedom as the draws' variance says.
    fn p_value_of_mean_square(self) -> f64 {
        let n = self.drawn.len().max(1) as f64;
        let mean = self.drawn.iter().sum::<f64>() / n;
        let variance = self.drawn.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n;
        let freedom = 2.0 * mean * mean / variance;
        self.p_value(|value| {
            if freedom.is_finite() && freedom > 0.0 {
                upper_tail(score_of_mean_square(value / mean, freedom))
            } else {
                1.0
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn assignments_are_counted() {
        assert_eq!(
            (assignments(16, 8).round(), assignments(12, 6).round(), assignments(10, 1).round()),
            (12870.0, 924.0, 10.0)
        );
    }

    #[test]
    fn p_values_are_shares_and_continue_beyond_them() {
        let tally = |found: f64, draws: usize| {
            let mut tally = Tally::new(found);
            (0..draws).for_each(|i| tally.add(3.0 * i as f64 / draws as f64));
            tally
        };
        // A third is as large: drawing stops early.
        assert!((tally(1.0, 4000).p_value(upper_tail) - ENOUGH as f64 / 1353.0).abs() < 0.002);
        let beyond = tally(6.0, 4000).p_value(upper_tail);
        let expected = 0.005 * upper_tail(6.0) / upper_tail(3.0 * 3980.0 / 4000.0);
        assert!((beyond / expected - 1.0).abs() < 1e-9, "{beyond} {expected}");
        assert_eq!(tally(0.0, 4000).p_value_of_mean_square(), 1.0);
        let beyond = tally(20.0, 4000).p_value_of_mean_square();
        assert!(beyond > 0.0 && beyond < 1e-5, "{beyond}");
    }

    /// Of 20 renderings of value 1 and 20 of value −1, a set of 14 has 13 or more alike with a probability that is known; extrapolated from one of 200
    /// it is 140 times too small.
    #[test]
    fn tails_of_whole_pictures_are_drawn_where_they_decide() {
        let row = |value: f64| vec![value, 1.0];
        let side = |ones: usize, others: usize| [vec![row(1.0); ones], vec![row(-1.0); others]].concat();
        let renderings = Renderings { sides: [side(13, 1), side(7, 19)], whole: 1 };
        let first: Vec<usize> = (0..14).collect();
        let found = Pool::of(&renderings).statistics(&first);
        let exact = 1.3696e-4;
        let p_of = |level: f64| p_values(&renderings, found, level).expect("enough assignments")[0];
        let [extrapolated, drawn] = [1e-12, 5e-5].map(p_of);
        assert!((0.6..1.7).contains(&(drawn / exact)), "{drawn} instead of {exact}");
        assert!(extrapolated < exact / 30.0, "{extrapolated}");
    }
}
