//! What is said between client and server besides samples.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// Which scene state a block belongs to. Every edit takes the next one; blocks of older ones are dropped on arrival.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Epoch(pub u64);

impl Epoch {
    /// The epoch after this one.
    #[must_use]
    pub fn next(self) -> Epoch {
        Epoch(self.0 + 1)
    }
}

/// The three commands of the paper, §4.1; `J` is what the server takes for a job.
#[derive(Debug)]
pub enum Command<J> {
    /// Trace this job; a render in progress is aborted.
    Render {
        /// What to trace.
        job: J,
        /// Newer than every epoch before.
        epoch: Epoch,
    },
    /// Stop tracing; takes at most one path per worker. What has been sent stays valid.
    Abort,
    /// Stop tracing and end every thread.
    Term,
}

/// What the server reports without being asked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A render has ended. Every block it sent was committed before: drain once more and nothing is missing.
    Finished {
        /// Of the render.
        epoch: Epoch,
        /// How it ended.
        why: Finish,
        /// When the last worker had left it.
        at: Instant,
    },
}

/// How a render ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Finish {
    /// Every index of the range was traced and sent.
    Complete,
    /// By abort, term or a newer render, or because the lanes were dropped.
    Aborted,
    /// A path panicked; its samples were dropped and the other workers were stopped.
    Panicked {
        /// The path, for replay.
        index: u64,
        /// What the panic said.
        message: String,
    },
}

/// The epoch that may run at this moment; workers look at it between paths.
#[derive(Debug)]
pub struct RunningEpoch(AtomicU64);

impl Default for RunningEpoch {
    fn default() -> Self {
        Self(AtomicU64::new(Self::NONE))
    }
}

impl RunningEpoch {
    const NONE: u64 = u64::MAX;

    /// True while `epoch` may go on.
    #[inline]
    pub fn is(&self, epoch: Epoch) -> bool {
        self.0.load(Ordering::Relaxed) == epoch.0
    }

    /// True while nothing may run.
    pub fn is_none(&self) -> bool {
        self.0.load(Ordering::Relaxed) == Self::NONE
    }

    pub(super) fn set(&self, epoch: Option<Epoch>) {
        self.0.store(epoch.map_or(Self::NONE, |epoch| epoch.0), Ordering::SeqCst);
    }

    pub(super) fn stop(&self, epoch: Epoch) {
        // Fails when another epoch runs already: then there is nothing to stop.
        let _ = self.0.compare_exchange(epoch.0, Self::NONE, Ordering::SeqCst, Ordering::SeqCst);
    }
}
