//! Failures on purpose, so that what follows can be tested without a faulty driver.

use std::sync::atomic::{AtomicU64, Ordering};

/// The number of attempts that still succeed.
pub(in crate::gpu) struct Allowance(AtomicU64);

impl Default for Allowance {
    /// All of them.
    fn default() -> Self {
        Self(AtomicU64::new(u64::MAX))
    }
}

impl Allowance {
    /// Lets `count` more attempts succeed; `u64::MAX` for all.
    pub fn set(&self, count: u64) {
        self.0.store(count, Ordering::Relaxed);
    }

    /// Counts an attempt; whether it succeeds.
    pub fn take(&self) -> bool {
        let one_less = |left: u64| if left == u64::MAX { Some(left) } else { left.checked_sub(1) };
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, one_less).is_ok()
    }
}
