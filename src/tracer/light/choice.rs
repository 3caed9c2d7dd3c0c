//! Choosing one of many by weight.

/// A discrete distribution.
#[derive(Clone, Debug, Default)]
pub struct Choice {
    /// Upper ends of the cumulative distribution; the last is 1.
    ends: Vec<f32>,
}

impl Choice {
    /// Probabilities in proportion to `weights`; even ones when their sum is zero or not finite.
    pub fn new(weights: &[f64]) -> Self {
        let sum: f64 = weights.iter().sum();
        let even = !(sum > 0.0 && sum.is_finite()) || weights.iter().any(|w| *w < 0.0);
        let share = |w: f64| if even { 1.0 / weights.len() as f64 } else { w / sum };
        let mut end = 0.0;
        let mut ends: Vec<f32> = weights
            .iter()
            .map(|&w| {
                end += share(w);
                end as f32
            })
            .collect();
        // Rounding must not leave a gap at the top, nor give it to something that has no weight.
        if let Some(&top) = ends.last() {
            ends.iter_mut().filter(|e| **e >= top).for_each(|e| *e = 1.0);
        }
        Self { ends }
    }

    /// The index that `u` in [0, 1) falls on and its probability, `None` of nothing.
    #[inline]
    pub fn sample(&self, u: f32) -> Option<(usize, f32)> {
        if self.ends.len() == 1 {
            return Some((0, 1.0));
        }
        let i = self.ends.partition_point(|&end| end <= u);
        (i < self.ends.len()).then(|| (i, self.probability(i)))
    }

    /// The probability of an index: of exactly the numbers that select it.
    #[inline]
    pub fn probability(&self, i: usize) -> f32 {
        if i == 0 { self.ends[0] } else { self.ends[i] - self.ends[i - 1] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_follow_the_weights_and_sum_to_one() {
        let c = Choice::new(&[1.0, 0.0, 3.0, 0.0]);
        assert_eq!((0..4).map(|i| c.probability(i)).collect::<Vec<_>>(), [0.25, 0.0, 0.75, 0.0]);
        assert_eq!(c.sample(0.2), Some((0, 0.25)));
        assert_eq!(c.sample(0.25), Some((2, 0.75)));
        assert_eq!(c.sample(0.999_999_94), Some((2, 0.75)));
        assert_eq!(Choice::new(&[]).sample(0.5), None);
        assert_eq!(Choice::new(&[0.0, 0.0]).probability(1), 0.5);
        let many = Choice::new(&vec![1e-30; 100_000]);
        let sum: f64 = (0..100_000).map(|i| f64::from(many.probability(i))).sum();
        assert!((sum - 1.0).abs() < 1e-6);
    }
}
