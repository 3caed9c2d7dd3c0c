//! What is read from a device that still works on it, so that another thread can wait for it.

use crate::client::error::ClientError;

/// A value that is there once the device has finished with it.
#[must_use = "nothing is read before it is waited for"]
pub struct Readback<T>(Box<dyn FnOnce() -> Result<T, ClientError> + Send>);

impl<T: Send + 'static> Readback<T> {
    /// What this makes, which may wait for the device.
    pub fn new(read: impl FnOnce() -> Result<T, ClientError> + Send + 'static) -> Self {
        Self(Box::new(read))
    }

    /// A value that is there already.
    pub fn ready(value: T) -> Self {
        Self::new(|| Ok(value))
    }

    /// Waits for the value.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] when the device was lost meanwhile.
    pub fn wait(self) -> Result<T, ClientError> {
        (self.0)()
    }
}
