//! The synchronisation primitives of the lanes, under one name so that a model checker can replace them.
//!
//! The loom test compiles `ring.rs` and `signal.rs` against loom's versions of exactly these items.

pub use std::sync::Arc;
pub use std::sync::atomic::{AtomicUsize, Ordering, fence};
pub use std::sync::{Condvar, Mutex};

/// `std::cell::UnsafeCell` with the interface of loom's.
#[derive(Debug)]
pub struct UnsafeCell<T>(std::cell::UnsafeCell<T>);

impl<T> UnsafeCell<T> {
    /// Wraps `value`.
    pub const fn new(value: T) -> Self {
        Self(std::cell::UnsafeCell::new(value))
    }

    /// Calls `f` with a pointer for reading.
    #[inline(always)]
    pub fn with<R>(&self, f: impl FnOnce(*const T) -> R) -> R {
        f(self.0.get())
    }

    /// Calls `f` with a pointer for writing.
    #[inline(always)]
    pub fn with_mut<R>(&self, f: impl FnOnce(*mut T) -> R) -> R {
        f(self.0.get())
    }
}
