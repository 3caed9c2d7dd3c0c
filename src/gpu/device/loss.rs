//! Simulated device loss, to test recovery without a faulty driver.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use ash::vk;

use crate::gpu::error::GpuError;

/// Planned loss of a device.
pub(in crate::gpu) struct Loss {
    /// Remaining successful submissions; `u64::MAX` for no limit.
    submissions: AtomicU64,
    lost: AtomicBool,
}

impl Default for Loss {
    fn default() -> Self {
        Self { submissions: AtomicU64::new(u64::MAX), lost: AtomicBool::new(false) }
    }
}

impl Loss {
    /// Lets `submits` more submissions succeed.
    pub fn after(&self, submits: u64) {
        self.submissions.store(submits, Ordering::Relaxed);
    }

    /// Counts a submission.
    pub fn count_submission(&self) {
        let one_less = |left: u64| if left == u64::MAX { Some(left) } else { left.checked_sub(1) };
        if self.submissions.fetch_update(Ordering::Relaxed, Ordering::Relaxed, one_less).is_err() {
            self.lost.store(true, Ordering::Relaxed);
        }
    }

    /// The error of `call` once the device is lost.
    pub fn check(&self, call: &str) -> Result<(), GpuError> {
        match self.lost.load(Ordering::Relaxed) {
            true => Err(GpuError::Call { call: call.to_owned(), result: vk::Result::ERROR_DEVICE_LOST }),
            false => Ok(()),
        }
    }
}
