//! Sleeping until another thread has changed something, without a lock on the fast path.

use std::time::{Duration, Instant};

use super::sync::{AtomicUsize, Condvar, Mutex, Ordering, fence};

/// A doorbell: whoever changes a shared atomic rings it, whoever waits for such a change sleeps on it.
///
/// Ringing costs one fence and one load while nobody sleeps.
#[derive(Debug, Default)]
pub struct Signal {
    sleepers: AtomicUsize,
    gate: Mutex<()>,
    bell: Condvar,
}

impl Signal {
    /// Sleeps until `ready()` is true or `timeout` is over (`None`: no limit); returns the last answer of `ready`.
    ///
    /// No ring is lost: either the ringer's look at `sleepers` sees this thread, or this thread's look at `ready` sees
    /// the change (the two fences order the two pairs of accesses). `ready` must depend on atomics only.
    pub fn wait(&self, timeout: Option<Duration>, mut ready: impl FnMut() -> bool) -> bool {
        if ready() {
            return true;
        }
        let end = timeout.map(|timeout| Instant::now() + timeout.min(Duration::from_secs(1 << 30)));
        // A panic of another sleeper inside `ready` says nothing about `()`: go on.
        let mut guard = self.gate.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        self.sleepers.fetch_add(1, Ordering::SeqCst);
        fence(Ordering::SeqCst);
        let answer = loop {
            if ready() {
                break true;
            }
            guard = match end.map(|end| end.saturating_duration_since(Instant::now())) {
                None => self.bell.wait(guard).unwrap_or_else(|poisoned| poisoned.into_inner()),
                Some(Duration::ZERO) => break false,
                Some(left) => {
                    self.bell.wait_timeout(guard, left).unwrap_or_else(|poisoned| poisoned.into_inner()).0
                }
            };
        };
        self.sleepers.fetch_sub(1, Ordering::SeqCst);
        drop(guard);
        answer
    }

    /// Wakes every sleeper so that it looks again. Call it after the change.
    pub fn ring(&self) {
        fence(Ordering::SeqCst);
        if self.sleepers.load(Ordering::Relaxed) != 0 {
            // A sleeper holds the gate from its announcement to its sleep: passing the gate means it sleeps.
            drop(self.gate.lock());
            self.bell.notify_all();
        }
    }
}
