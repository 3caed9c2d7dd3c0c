//! Discrete distributions in one dimension: sampling an index in proportion to weights.

/// A sample of a [`Distribution`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampledIndex {
    /// The sampled index.
    pub index: usize,
    /// Its probability, exactly that with which it is sampled.
    pub probability: f32,
}

/// Entries with probabilities in proportion to weights. An entry of weight zero is never sampled.
///
/// Random numbers are multiples of 2⁻³² (cells), so a probability can only be a multiple of that. Each entry gets a whole number
/// of cells: its share, rounded, but at least one if its weight is positive. Its probability is that number times 2⁻³². So the
/// reported probability is the exact one, and an estimate that divides by it is unbiased, for any number of entries and any
/// weights.
#[derive(Clone, Debug)]
pub struct Distribution {
    /// Entry `i` owns the cells from `first[i]` up to `first[i + 1]`, from 0 to 2³².
    first: Vec<u64>,
}

/// Cells in [0, 1).
const CELLS: u64 = 1 << 32;

impl Distribution {
    /// A distribution in proportion to `weights`. `None` if there is no positive weight, if there are more of them than cells, or
    /// if one is negative or not finite.
    pub fn new(weights: &[f32]) -> Option<Self> {
        let weights: Vec<f64> = weights.iter().map(|w| f64::from(*w)).collect();
        Some(Self { first: boundaries(&weights, CELLS)? })
    }

    /// The probability of entry `index`, 0 if it does not exist.
    #[inline]
    pub fn probability(&self, index: usize) -> f32 {
        match self.first.get(index..index + 2) {
            // Rounded to single precision only here, so that `sample` returns the same bits.
            Some([from, to]) => (to - from) as f32 * (1.0 / CELLS as f32),
            _ => 0.0,
        }
    }

    /// Samples an entry by inversion of the cumulative distribution, with `u` in [0, 1).
    #[inline]
    pub fn sample(&self, u: f64) -> SampledIndex {
        // A cast from float saturates, and converts NaN to 0.
        let cell = ((u * CELLS as f64) as u64).min(CELLS - 1);
        // The entry that owns the cell. It is never one without cells.
        let index = self.first.partition_point(|first| *first <= cell) - 1;
        SampledIndex { index, probability: self.probability(index) }
    }
}

