//! Background computation of values that take longer than a frame.

use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;

use crate::job::Job;

/// Whether the caller blocks until the result is ready.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackgroundPolicy {
    /// The caller computes the result at once, so that the picture is exactly the requested one.
    Block,
    /// The result is computed in the background; until it is ready the picture is shown without it.
    Background,
    /// As [`Background`](Self::Background), and work that takes longer than a frame is done at lower resolution.
    BackgroundCoarse,
}

/// A value being computed in the background. Dropping the task abandons the value without blocking: its thread runs to the end, and
/// [`join_abandoned`] waits for it.
pub(super) struct BackgroundTask<T>(Option<Job<T>>);

/// Threads of abandoned tasks.
static ABANDONED: Mutex<Vec<JoinHandle<()>>> = Mutex::new(Vec::new());

impl<T: Send + 'static> BackgroundTask<T> {
    /// Starts `work`; `None` if no thread can be started.
    pub fn start(work: impl FnOnce() -> T + Send + 'static) -> Option<Self> {
        Job::start("client background", move |_| work()).ok().map(|job| Self(Some(job)))
    }

    /// Whether [`wait`](Self::wait) returns at once.
    pub fn is_ready(&self) -> bool {
        self.0.as_ref().is_none_or(Job::is_finished)
    }

    /// Blocks until the value is ready; `None` if its thread has panicked.
    pub fn wait(mut self) -> Option<T> {
        self.0.take()?.wait().ok()
    }
}

impl<T> Drop for BackgroundTask<T> {
    fn drop(&mut self) {
        let mut abandoned = ABANDONED.lock().unwrap_or_else(PoisonError::into_inner);
        abandoned.retain(|thread| !thread.is_finished());
        let thread = self.0.take().and_then(Job::abandon);
        abandoned.extend(thread.filter(|thread| !thread.is_finished()));
    }
}

/// Joins the threads of all abandoned tasks, so that none of them is inside a driver when the process exits.
pub fn join_abandoned() {
    let abandoned = std::mem::take(&mut *ABANDONED.lock().unwrap_or_else(PoisonError::into_inner));
    for thread in abandoned {
        // A panic has already been reported, and the value is not needed.
        let _ = thread.join();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Barrier};

    #[test]
    fn values_arrive_or_fail() {
        let gate = Arc::new(Barrier::new(2));
        let inside = gate.clone();
        let task = BackgroundTask::start(move || {
            inside.wait();
            7
        })
        .expect("a thread");
        assert!(!task.is_ready(), "still behind the gate");
        gate.wait();
        assert_eq!(task.wait(), Some(7));
        let failed =
            BackgroundTask::<u32>::start(|| std::panic::resume_unwind(Box::new(()))).expect("a thread");
        assert_eq!(failed.wait(), None);
    }

    /// An abandoned value is dropped by its thread.
    #[test]
    fn abandoned_values_are_dropped() {
        let (value, gate) = (Arc::new(()), Arc::new(Barrier::new(2)));
        let (held, inside) = (value.clone(), gate.clone());
        let task = BackgroundTask::start(move || {
            inside.wait();
            held
        });
        drop(task);
        gate.wait();
        join_abandoned();
        assert_eq!(Arc::strong_count(&value), 1);
    }
}
