//! The last frame times and edit latencies, with exact percentiles.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Number of frames that the graph shows.
pub const FRAMES: usize = 240;

/// Number of edits whose latencies are kept.
const EDITS: usize = 100;

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

    /// Nearest-rank percentiles: the least value that at least `q` per cent of the values do not exceed; zeros without
    /// values.
    pub fn percentiles<const N: usize>(&self, q: [f64; N]) -> [f32; N] {
        let mut sorted: Vec<f32> = self.iter().collect();
        sorted.sort_unstable_by(f32::total_cmp);
        q.map(|q| {
            let rank = (q / 100.0 * sorted.len() as f64).ceil() as usize;
            sorted.get(rank.clamp(1, sorted.len().max(1)) - 1).copied().unwrap_or(0.0)
        })
    }
}

/// Frame times and edit latencies.
#[derive(Clone, Debug)]
pub struct FrameStatistics {
    frames: RecentValues,
    edits: RecentValues,
    last_frame: Option<Instant>,
    /// The oldest edit that no epoch contains yet.
    noted: Option<Instant>,
    /// The oldest edit that the present epoch contains and no presented picture shows.
    waiting: Option<Instant>,
}

impl Default for FrameStatistics {
    fn default() -> Self {
        Self {
            frames: RecentValues::new(FRAMES),
            edits: RecentValues::new(EDITS),
            last_frame: None,
            noted: None,
            waiting: None,
        }
    }
}

impl FrameStatistics {
    /// A picture was presented now; `shows` is the edit that it is the first to show, as [`shown`](Self::shown) told it.
    pub fn frame(&mut self, now: Instant, shows: Option<Instant>) {
        if let Some(before) = self.last_frame.replace(now) {
            self.frames.push(milliseconds(now.saturating_duration_since(before)));
        }
        if let Some(edited) = shows {
            self.edits.push(milliseconds(now.saturating_duration_since(edited)));
        }
    }

    /// Something was edited now. While edits wait for their picture, the time counts from the first.
    pub fn edit(&mut self, now: Instant) {
        self.noted.get_or_insert(now);
    }

    /// An epoch begins that contains all edits so far.
    pub fn epoch(&mut self) {
        let noted = self.noted.take();
        self.waiting = self.waiting.or(noted);
    }

    /// A picture of the present epoch is on its way: the edit that it is the first to show. Later edits are not in it.
    pub fn shown(&mut self) -> Option<Instant> {
        self.waiting.take()
    }

    /// Nothing is drawn for a while (minimised, asleep): the gap is not a frame time.
    pub fn pause(&mut self) {
        self.last_frame = None;
    }

    /// Frame times, oldest first, milliseconds.
    pub fn frames(&self) -> Vec<f32> {
        self.frames.iter().collect()
    }

    /// p50, p95, p99 of the frame times, milliseconds.
    pub fn percentiles(&self) -> [f32; 3] {
        self.frames.percentiles([50.0, 95.0, 99.0])
    }

    /// Time from the last edit to the first picture that shows it.
    pub fn edit_latency(&self) -> Option<Duration> {
        self.edits.last().map(duration)
    }

    /// p95 of the last edits' latencies.
    pub fn edit_latency_p95(&self) -> Option<Duration> {
        self.edits.last().map(|_| duration(self.edits.percentiles([95.0])[0]))
    }
}

fn milliseconds(time: Duration) -> f32 {
    (time.as_secs_f64() * 1e3) as f32
}

fn duration(milliseconds: f32) -> Duration {
    Duration::try_from_secs_f32(milliseconds * 1e-3).unwrap_or_default()
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

    #[test]
    fn latency_counts_from_the_first_edit_without_a_picture() {
        let (mut statistics, start) = (FrameStatistics::default(), Instant::now());
        let at = |ms: u64| start + Duration::from_millis(ms);
        statistics.frame(at(0), None);
        assert_eq!(statistics.edit_latency(), None);
        statistics.edit(at(5));
        statistics.epoch();
        statistics.edit(at(20));
        statistics.frame(at(16), None);
        statistics.epoch();
        let shows = statistics.shown();
        // The next edit comes while that picture is on its way: it is not in it.
        statistics.edit(at(44));
        statistics.frame(at(45), shows);
        assert_eq!(statistics.shown(), None);
        statistics.frame(at(60), None);
        let latency = statistics.edit_latency().expect("an edit was shown");
        assert!((latency.as_secs_f64() - 0.040).abs() < 1e-6, "{latency:?}");
        assert_eq!(statistics.edit_latency_p95(), Some(latency));
        assert_eq!(statistics.frames().len(), 3);
    }

    #[test]
    fn a_pause_is_no_frame_time() {
        let (mut statistics, start) = (FrameStatistics::default(), Instant::now());
        statistics.frame(start, None);
        statistics.pause();
        statistics.frame(start + Duration::from_secs(10), None);
        statistics.frame(start + Duration::from_millis(10_016), None);
        assert_eq!(statistics.percentiles().map(f32::round), [16.0; 3]);
    }
}
