//! Loses the device on purpose, so that what follows can be tested without a faulty driver.

use std::sync::atomic::{AtomicBool, Ordering};

use ash::vk;

use crate::gpu::device::allowance::Allowance;
use crate::gpu::error::GpuError;

/// The planned loss of a device.
#[derive(Default)]
pub(in crate::gpu) struct Loss {
    submissions: Allowance,
    lost: AtomicBool,
}

impl Loss {
    /// Lets `submits` more submissions succeed.
    pub fn after(&self, submits: u64) {
        self.submissions.set(submits);
    }

    /// Counts a submission.
    pub fn count_submission(&self) {
        if !self.submissions.take() {
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
