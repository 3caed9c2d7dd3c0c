//! Discrete distributions: choosing one of many in proportion to weights.

/// A choice made by [`Distribution::sample`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Which entry.
    pub index: usize,
    /// Its probability.
    pub probability: f32,
    /// What is left of the random number: uniform in [0, 1), to be used again.
    pub u: f32,
}

/// Entries with probabilities in proportion to weights. An entry of weight zero is never chosen.
#[derive(Clone, Debug)]
pub struct Distribution {
    /// `cumulative[i]` is the probability of the entries before `i`; the last is exactly 1.
    cumulative: Vec<f64>,
    /// Sum of the weights.
    total: f64,
}

/// Random numbers are multiples of 2⁻²⁴. Taken in the middle of their cell, none falls on the edge of an entry,
/// and one that is much narrower than a cell is not chosen a million times too often because a cell begins there.
const HALF_CELL: f64 = 0.5 / 16_777_216.0;

/// The largest f32 below 1.
const ONE_MINUS_EPSILON: f32 = 1.0 - f32::EPSILON / 2.0;

impl Distribution {
    /// A distribution in proportion to `weights`; `None` if there is no positive weight, or if one is negative or
    /// not finite.
    pub fn new(weights: &[f32]) -> Option<Self> {
        if weights.iter().any(|w| !(w.is_finite() && *w >= 0.0)) {
            return None;
        }
        let total: f64 = weights.iter().map(|w| f64::from(*w)).sum();
        let last = weights.iter().rposition(|w| *w > 0.0)?;
        let mut sum = 0.0;
        let mut cumulative: Vec<f64> = std::iter::once(0.0)
            .chain(weights.iter().map(|w| {
                sum += f64::from(*w);
                sum / total
            }))
            .collect();
        // Rounding must not leave a gap before 1, nor open one for entries of weight zero after the last.
        cumulative[last + 1..].fill(1.0);
        Some(Self { cumulative, total })
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.cumulative.len() - 1
    }

    /// Never true: a distribution has at least one entry that can be chosen.
    pub fn is_empty(&self) -> bool {
        false
    }

    /// Sum of the weights.
    pub fn total(&self) -> f32 {
        self.total as f32
    }

    /// The probability of entry `index`; 0 for one that does not exist.
    pub fn probability(&self, index: usize) -> f32 {
        match self.cumulative.get(index..index + 2) {
            Some([below, up_to]) => (up_to - below) as f32,
            _ => 0.0,
        }
    }

    /// Chooses an entry by inversion of the cumulative distribution, from `u` in [0, 1).
    #[inline]
    pub fn sample(&self, u: f32) -> Choice {
        let target = f64::from(u.clamp(0.0, ONE_MINUS_EPSILON)) + HALF_CELL;
        // The entry whose interval [below, up to) holds the target: never one of width zero.
        let above = self.cumulative.partition_point(|c| *c <= target);
        let index = above.clamp(1, self.len()) - 1;
        let (below, up_to) = (self.cumulative[index], self.cumulative[index + 1]);
        let rest = ((target - below) / (up_to - below)) as f32;
        // What has been chosen has a chance, even where single precision would call it zero.
        let probability = ((up_to - below) as f32).max(f32::MIN_POSITIVE);
        Choice { index, probability, u: rest.clamp(0.0, ONE_MINUS_EPSILON) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EDGES: [f32; 5] =
        [0.0, f32::MIN_POSITIVE, 0.5, ONE_MINUS_EPSILON - f32::EPSILON, ONE_MINUS_EPSILON];

    #[test]
    fn chooses_in_proportion_to_the_weights() {
        let weights = [1.0, 0.0, 3.0, 0.5, 0.0, 2.5, 0.0];
        let d = Distribution::new(&weights).expect("positive weights");
        assert_eq!((d.len(), d.total()), (7, 7.0));
        let n = 70_000;
        let mut counts = [0; 7];
        for i in 0..n {
            let choice = d.sample((i as f32 + 0.5) / n as f32);
            assert_eq!(choice.probability, d.probability(choice.index));
            assert!((0.0..1.0).contains(&choice.u));
            counts[choice.index] += 1;
        }
        for (i, w) in weights.iter().enumerate() {
            // Evenly spaced numbers: each count is exact but for one at either end.
            assert!((f64::from(counts[i]) - f64::from(*w) * 10_000.0).abs() <= 2.0, "{i}: {counts:?}");
            assert!((d.probability(i) - w / 7.0).abs() < 1e-7);
        }
        assert_eq!(d.probability(7), 0.0);
    }

    #[test]
    fn never_chooses_a_weight_of_zero() {
        for weights in
            [&[0.0, 0.0, 1.0, 0.0][..], &[0.0, 1e-30, 0.0, 1e30, 0.0], &[0.1; 1000], &[0.0, 1e-45, 0.0]]
        {
            let d = Distribution::new(weights).expect("a positive weight");
            for u in EDGES.into_iter().chain((0..1000).map(|i| i as f32 / 1000.0)) {
                let choice = d.sample(u);
                assert!(weights[choice.index] > 0.0, "{u}: {choice:?}");
                assert!(choice.probability > 0.0 && (0.0..1.0).contains(&choice.u), "{u}: {choice:?}");
            }
        }
    }

    #[test]
    fn the_rest_is_uniform_and_can_be_used_again() {
        let d = Distribution::new(&[2.0, 1.0, 5.0]).expect("positive weights");
        let n = 80_000;
        let mut bins = [[0; 10]; 3];
        for i in 0..n {
            let choice = d.sample((i as f32 + 0.5) / n as f32);
            bins[choice.index][(choice.u * 10.0) as usize] += 1;
        }
        for (entry, expected) in bins.iter().zip([2000, 1000, 5000]) {
            assert!(entry.iter().all(|c| i32::abs(c - expected) <= 20), "{bins:?}");
        }
    }

    #[test]
    fn refuses_what_has_no_distribution() {
        for weights in [&[][..], &[0.0, 0.0], &[1.0, -1.0], &[f32::NAN], &[f32::INFINITY, 1.0]] {
            assert!(Distribution::new(weights).is_none(), "{weights:?}");
        }
        let choice = Distribution::new(&[1.0, 1.0]).expect("positive weights").sample(7.0);
        assert_eq!(choice.index, 1);
    }
}
