//! When the loop draws the next frame, and when it tries again what has failed.

use std::time::{Duration, Instant};

/// When frames are due.
pub(super) struct FrameClock {
    due: Instant,
    /// A frame that found nothing to draw into is tried again then, without waiting for the next one.
    retry: Option<Instant>,
}

impl FrameClock {
    /// The first frame is due then.
    pub fn new(due: Instant) -> Self {
        Self { due, retry: None }
    }

    /// A frame is due at this time, whatever was planned.
    pub fn set(&mut self, due: Instant) {
        *self = Self::new(due);
    }

    /// A frame is due at this time at the latest.
    pub fn hasten(&mut self, due: Instant) {
        self.due = self.due.min(due);
    }

    /// The frame is to be tried again then.
    pub fn retry_at(&mut self, at: Instant) {
        self.retry = Some(at);
    }

    /// Whether the last frame is to be tried again.
    pub fn has_retry(&self) -> bool {
        self.retry.is_some()
    }

    /// When a frame is due, or the last one is tried again.
    pub fn next(&self) -> Instant {
        self.retry.map_or(self.due, |retry| retry.min(self.due))
    }

    /// A frame begins now, and the next is due a `budget` after this one was, so that no delay adds up. A clock that is late by a
    /// frame or more starts anew, so that no burst follows. Returns whether this is only the last frame, tried again.
    pub fn begin(&mut self, now: Instant, budget: Duration) -> bool {
        let is_retry = self.retry.take().is_some() && now < self.due;
        if !is_retry {
            let is_late = now.saturating_duration_since(self.due) >= budget;
            self.due = if is_late { now } else { self.due } + budget;
        }
        is_retry
    }
}

/// The first wait before another attempt, and the longest.
const WAITS: [Duration; 2] = [Duration::from_millis(10), Duration::from_secs(1)];

/// Attempts at something that has failed: soon at first, then ever later.
#[derive(Default)]
pub(super) struct Backoff {
    failures: u32,
    /// When the first attempt failed, and when the next one is made.
    times: Option<(Instant, Instant)>,
    /// Why the first one failed.
    reason: String,
}

impl Backoff {
    /// Another attempt has failed now, for this reason; returns when the next one is made.
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

    /// When the next attempt is made; `None` where nothing has failed.
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

    /// For how long attempts have failed.
    pub fn lasts(&self, now: Instant) -> Duration {
        self.times.map_or(Duration::ZERO, |(first, _)| now.saturating_duration_since(first))
    }

    /// An attempt has succeeded. Returns why the first one failed, if any did.
    pub fn succeed(&mut self) -> Option<String> {
        let before = std::mem::take(self);
        before.has_failed().then_some(before.reason)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: Duration = Duration::from_millis(16);

    /// Frames that begin 3 ms late, for whatever reason, keep the rate; a gap is followed by no burst.
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

    /// A frame that is tried again moves no other one; when the next one is due it is that one.
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
        // 10 to 640 ms, then a second each.
        assert_eq!(backoff.lasts(now), Duration::from_millis(1270 + 13_000));
        assert_eq!(backoff.succeed().as_deref(), Some("0"));
        assert_eq!(backoff.succeed(), None);
        assert!(backoff.is_due(start) && !backoff.has_failed());
    }
}
