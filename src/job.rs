//! Work on a thread of its own that makes one value, for those who look for it now and then and do not wait.

use std::any::Any;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

/// A value that a thread makes. Dropped before, it asks the thread to stop and does not wait for it.
#[derive(Debug)]
pub(crate) struct Job<T> {
    name: &'static str,
    value: Receiver<T>,
    /// `None` once it was joined or abandoned.
    thread: Option<JoinHandle<()>>,
    stop: StopFlag,
}

/// The flag that the thread of a [`Job`] checks where it can end early.
#[derive(Clone, Debug, Default)]
pub(crate) struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// True once nobody wants the value any more.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The thread of a [`Job`] has panicked.
#[derive(Debug, thiserror::Error)]
#[error("{name} was ended by a mistake of the program ({why}); please report it")]
pub(crate) struct JobPanic {
    name: &'static str,
    why: String,
}

impl<T: Send + 'static> Job<T> {
    /// Starts `work` on a thread of this name.
    ///
    /// # Errors
    ///
    /// When the system gives no thread.
    pub fn start(name: &'static str, work: impl FnOnce(&StopFlag) -> T + Send + 'static) -> io::Result<Self> {
        let (sender, value) = sync_channel(1);
        let stop = StopFlag::default();
        let seen = stop.clone();
        // Nobody may be waiting any more: the value is then dropped there.
        let work = move || drop(sender.send(work(&seen)));
        let thread = Builder::new().name(name.into()).spawn(work)?;
        Ok(Self { name, value, thread: Some(thread), stop })
    }
}

impl<T> Job<T> {
    /// Whether [`wait`](Self::wait) returns at once.
    pub fn is_finished(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Takes the value out of `job` if it is there.
    pub fn take(job: &mut Option<Self>) -> Option<Result<T, JobPanic>> {
        job.take_if(|job| job.is_finished()).map(Self::wait)
    }

    /// Waits for the value.
    pub fn wait(mut self) -> Result<T, JobPanic> {
        let value = self.value.recv().ok();
        self.end(value)
    }

    /// Waits this long for the value; gives the job back where it is not there by then.
    pub fn wait_for(mut self, time: Duration) -> Result<Result<T, JobPanic>, Self> {
        match self.value.recv_timeout(time) {
            Ok(value) => Ok(self.end(Some(value))),
            Err(RecvTimeoutError::Timeout) => Err(self),
            Err(RecvTimeoutError::Disconnected) => Ok(self.end(None)),
        }
    }

    /// The value, once, if it is there; the panic at every call after one.
    pub fn poll(&mut self) -> Option<Result<T, JobPanic>> {
        match self.value.try_recv() {
            Ok(value) => Some(self.end(Some(value))),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(self.end(None)),
        }
    }

    /// The thread, which goes on; nobody gets its value.
    pub fn abandon(mut self) -> Option<JoinHandle<()>> {
        self.thread.take()
    }

    /// Joins the thread, which ends right after it has sent the value or without one.
    fn end(&mut self, value: Option<T>) -> Result<T, JobPanic> {
        let panic = self.thread.take().and_then(|thread| thread.join().err());
        let why = || panic.and_then(|panic| panic_message(panic.as_ref()));
        value.ok_or_else(|| JobPanic {
            name: self.name,
            why: why().unwrap_or_else(|| "no message".to_owned()),
        })
    }
}

impl<T> Drop for Job<T> {
    fn drop(&mut self) {
        self.stop.0.store(true, Ordering::Relaxed);
    }
}

/// Scheduling priority of a thread.
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

/// The words of a panic, if it has any.
pub(crate) fn panic_message(panic: &(dyn Any + Send)) -> Option<String> {
    let text = panic.downcast_ref::<&str>().copied();
    text.or_else(|| panic.downcast_ref::<String>().map(String::as_str)).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Barrier;

    #[test]
    fn values_arrive_once() {
        let gate = Arc::new(Barrier::new(2));
        let inside = gate.clone();
        let job = Job::start("test", move |_| {
            inside.wait();
            7
        })
        .expect("a thread");
        let mut job = job.wait_for(Duration::ZERO).map(|_| ()).expect_err("still behind the gate");
        assert!(!job.is_finished() && job.poll().is_none());
        gate.wait();
        let mut job = Some(job);
        let value = loop {
            match Job::take(&mut job) {
                Some(value) => break value,
                None => std::thread::yield_now(),
            }
        };
        assert_eq!((value.expect("no panic"), job.is_none()), (7, true));
    }

    #[test]
    fn panics_are_told() {
        let job = Job::<u32>::start("the test", |_| std::panic::resume_unwind(Box::new("three")));
        let words = job.expect("a thread").wait().expect_err("it has panicked").to_string();
        assert!(words.starts_with("the test") && words.contains("(three)"), "{words}");
    }

    #[test]
    fn dropped_jobs_are_asked_to_stop() {
        let (sender, ended) = sync_channel(1);
        let job = Job::start("test", move |stop| {
            while !stop.is_set() {
                std::thread::yield_now();
            }
            sender.send(()).expect("the test waits");
        });
        drop(job.expect("a thread"));
        ended.recv().expect("the thread has stopped");
    }
}