/// Distributes `cells` in proportion to `weights`: entry `i` owns the cells from the `i`-th number returned up to the next.
/// `None` as for [`Distribution::new`].
pub(super) fn boundaries(weights: &[f64], cells: u64) -> Option<Vec<u64>> {
    if weights.iter().any(|w| !(w.is_finite() && *w >= 0.0)) {
        return None;
    }
    let total: f64 = weights.iter().sum();
    let last = weights.iter().rposition(|w| *w > 0.0)?;
    let mut first = Vec::with_capacity(weights.len() + 1);
    let (mut sum, mut cell) = (0.0, 0);
    first.push(0);
    for w in weights {
        sum += w;
        if *w > 0.0 {
            cell = ((sum / total * cells as f64).round() as u64).max(cell + 1);
        }
        first.push(cell);
    }
    first[last + 1..].fill(cells);
    // Entries at the end that got a cell although their share rounds to 0 take it from those before them.
    for i in (0..=last).rev() {
        let room = first[i + 1].checked_sub(u64::from(weights[i] > 0.0))?;
        first[i] = first[i].min(room);
    }
    Some(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    const EDGES: [f64; 5] = [0.0, f64::MIN_POSITIVE, 0.5, 1.0 - 1.0 / CELLS as f64, 1.0 - f64::EPSILON / 2.0];

    #[test]
    fn chooses_in_proportion_to_the_weights() {
        let weights = [1.0, 0.0, 3.0, 0.5, 0.0, 2.5, 0.0];
        let d = Distribution::new(&weights).expect("positive weights");
        let n = 70_000;
        let mut counts = [0; 7];
        for i in 0..n {
            let choice = d.sample((f64::from(i) + 0.5) / f64::from(n));
            assert_eq!(choice.probability, d.probability(choice.index));
            counts[choice.index] += 1;
        }
        for (i, w) in weights.iter().enumerate() {
            // Evenly spaced numbers: each count is exact but for one at either end.
            assert!((f64::from(counts[i]) - f64::from(*w) * 10_000.0).abs() <= 2.0, "{i}: {counts:?}");
            assert!((d.probability(i) - w / 7.0).abs() < 1e-7);
        }
        assert_eq!((d.probability(7), d.probability(usize::MAX - 2)), (0.0, 0.0));
    }

    /// The reported probability is the exact one, for every single entry: its cells are found from both ends. With the former
    /// 24 bits, 1e5 equal entries were off by up to half a percent and 1e6 by up to 6 %.
    #[test]
    fn the_probability_reported_is_the_one_realised() {
        let cell = |i: u64| (i as f64 + 0.5) / CELLS as f64;
        for n in [1, 3, 100_000, 1_000_000] {
            let equal = vec![0.1; n];
            let wild: Vec<f32> =
                (0..n).map(|i| 10f32.powi((i.wrapping_mul(2_654_435_761) >> 7) as i32 % 18)).collect();
            for weights in [&equal, &wild] {
                let d = Distribution::new(weights).expect("positive weights");
                let mut next = 0;
                for i in 0..n {
                    // The probability is a whole number of cells; it is exact below 2²⁴ of them.
                    let owned = (f64::from(d.probability(i)) * CELLS as f64) as u64;
                    assert!(owned >= 1, "entry {i} of {n} is never chosen");
                    let rounding = owned >> 24;
                    assert_eq!(d.sample(cell(next + rounding)).index, i, "of {n}, first cell");
                    assert_eq!(d.sample(cell(next + owned - 1 - rounding)).index, i, "of {n}, last cell");
                    next = d.first[i + 1];
                }
                assert_eq!(next, CELLS);
            }
            // The naive way: 24 bits, of which an entry gets those that lie in the middle of its share.
            let d = Distribution::new(&equal).expect("positive weights");
            let off = |owned: f64| (owned * n as f64 / CELLS as f64 - 1.0).abs();
            let (mut worst, mut worst_naive) = (0f64, 0f64);
            for pair in d.first.windows(2) {
                worst = worst.max(off((pair[1] - pair[0]) as f64));
                worst_naive =
                    worst_naive.max(off((((pair[1] + 127) >> 8) - ((pair[0] + 127) >> 8)) as f64 * 256.0));
            }
            assert!(worst < 3e-4, "{n} equal entries differ by {worst}");
            assert!(n < 100_000 || worst_naive > 2e-3, "the case is too easy: {worst_naive}");
        }
    }

    #[test]
    fn the_smallest_still_have_a_cell() {
        for weights in [&[1e-30, 1e30, 1e-38][..], &[1e30, 1e-45, 1e-45, 1e-45], &[1e-45, 0.0, 3e38, 0.0]] {
            let d = Distribution::new(weights).expect("positive weights");
            for (i, w) in weights.iter().enumerate() {
                assert_eq!(*w > 0.0, d.probability(i) > 0.0, "{weights:?}: {i}");
            }
        }
    }

    #[test]
    fn never_chooses_a_weight_of_zero() {
        for weights in
            [&[0.0, 0.0, 1.0, 0.0][..], &[0.0, 1e-30, 0.0, 1e30, 0.0], &[0.1; 1000], &[0.0, 1e-45, 0.0]]
        {
            let d = Distribution::new(weights).expect("a positive weight");
            for u in EDGES.into_iter().chain((0..1000).map(|i| f64::from(i) / 1000.0)) {
                let choice = d.sample(u);
                assert!(weights[choice.index] > 0.0, "{u}: {choice:?}");
                assert!(choice.probability > 0.0, "{u}: {choice:?}");
            }
        }
    }

    #[test]
    fn refuses_what_has_no_distribution() {
        for weights in [&[][..], &[0.0, 0.0], &[1.0, -1.0], &[f32::NAN], &[f32::INFINITY, 1.0]] {
            assert!(Distribution::new(weights).is_none(), "{weights:?}");
        }
        let d = Distribution::new(&[1.0, 1.0]).expect("positive weights");
        assert_eq!([7.0, -1.0, f64::NAN, f64::INFINITY].map(|u| d.sample(u).index), [1, 0, 0, 1]);
    }
}
