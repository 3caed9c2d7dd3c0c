//! Priorities of threads, and locks that outlive a panic.

use std::sync::{Mutex, MutexGuard};

/// Scheduling priority of the tracing threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Priority {
    /// That of every other thread.
    #[default]
    Normal,
    /// The lowest: the window, or a driver that renders on the CPU, comes first. The scheduler of Linux shares by weight, so
    /// the threads still run and respond to commands.
    Background,
}

impl Priority {
    /// Gives the calling thread this priority. Lowering it needs no privileges. On systems without thread priorities nothing
    /// changes.
    pub fn apply(self) {
        #[cfg(target_os = "linux")]
        if self == Priority::Background {
            /// The lowest priority of nice(2).
            const LOWEST: i32 = 19;
            // On Linux a nice value belongs to a thread, and `None` stands for the calling one.
            let _ = rustix::process::setpriority_process(None, LOWEST);
        }
    }
}

/// Locks `mutex`, even after a panic of another thread: for state that is valid at every moment.
pub(crate) fn unpoisoned<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}
