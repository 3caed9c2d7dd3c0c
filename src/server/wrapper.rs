//! The wrapper thread (paper §4.1): it takes commands, hands renders to the workers and reports how they ended.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};
use std::thread::JoinHandle;
use std::time::Instant;

use crate::server::worker::{Assignment, ServerMessage};
use crate::stream::{Command, Epoch, Event, FinishReason, Hub};

/// The wrapper's handle to a tracing thread.
pub(super) struct WorkerHandle {
    pub(super) assign: Sender<Assignment>,
    pub(super) thread: JoinHandle<()>,
}

/// A render that some workers are still tracing.
struct PendingRender {
    epoch: Epoch,
    workers: usize,
    reason: FinishReason,
}

/// The state of the wrapper thread.
pub(super) struct Wrapper {
    pub(super) workers: Vec<WorkerHandle>,
    pub(super) hub: Arc<Hub>,
    pub(super) events: Sender<Event>,
}

impl Wrapper {
    /// The command loop: *term*, *abort*, *render*. Returns when every thread has ended.
    pub(super) fn run(mut self, messages: Receiver<ServerMessage>) {
        let mut pending: Vec<PendingRender> = Vec::new();
        for message in &messages {
            match message {
                ServerMessage::Command(Command::Term) => break,
                // The caller has already stopped the epoch, so that the queue does not delay an abort.
                ServerMessage::Command(Command::Abort) => {}
                ServerMessage::Command(Command::Render { job: (task, work), epoch }) => {
                    pending.push(PendingRender {
                        epoch,
                        workers: self.workers.len(),
                        reason: FinishReason::Complete,
                    });
                    for worker in &self.workers {
                        let assignment = Assignment { task: task.clone(), work: work.clone() };
                        if worker.assign.send(assignment).is_err() {
                            // The worker is gone, so do not wait for it.
                            self.worker_done(&mut pending, epoch, FinishReason::Aborted);
                        }
                    }
                }
                ServerMessage::WorkerDone { epoch, reason } => self.worker_done(&mut pending, epoch, reason),
            }
        }
        self.hub.run(None);
        let threads: Vec<_> = self.workers.drain(..).map(|worker| worker.thread).collect();
        for thread in threads {
            // Panics of a worker were reported as events.
            let _ = thread.join();
        }
        for render in pending {
            self.finish(render.epoch, FinishReason::Aborted);
        }
    }

    /// Counts down the workers of a render, and reports its end when the last one is done.
    fn worker_done(&self, pending: &mut Vec<PendingRender>, epoch: Epoch, reason: FinishReason) {
        let Some(at) = pending.iter().position(|render| render.epoch == epoch) else { return };
        let render = &mut pending[at];
        render.workers -= 1;
        // The most severe reason wins. Of several panics, in any order, it is the one at the smallest index.
        let severity = |reason: &FinishReason| match reason {
            FinishReason::Complete => (0, 0),
            FinishReason::Aborted => (1, 0),
            FinishReason::Panicked { index, .. } => (2, u64::MAX - index),
        };
        if severity(&reason) > severity(&render.reason) {
            render.reason = reason;
        }
        if render.workers == 0 {
            let PendingRender { epoch, reason, .. } = pending.swap_remove(at);
            self.finish(epoch, reason);
        }
    }

    /// Reports the end of a render. The event comes first, so that whoever sees the end of the epoch finds the event.
    fn finish(&self, epoch: Epoch, reason: FinishReason) {
        // The receiver may be gone.
        let _ = self.events.send(Event::Finished { epoch, reason, at: Instant::now() });
        self.hub.end(epoch);
    }
}
