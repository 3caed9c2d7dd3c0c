//! The last values of a series, with exact percentiles.

use std::collections::VecDeque;

use crate::math::quantile::nearest_rank;

/// Number of frames that the graph shows.
pub const FRAMES: usize = 240;

/// The last `capacity` values, oldest first.
#[derive(Clone, Debug)]
pub struct RecentValues {
    values: VecDeque<f32>,
    capacity: usize,
}

impl RecentValues {
    /// Room for `capacity` values, at least 1.
    pub fn new(capacity: usize) -> Self {
        let capacity = capacity.max(1);
        Self { values: VecDeque::with_capacity(capacity), capacity }
    }

    /// Adds a value, and drops the oldest where there is no room. A NaN is ignored.
    pub fn push(&mut self, value: f32) {
        if value.is_nan() {
            return;
        }
        if self.values.len() == self.capacity {
            self.values.pop_front();
        }
        self.values.push_back(value);
    }

    /// The values, oldest first.
    pub fn iter(&self) -> impl Iterator<Item = f32> + '_ {
        self.values.iter().copied()
    }

    /// The last value.
    pub fn last(&self) -> Option<f32> {
        self.values.back().copied()
    }

    /// The percentiles `q` by nearest rank; zeros without values.
    pub fn percentiles<const N: usize>(&self, q: [f64; N]) -> [f32; N] {
        let mut sorted: Vec<f32> = self.iter().collect();
        sorted.sort_unstable_by(f32::total_cmp);
        q.map(|q| nearest_rank(&sorted, q / 100.0).unwrap_or(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_nearest_ranks() {
        let mut recent = RecentValues::new(100);
        assert_eq!(recent.percentiles([50.0, 99.0]), [0.0, 0.0]);
        for value in (1..=100).rev() {
            recent.push(value as f32);
        }
        assert_eq!(
            recent.percentiles([0.0, 1.0, 50.0, 95.0, 99.0, 100.0]),
            [1.0, 1.0, 50.0, 95.0, 99.0, 100.0]
        );
        let mut few = RecentValues::new(8);
        few.push(3.0);
        few.push(f32::NAN);
        few.push(1.0);
        assert_eq!(few.percentiles([50.0, 95.0]), [1.0, 3.0]);
    }

    #[test]
    fn only_the_last_values_count() {
        let mut recent = RecentValues::new(3);
        [9.0, 1.0, 2.0, 3.0].into_iter().for_each(|v| recent.push(v));
        assert_eq!(recent.iter().collect::<Vec<_>>(), [1.0, 2.0, 3.0]);
        assert_eq!(recent.last(), Some(3.0));
    }
}
