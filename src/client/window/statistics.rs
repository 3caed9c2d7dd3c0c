//! The most recent values of a series, with exact percentiles.

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

    /// Adds a value; drops the oldest if full. NaN is ignored.
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

    /// Nearest-rank percentiles at the quantiles `q`; zeros without values.
    pub fn percentiles<const N: usize>(&self, q: [f64; N]) -> [f32; N] {
        let mut sorted: Vec<f32> = self.iter().collect();
        sorted.sort_unstable_by(f32::total_cmp);
        q.map(|q| nearest_rank(&sorted, q / 100.0).unwrap_or(0.0))
    }
}
