//! Frame scheduling, and exponential back-off for operations that failed.

use std::time::{Duration, Instant};

/// Times of the next frame and of a retry.
pub(super) struct FrameClock {
    due: Instant,
    /// When to retry a frame that could not acquire an image, without waiting for the next regular frame.
    retry: Option<Instant>,
}

impl FrameClock {
    /// A clock whose first frame is due at `due`.
    pub fn new(due: Instant) -> Self {
        Self { due, retry: None }
    }

    /// Schedules the next frame at this time, replacing any earlier schedule.
    pub fn set(&mut self, due: Instant) {
        *self = Self::new(due);
    }

    /// Moves the next frame forward to this time, if it was scheduled later.
    pub fn hasten(&mut self, due: Instant) {
        self.due = self.due.min(due);
    }

    /// Schedules a retry of the present frame.
    pub fn retry_at(&mut self, at: Instant) {
        self.retry = Some(at);
    }

    /// Whether a retry of the last frame is scheduled.
    pub fn has_retry(&self) -> bool {
        self.retry.is_some()
    }

    /// Time of the next frame or retry, whichever is earlier.
    pub fn next(&self) -> Instant {
        self.retry.map_or(self.due, |retry| retry.min(self.due))
    }

    /// Begins a frame and schedules the next one a `budget` after the time this one was due, so that delays do not accumulate. A clock that
    /// is late by a frame or more restarts from `now`, so that no burst of frames follows. Returns whether this frame is only a retry of
    /// the last one.
    pub fn begin(&mut self, now: Instant, budget: Duration) -> bool {
        let is_retry = self.retry.take().is_some() && now < self.due;
        if !is_retry {
            let is_late = now.saturating_duration_since(self.due) >= budget;
            self.due = if is_late { now } else { self.due } + budget;
        }
        is_retry
    }
}

/// Shortest (first) and longest delay between attempts.
const WAITS: [Duration; 2] = [Duration::from_millis(10), Duration::from_secs(1)];

/// Exponential back-off for a failing operation.
#[derive(Default)]
pub(super) struct Backoff {
    failures: u32,
    /// Time of the first failure and of the next attempt.
    times: Option<(Instant, Instant)>,
    /// Error message of the first failure.
    reason: String,
}

impl Backoff {
    /// Records a failure; returns the time of the next attempt.
    pub fn fail(&mut self, now: Instant, reason: &dyn std::fmt::Display) -> Instant {
        if self.failures == 0 {
            self.reason = reason.to_string();
        }
        let wait = WAITS[0].saturating_mul(1 << self.failures.min(16)).min(WAITS[1]);
        self.failures += 1;
        let (first, _) = self.times.unwrap_or((now, now));
        self.times = Some((first, now + wait));
        now + wait
    }

    /// Time of the next attempt; `None` if nothing has failed.
    pub fn next(&self) -> Option<Instant> {
        self.times.map(|(_, next)| next)
    }

    /// Whether an attempt may be made now.
    pub fn is_due(&self, now: Instant) -> bool {
        self.next().is_none_or(|next| now >= next)
    }

    /// Whether attempts have failed.
    pub fn has_failed(&self) -> bool {
        self.failures > 0
    }

    /// Time since the first failure.
    pub fn lasts(&self, now: Instant) -> Duration {
        self.times.map_or(Duration::ZERO, |(first, _)| now.saturating_duration_since(first))
    }

    /// Records success. Returns the message of the first failure, if there was one.
    pub fn succeed(&mut self) -> Option<String> {
        let before = std::mem::take(self);
        before.has_failed().then_some(before.reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Duration = Duration::from_millis(16);

    /// Frames that each begin 3 ms late keep the rate; a gap is not followed by a burst.
    #[test]
    fn delays_do_not_add_up() {
        let start = Instant::now();
        let mut clock = FrameClock::new(start);
        for i in 1..=60 {
            let late = clock.next() + Duration::from_millis(3);
            assert!(!clock.begin(late, FRAME));
            assert_eq!(clock.next(), start + i * FRAME);
        }
        let late = clock.next() + 10 * FRAME;
        clock.begin(late, FRAME);
        assert_eq!(clock.next(), late + FRAME);
    }

    /// A retry does not shift the schedule; a retry that coincides with the next due frame counts as that frame.
    #[test]
    fn a_retry_keeps_the_rhythm() {
        let start = Instant::now();
        let mut clock = FrameClock::new(start);
        clock.begin(start, FRAME);
        for i in 1..16 {
            let soon = start + Duration::from_millis(i);
            clock.retry_at(soon);
            assert_eq!(clock.next(), soon);
            assert!(clock.begin(soon, FRAME), "{i}");
        }
        assert_eq!(clock.next(), start + FRAME);
        clock.retry_at(start + FRAME);
        assert!(!clock.begin(start + FRAME, FRAME));
        assert_eq!(clock.next(), start + 2 * FRAME);
    }

    #[test]
    fn attempts_become_rare() {
        let start = Instant::now();
        let (mut backoff, mut now) = (Backoff::default(), start);
        assert!(backoff.is_due(now));
        for _ in 0..20 {
            now = backoff.fail(now, &backoff.failures.to_string());
            assert!(backoff.is_due(now) && !backoff.is_due(now - Duration::from_millis(1)));
        }
        // Delays of 10 to 640 ms, doubling, then 1 s each.
        assert_eq!(backoff.lasts(now), Duration::from_millis(1270 + 13_000));
        assert_eq!(backoff.succeed().as_deref(), Some("0"));
        assert_eq!(backoff.succeed(), None);
        assert!(backoff.is_due(start) && !backoff.has_failed());
    }
}
