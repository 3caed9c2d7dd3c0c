//! Events from the producer, and the epochs that number the renders.

use std::time::Instant;

/// The number of a render, and with it of the state of the scene. Every edit takes the next one; blocks of older epochs
/// are dropped on arrival.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Epoch(pub u64);

impl Epoch {
    /// The epoch after this one.
    #[must_use]
    pub fn next(self) -> Epoch {
        Epoch(self.0 + 1)
    }
}

/// A message that the server sends by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A render has ended. Every block it sent was committed before: drain once more and nothing is missing.
    Finished {
        /// The render that ended.
        epoch: Epoch,
        /// How it ended.
        reason: FinishReason,
        /// When its last worker stopped.
        at: Instant,
    },
}

/// The reason why a render ended.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum FinishReason {
    /// Every index of the range was traced and sent.
    Complete,
    /// It was stopped by abort, term or a newer render, or because the lanes were dropped.
    Aborted,
    /// A path panicked. Its samples were dropped and the other workers were stopped.
    Panicked {
        /// Index of the path, so that it can be traced again.
        index: u64,
        /// Message of the panic.
        message: String,
    },
}
