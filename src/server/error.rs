//! Errors of the server.

use crate::stream::Epoch;

/// Errors of [`Server`](crate::server::Server).
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// The operating system refused a thread.
    #[error("cannot start tracer thread {number} of {threads}: {source}; use fewer with --threads")]
    Spawn {
        /// Number of the thread.
        number: usize,
        /// Number of threads asked for.
        threads: usize,
        /// The system's error.
        source: std::io::Error,
    },
    /// The server was to have no threads.
    #[error("a server needs at least one thread; leave --threads out to use every core")]
    NoThreads,
    /// The epoch of a render command is not newer than the last one.
    #[error("render: epoch {new:?} is not newer than {last:?}; take last.next()")]
    StaleEpoch {
        /// The epoch of the command.
        new: Epoch,
        /// The latest epoch.
        last: Epoch,
    },
    /// The server has been terminated.
    #[error("render: the server has been terminated; start a new one")]
    Terminated,
}
