//! Work on a thread of its own, so that a window does not stand still for it.

use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;

use crate::job::Job;

/// Whether the caller blocks until the result is ready.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackgroundPolicy {
    /// The caller makes the result at once: the picture must be the one that was asked for.
    Block,
    /// The result is made in the background, and the picture goes without it until then.
    Background,
    /// As [`Background`](Self::Background), and what takes longer than a frame is made coarser.
    BackgroundCoarse,
}

/// A value that is made in the background. Dropping it abandons the value without waiting: its thread ends when it has made
/// it, and [`join_abandoned`] waits for that.
pub(in crate::client) struct BackgroundTask<T>(Option<Job<T>>);

/// Threads of abandoned values.
static ABANDONED: Mutex<Vec<JoinHandle<()>>> = Mutex::new(Vec::new());

impl<T: Send + 'static> BackgroundTask<T> {
    /// Starts `work`; `None` where the system gives no thread.
    pub fn start(work: impl FnOnce() -> T + Send + 'static) -> Option<Self> {
        Job::start("client background", move |_| work()).ok().map(|job| Self(Some(job)))
    }

    /// Whether [`wait`](Self::wait) returns at once.
    pub fn is_ready(&self) -> bool {
        self.0.as_ref().is_none_or(Job::is_finished)
    }

    /// Waits for the value; `None` when its thread has panicked.
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

/// Waits for the threads of all abandoned values: before the program ends, so that none of them is inside a driver then.
pub fn join_abandoned() {
    let abandoned = std::mem::take(&mut *ABANDONED.lock().unwrap_or_else(PoisonError::into_inner));
    for thread in abandoned {
        // A thread that has panicked has reported that, and nobody wants its value.
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
