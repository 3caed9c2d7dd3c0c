//! Losing the device on purpose, so that what follows can be tested without a faulty driver.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use ash::vk;

use crate::gpu::device::Gpu;
use crate::gpu::error::GpuError;

/// When the device is to be lost.
pub(in crate::gpu) struct Loss {
    /// Submissions that still succeed.
    left: AtomicU64,
    lost: AtomicBool,
}

impl Default for Loss {
    fn default() -> Self {
        Self { left: AtomicU64::new(u64::MAX), lost: AtomicBool::new(false) }
    }
}

impl Gpu {
    /// Lets `submits` more frames be submitted; then the device behaves as if it were lost, for good: submitting,
    /// waiting, acquiring and presenting fail with an error for which [`GpuError::is_device_lost`] holds. For tests.
    pub fn lose_after(&self, submits: u64) {
        self.loss.left.store(submits, Ordering::Relaxed);
    }

    /// Counts a submission.
    pub(in crate::gpu) fn may_submit(&self) -> Result<(), GpuError> {
        let one_less = |left: u64| if left == u64::MAX { Some(left) } else { left.checked_sub(1) };
        if self.loss.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, one_less).is_err() {
            self.loss.lost.store(true, Ordering::Relaxed);
        }
        self.alive("vkQueueSubmit2")
    }

    /// The error of `call` after the device was lost on purpose.
    pub(in crate::gpu) fn alive(&self, call: &str) -> Result<(), GpuError> {
        if self.loss.lost.load(Ordering::Relaxed) {
            return Err(GpuError::Call { call: call.to_owned(), result: vk::Result::ERROR_DEVICE_LOST });
        }
        Ok(())
    }
}
