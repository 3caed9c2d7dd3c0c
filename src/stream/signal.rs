//! Sleeping until another thread has changed an atomic, without a lock on the fast path (an event count).

use std::time::{Duration, Instant};

use super::sync::{AtomicUsize, Condvar, Mutex, Ordering, fence};

/// A wake-up signal: a thread that changes a shared atomic rings it, and a thread that waits for the change sleeps on it.
///
/// Ringing costs one fence and one load while nobody sleeps.
#[derive(Debug, Default)]
pub struct Signal {
    sleepers: AtomicUsize,
    gate: Mutex<()>,
    bell: Condvar,
}

impl Signal {
    /// Sleeps until `ready()` is true or `timeout` has passed (`None` means no limit). Returns the last result of `ready`, which
    /// must depend on atomics only.
    ///
    /// No wake-up is lost: either the ringing thread's load of `sleepers` sees this thread, or this thread's call of `ready`
    /// sees the change, because the two fences order the two pairs of accesses.
    pub fn wait(&self, timeout: Option<Duration>, mut ready: impl FnMut() -> bool) -> bool {
        if ready() {
            return true;
        }
        let end = timeout.map(|timeout| Instant::now() + timeout.min(Duration::from_secs(1 << 30)));
        // Another sleeper may have panicked inside `ready`. The lock protects no data, so that is harmless.
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

    /// Wakes every sleeper, which then calls `ready` again. Call it after the change.
    pub fn ring(&self) {
        fence(Ordering::SeqCst);
        if self.sleepers.load(Ordering::Relaxed) != 0 {
            // A sleeper holds the lock from its increment of `sleepers` until it sleeps: after locking, it does sleep.
            drop(self.gate.lock());
            self.bell.notify_all();
        }
    }
}
