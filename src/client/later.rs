//! Values that a thread of their own makes, so that a window need not stand still for them.

use std::sync::Mutex;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::{self, JoinHandle};

/// Whether who asks for a value that is not made yet waits for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Patience {
    /// It is made at once: the picture must be the one that was asked for.
    Wait,
    /// It is made in the background, and the picture does without until then.
    Ask,
    /// As [`Ask`](Self::Ask), and what takes longer than a frame is made coarser.
    Hurry,
}

/// A value under way. Dropping it forgets the value without waiting: its thread ends by itself when it has made it, and
/// [`finish`] waits for that.
pub(in crate::client) struct Later<T> {
    value: Receiver<T>,
    thread: Option<JoinHandle<()>>,
}

/// Threads whose values were forgotten.
static FORGOTTEN: Mutex<Vec<JoinHandle<()>>> = Mutex::new(Vec::new());

impl<T: Send + 'static> Later<T> {
    /// Begins to make it; `None` where there is no thread to be had.
    pub fn begin(make: impl FnOnce() -> T + Send + 'static) -> Option<Self> {
        let (sender, value) = sync_channel(1);
        // Nobody may be waiting any more: the value is then dropped there.
        let work = move || drop(sender.send(make()));
        let thread = thread::Builder::new().name("client later".into()).spawn(work).ok()?;
        Some(Self { value, thread: Some(thread) })
    }

    /// True when [`wait`](Self::wait) does not wait.
    pub fn is_there(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// The value, waited for; `None` when its thread has failed.
    pub fn wait(self) -> Option<T> {
        self.value.recv().ok()
    }
}

impl<T> Drop for Later<T> {
    fn drop(&mut self) {
        let mut forgotten = FORGOTTEN.lock().unwrap_or_else(|e| e.into_inner());
        forgotten.retain(|thread| !thread.is_finished());
        forgotten.extend(self.thread.take().filter(|thread| !thread.is_finished()));
    }
}

/// Waits for all threads whose values were forgotten: before the program ends, so that none of them is inside a driver then.
pub fn finish() {
    let forgotten = std::mem::take(&mut *FORGOTTEN.lock().unwrap_or_else(|e| e.into_inner()));
    for thread in forgotten {
        // One that has panicked has said so, and nobody wants its value.
        let _ = thread.join();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Barrier};

    #[test]
    fn values_come_later_or_never() {
        let gate = Arc::new(Barrier::new(2));
        let inside = gate.clone();
        let later = Later::begin(move || {
            inside.wait();
            7
        })
        .expect("a thread");
        assert!(!later.is_there(), "still behind the gate");
        gate.wait();
        assert_eq!(later.wait(), Some(7));
        let failed = Later::<u32>::begin(|| std::panic::resume_unwind(Box::new(()))).expect("a thread");
        assert_eq!(failed.wait(), None);
    }

    /// What is forgotten is dropped by its thread.
    #[test]
    fn what_is_forgotten_is_dropped() {
        let (value, gate) = (Arc::new(()), Arc::new(Barrier::new(2)));
        let (held, inside) = (value.clone(), gate.clone());
        let later = Later::begin(move || {
            inside.wait();
            held
        });
        drop(later);
        gate.wait();
        finish();
        assert_eq!(Arc::strong_count(&value), 1);
    }
}
