//! Asynchronous readback: values that a device is still computing, so that another thread can wait for them.

use crate::client::error::ClientError;

/// A value that will be available once the device has finished.
#[must_use = "nothing is read before it is waited for"]
pub struct Readback<T>(Box<dyn FnOnce() -> Result<T, ClientError> + Send>);

impl<T: Send + 'static> Readback<T> {
    /// A readback by `read`, which may block on the device.
    pub fn new(read: impl FnOnce() -> Result<T, ClientError> + Send + 'static) -> Self {
        Self(Box::new(read))
    }

    /// A value that is available already.
    pub fn ready(value: T) -> Self {
        Self::new(|| Ok(value))
    }

    /// Blocks until the value is available.
    ///
    /// # Errors
    ///
    /// [`ClientError::Gpu`] when the device was lost meanwhile.
    pub fn wait(self) -> Result<T, ClientError> {
        (self.0)()
    }
}
