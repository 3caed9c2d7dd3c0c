//! The wrapper thread (paper §4.1): takes commands, hands renders to the workers, reports how they ended.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};
use std::thread::JoinHandle;
use std::time::Instant;

use crate::server::job::Task;
use crate::server::worker::{Assignment, Work};
use crate::stream::{Command, Epoch, Event, FinishReason, Hub};

/// What the wrapper sleeps on.
pub(super) enum Message {
    /// From the caller.
    Command(Command<(Arc<Task>, Work)>),
    /// From a worker.
    WorkerDone { epoch: Epoch, reason: FinishReason },
}

/// A tracing thread as the wrapper sees it.
pub(super) struct WorkerHandle {
    pub(super) assign: Sender<Assignment>,
    pub(super) thread: JoinHandle<()>,
}

/// A render some workers are still busy with.
struct Pending {
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
    pub(super) fn run(mut self, messages: Receiver<Message>) {
        let mut pending: Vec<Pending> = Vec::new();
        for message in &messages {
            match message {
                Message::Command(Command::Term) => break,
                // The caller has stopped the epoch already, so that no command queue delays an abort.
                Message::Command(Command::Abort) => {}
                Message::Command(Command::Render { job: (task, work), epoch }) => {
                    pending.push(Pending {
                        epoch,
                        workers: self.workers.len(),
                        reason: FinishReason::Complete,
                    });
                    for worker in &self.workers {
                        let assignment = Assignment { task: task.clone(), work: work.clone() };
                        if worker.assign.send(assignment).is_err() {
                            // A worker that is gone must not be waited for.
                            self.worker_done(&mut pending, epoch, FinishReason::Aborted);
                        }
                    }
                }
                Message::WorkerDone { epoch, reason } => self.worker_done(&mut pending, epoch, reason),
            }
        }
        self.hub.run(None);
        let threads: Vec<_> = self.workers.drain(..).map(|worker| worker.thread).collect();
        for thread in threads {
            // A worker's panic has been reported as an event.
            let _ = thread.join();
        }
        for render in pending {
            self.finish(render.epoch, FinishReason::Aborted);
        }
    }

    /// Counts down; the last worker of a render makes the event.
    fn worker_done(&self, pending: &mut Vec<Pending>, epoch: Epoch, reason: FinishReason) {
        let Some(at) = pending.iter().position(|render| render.epoch == epoch) else { return };
        let render = &mut pending[at];
        render.workers -= 1;
        // The gravest reason wins; of several panics the one at the smallest index, as any of them may come first.
        let grave = |reason: &FinishReason| match reason {
            FinishReason::Complete => (0, 0),
            FinishReason::Aborted => (1, 0),
            FinishReason::Panicked { index, .. } => (2, u64::MAX - index),
        };
        if grave(&reason) > grave(&render.reason) {
            render.reason = reason;
        }
        if render.workers == 0 {
            let Pending { epoch, reason, .. } = pending.swap_remove(at);
            self.finish(epoch, reason);
        }
    }

    /// Reports that a render has ended: first the event, then the end of the epoch, so that whoever sees the end finds the event.
    fn finish(&self, epoch: Epoch, reason: FinishReason) {
        // Nobody may be listening any more.
        let _ = self.events.send(Event::Finished { epoch, reason, at: Instant::now() });
        self.hub.end(epoch);
    }
}
