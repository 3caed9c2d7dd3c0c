//! What can go wrong between a caller and the server.

use crate::stream::Epoch;

/// Errors of [`Server`](crate::server::Server).
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// The operating system refused a thread.
    #[error("cannot start tracer thread {number} of {threads}: {source}; use fewer with --threads")]
    Spawn {
        /// Which one.
        number: usize,
        /// How many were wanted.
        threads: usize,
        /// Why.
        source: std::io::Error,
    },
    /// Zero threads were asked for.
    #[error("a server needs at least one thread; leave --threads out to use every core")]
    NoThreads,
    /// The epoch of a render command is not newer than the last one's.
    #[error("render: epoch {new:?} is not newer than {last:?}; take last.next()")]
    StaleEpoch {
        /// Offered.
        new: Epoch,
        /// Highest so far.
        last: Epoch,
    },
    /// The server has been terminated.
    #[error("render: the server has been terminated; start a new one")]
    Terminated,
}
