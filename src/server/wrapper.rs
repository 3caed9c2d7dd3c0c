//! The wrapper thread (paper §4.1): takes commands, hands renders to the workers, reports how they ended.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender};
use std::thread::JoinHandle;
use std::time::Instant;

use crate::server::job::Task;
use crate::server::worker::{Assignment, Work};
use crate::stream::{Command, Epoch, Event, Finish, Hub};

/// What the wrapper sleeps on.
pub(super) enum Message {
    /// From the caller.
    Command(Command<(Arc<Task>, Work)>),
    /// From a worker.
    WorkerDone { epoch: Epoch, why: Finish },
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
    why: Finish,
}

/// The state of the wrapper thread.
pub(super) struct Wrapper {
    pub(super) workers: Vec<WorkerHandle>,
    pub(super) hub: Arc<Hub>,
    pub(super) events: Sender<Event>,
}

impl Wrapper {
    /// The command loop: *term*, *abort*, *render*. Returns when every thread has ended.
    pub(super) fn run(self, messages: Receiver<Message>) {
        let mut pending: Vec<Pending> = Vec::new();
        for message in &messages {
            match message {
                Message::Command(Command::Term) => break,
                // The caller has stopped the epoch already, so that no command queue delays an abort.
                Message::Command(Command::Abort) => {}
                Message::Command(Command::Render { job: (task, work), epoch }) => {
                    pending.push(Pending { epoch, workers: self.workers.len(), why: Finish::Complete });
                    for worker in &self.workers {
                        let assignment = Assignment { task: task.clone(), work: work.clone() };
                        if worker.assign.send(assignment).is_err() {
                            // A worker that is gone must not be waited for.
                            self.worker_done(&mut pending, epoch, Finish::Aborted);
                        }
                    }
                }
                Message::WorkerDone { epoch, why } => self.worker_done(&mut pending, epoch, why),
            }
        }
        self.hub.run(None);
        let threads: Vec<_> = self.workers.into_iter().map(|worker| worker.thread).collect();
        for thread in threads {
            // A worker's panic has been reported as an event.
            let _ = thread.join();
        }
        for render in pending {
            let _ = self.events.send(Event::Finished {
                epoch: render.epoch,
                why: Finish::Aborted,
                at: Instant::now(),
            });
        }
        self.hub.announce();
    }

    /// Counts down; the last worker of a render makes the event.
    fn worker_done(&self, pending: &mut Vec<Pending>, epoch: Epoch, why: Finish) {
        let Some(at) = pending.iter().position(|render| render.epoch == epoch) else { return };
        let render = &mut pending[at];
        render.workers -= 1;
        // The gravest reason wins; of several panics the one at the smallest index, as any of them may come first.
        let grave = |why: &Finish| match why {
            Finish::Complete => (0, 0),
            Finish::Aborted => (1, 0),
            Finish::Panicked { index, .. } => (2, u64::MAX - index),
        };
        if grave(&why) > grave(&render.why) {
            render.why = why;
        }
        if render.workers == 0 {
            let Pending { epoch, why, .. } = pending.swap_remove(at);
            // Nobody may be listening any more.
            let _ = self.events.send(Event::Finished { epoch, why, at: Instant::now() });
            self.hub.announce();
        }
    }
}
