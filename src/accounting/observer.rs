//! The error observer: estimates the error of a render at checkpoints, on a thread of its own, so that neither tracing nor display is blocked; the
//! [`accumulator`](super::accumulator) adds up the samples. In a window the thread runs at the lowest priority.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use crate::accounting::accumulator::{
    AccountReader, CheckpointPolicy, CheckpointTaker, DueCheckpoint, RenderAccount, SampleAccumulator,
};
use crate::job::{Priority, unpoisoned};
use crate::stream::{PathCounts, Sample};
use crate::study::error::OtherSamples;
use crate::study::prediction::PredictionOutcome;
use crate::study::witness::Witnesses;
use crate::study::{AccumulatedSamples, ErrorMonitor, ErrorStatus, ErrorTarget, MonitorProgress};

/// A render as an observer sees it.
pub struct ObservedRender {
    /// Its error, without any checkpoint yet.
    pub monitor: ErrorMonitor,
    /// Its empty sums, or those that it continues with.
    pub samples: AccumulatedSamples,
    /// Receives the outcomes of the predictions when another render begins.
    pub log: PredictionLog,
}

impl ObservedRender {
    /// As `self`, with witness paths: light that they find and the picture lacks counts as error.
    pub fn with_witnesses(mut self, witnesses: Option<Witnesses>) -> Self {
        witnesses.into_iter().for_each(|witnesses| self.monitor.set_witnesses(witnesses));
        self
    }
}

/// Receives the outcomes of the predictions of a render.
pub type PredictionLog = Box<dyn FnOnce(&[PredictionOutcome]) + Send>;

/// A message to the thread.
enum Message {
    Checkpoint(DueCheckpoint),
    /// Begins another render after the last one took this long, or the same render in another picture, whose witness paths continue.
    Begin {
        monitor: Box<ErrorMonitor>,
        log: PredictionLog,
        ended: Duration,
        goes_on: bool,
    },
    Aim(Option<ErrorTarget>),
    Witnesses(Witnesses),
    /// Publishes this observer's estimate to another.
    Share(SharedEstimate, Subscriber),
    /// Asks the first observer to send its estimate to the second, after everything it received from here.
    AskFor(SharedEstimate, Subscriber, Subscriber),
    /// Receives another observer's estimate, `Duration` after this render began.
    Others(OtherSamples, Duration),
    /// Answers when everything sent before has been processed.
    Sync(Sender<()>),
    /// Answers with the monitor's progress.
    Progress(Sender<MonitorProgress>),
    /// Takes a last checkpoint of these samples and answers with the outcomes of the predictions.
    End(AccumulatedSamples, Duration, Sender<Vec<PredictionOutcome>>),
    Quit,
}

/// Estimates that an observer publishes.
enum SharedEstimate {
    /// The displayed picture in a rectangle: its first pixel, width and height.
    Shown { origin: [usize; 2], size: [usize; 2] },
    /// Its own render, whose origin is at this pixel of the other picture.
    Own { origin: [i64; 2] },
}

/// An observer that receives another's estimates.
struct Subscriber {
    messages: Sender<Message>,
    status: Arc<Published>,
    /// Number of its render; estimates are not sent to later renders.
    number: u64,
    /// Time since its render began.
    at: Duration,
}

/// The number of the render, and its status at the last checkpoint.
type Published = Mutex<(u64, Arc<ErrorStatus>)>;

/// A handle to both threads; dropping it ends them.
pub struct Observer {
    accumulator: SampleAccumulator,
    /// `None` once the thread was told to end.
    messages: Option<Sender<Message>>,
    status: Arc<Published>,
    thread: Option<JoinHandle<()>>,
    began: Instant,
    target: Option<ErrorTarget>,
}

impl Observer {
    /// Starts observing a render with this error target.
    ///
    /// # Errors
    ///
    /// When the system gives no thread.
    pub fn start(
        render: ObservedRender,
        target: Option<ErrorTarget>,
        policy: CheckpointPolicy,
    ) -> std::io::Result<Self> {
        let ObservedRender { monitor, samples, log } = render;
        let (messages, inbox) = channel();
        let status = Arc::new(Published::default());
        let account = RenderAccount { render: 0, samples, due: monitor.due() };
        let checkpoints = messages.clone();
        // If the observer is gone nobody reads the error any more.
        let send = move |checkpoint| _ = checkpoints.send(Message::Checkpoint(checkpoint));
        let accumulator = SampleAccumulator::start(account, policy, send)?;
        let thread = ObserverThread {
            monitor,
            log,
            number: 0,
            policy,
            account: accumulator.reader(),
            checkpoints: accumulator.checkpoint_taker(),
            status: status.clone(),
        };
        let thread = Builder::new().name("observer".to_string()).spawn(move || thread.run(&inbox))?;
        let (messages, thread) = (Some(messages), Some(thread));
        Ok(Self { accumulator, messages, status, thread, began: Instant::now(), target })
    }

    /// Begins another render; logs the outcomes of the last one's predictions.
    pub fn begin(&mut self, render: ObservedRender) {
        let ended = self.began.elapsed();
        self.began = Instant::now();
        self.forget(render, ended, false);
    }

    /// Continues the same render in another picture (another size or filter), which is filled from its first sample on; its witness paths
    /// continue.
    pub fn begin_again(&mut self, render: ObservedRender) {
        self.forget(render, self.began.elapsed(), true);
    }

    fn forget(&mut self, render: ObservedRender, ended: Duration, goes_on: bool) {
        let ObservedRender { monitor, samples, log } = render;
        let number = {
            let mut status = unpoisoned(&self.status);
            *status = (status.0 + 1, Arc::default());
            status.0
        };
        let due = monitor.due();
        // First, so that the thread knows the render before a checkpoint of it is due.
        self.send(Message::Begin { monitor: Box::new(monitor), log, ended, goes_on });
        self.accumulator.begin(RenderAccount { render: number, samples, due });
    }

    /// Changes the error target.
    pub fn set_target(&mut self, target: Option<ErrorTarget>) {
        if self.target != target {
            self.target = target;
            self.send(Message::Aim(target));
        }
    }

    /// Includes the light that these witness paths find and the picture lacks in the estimated error.
    pub fn call(&self, witnesses: Witnesses) {
        self.send(Message::Witnesses(witnesses));
    }

    /// Sends the estimate of a rectangle of the displayed picture, of this first pixel, width and height, to `to`, whose error is from now
    /// on that of the mean of both, weighted by their paths.
    pub fn share_shown(&self, origin: [usize; 2], size: [usize; 2], to: &Observer) {
        self.share(SharedEstimate::Shown { origin, size }, to);
    }

    /// As `whole.share_shown(origin, size, to)`, but after everything that `whole` received from this observer.
    pub fn ask_for(&self, origin: [usize; 2], size: [usize; 2], whole: &Observer, to: &Observer) {
        let estimate = SharedEstimate::Shown { origin, size };
        let ends = Subscriber::new(whole).zip(Subscriber::new(to));
        if let Some((whole, to)) = ends {
            self.send(Message::AskFor(estimate, whole, to));
        }
    }

    /// Sends this render's own estimate to the observer of the picture in which it begins at pixel `origin`: the reverse of
    /// [`share_shown`](Self::share_shown).
    pub fn share_own(&self, to: &Observer, origin: [i64; 2]) {
        self.share(SharedEstimate::Own { origin }, to);
    }

    fn share(&self, estimate: SharedEstimate, to: &Observer) {
        if let Some(to) = Subscriber::new(to) {
            self.send(Message::Share(estimate, to));
        }
    }

    /// The error target.
    pub fn target(&self) -> Option<ErrorTarget> {
        self.target
    }

    /// Copies the samples of a block that goes to the film. Waits for room in the queue.
    pub fn samples(&self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        self.accumulator.add(first_index, paths, samples, self.began.elapsed());
    }

    /// Status at the last checkpoint; after [`sync`](Self::sync), at the last one due.
    pub fn state(&self) -> Arc<ErrorStatus> {
        unpoisoned(&self.status).1.clone()
    }

    /// Time since the render began.
    pub fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }

    /// Excludes a pause of this length from the render time.
    pub fn stood_still(&mut self, time: Duration) {
        self.began += time;
    }

    /// Waits until all samples so far are accumulated, and the checkpoints that were due by then are taken.
    pub fn sync(&self) {
        _ = self.accumulated();
        self.ask(Message::Sync);
    }

    /// Reads the accumulated samples from other threads.
    pub fn account(&self) -> AccountReader {
        self.accumulator.reader()
    }

    /// The accumulated samples; `None` if the thread is gone.
    pub fn accumulated(&self) -> Option<AccumulatedSamples> {
        self.account().read()
    }

    /// Begins to hold out some of the samples of each replicate.
    pub fn hold_out(&self) {
        self.accumulator.hold_out();
    }

    /// From now on weights of camera samples are the inverse of their density on the screen; those so far have the weight 1.
    pub fn set_density_weights(&self) {
        self.accumulator.set_density_weights();
    }

    /// The state of the monitor, to resume from, after all samples so far.
    pub fn progress(&self) -> MonitorProgress {
        self.sync();
        self.ask(Message::Progress)
    }

    /// Takes a last checkpoint; returns the status and the outcomes of the predictions.
    pub fn end(&self) -> (Arc<ErrorStatus>, Vec<PredictionOutcome>) {
        let at = self.began.elapsed();
        let samples = self.accumulated();
        let kept = samples.map(|samples| self.ask(|answer| Message::End(samples, at, answer)));
        (self.state(), kept.unwrap_or_default())
    }

    /// Sends a query and waits for its answer. If the thread has ended the answer is empty.
    fn ask<T: Default>(&self, question: impl FnOnce(Sender<T>) -> Message) -> T {
        let (answer, answers) = channel();
        self.send(question(answer));
        answers.recv().unwrap_or_default()
    }

    /// Number of queued samples.
    #[cfg(test)]
    fn waiting(&self) -> usize {
        self.accumulator.waiting()
    }

    fn send(&self, message: Message) {
        if let Some(messages) = &self.messages {
            // If the send fails the thread has panicked and has said so.
            let _ = messages.send(message);
        }
    }
}

impl Drop for Observer {
    fn drop(&mut self) {
        self.accumulator.close();
        // Checkpoints that are still to be taken would have no reader.
        unpoisoned(&self.status).0 += 1;
        self.send(Message::Quit);
        self.messages = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Subscriber {
    /// The observer and its present render; `None` if the observer ends.
    fn new(observer: &Observer) -> Option<Self> {
        let (number, status) = (unpoisoned(&observer.status).0, observer.status.clone());
        Some(Self { messages: observer.messages.clone()?, status, number, at: observer.elapsed() })
    }

    /// Sends a message, unless the render is over.
    fn tell(&self, message: Message) {
        if unpoisoned(&self.status).0 == self.number {
            let _ = self.messages.send(message);
        }
    }
}

/// The state of the thread.
struct ObserverThread {
    monitor: ErrorMonitor,
    log: PredictionLog,
    /// Number of the render.
    number: u64,
    policy: CheckpointPolicy,
    account: AccountReader,
    checkpoints: CheckpointTaker,
    status: Arc<Published>,
}

impl ObserverThread {
    /// Body of the thread.
    fn run(mut self, inbox: &Receiver<Message>) {
        if self.policy == CheckpointPolicy::WhenIdle {
            Priority::Background.apply();
        }
        while let Ok(message) = inbox.recv()
            && !matches!(message, Message::Quit)
        {
            self.process(message);
        }
    }

    fn process(&mut self, message: Message) {
        let monitor = &mut self.monitor;
        match message {
            Message::Checkpoint(DueCheckpoint { render, samples, at }) => {
                let is_present = unpoisoned(&self.status).0 == render && render == self.number;
                if is_present {
                    monitor.take_checkpoint(&samples, at.as_secs_f64());
                    // Before samples are added again, which would copy the sums.
                    drop(samples);
                    self.publish();
                }
            }
            Message::Begin { monitor: new, log, ended, goes_on } => {
                let last = std::mem::replace(&mut self.log, log);
                last(&monitor.prediction_outcomes(ended.as_secs_f64()));
                let witnesses = monitor.take_witnesses().filter(|_| goes_on);
                (self.monitor, self.number) = (*new, self.number + 1);
                witnesses.into_iter().for_each(|witnesses| self.monitor.set_witnesses(witnesses));
            }
            Message::Aim(target) => {
                monitor.set_target(target);
                self.publish();
            }
            Message::Witnesses(witnesses) => monitor.set_witnesses(witnesses),
            Message::Share(estimate, subscriber) => {
                let others = self.account.read().and_then(|samples| match estimate {
                    SharedEstimate::Shown { origin, size } => monitor.shown(&samples, origin, size),
                    SharedEstimate::Own { origin } => monitor.own(&samples, origin),
                });
                if let Some(others) = others {
                    let at = subscriber.at;
                    subscriber.tell(Message::Others(others, at));
                }
            }
            Message::AskFor(estimate, whole, to) => whole.tell(Message::Share(estimate, to)),
            Message::Others(others, at) => {
                if let Some(samples) = self.account.read() {
                    monitor.add_others(others, &samples, at.as_secs_f64());
                    self.publish();
                }
            }
            Message::Quit => {}
            Message::Sync(answer) => _ = answer.send(()),
            Message::Progress(answer) => _ = answer.send(monitor.progress()),
            Message::End(samples, at, answer) => {
                monitor.take_checkpoint(&samples, at.as_secs_f64());
                let outcomes = monitor.prediction_outcomes(at.as_secs_f64());
                self.publish();
                let _ = answer.send(outcomes);
            }
        }
    }

    /// Publishes the status, unless the render is over, and when the next checkpoint is due.
    fn publish(&self) {
        {
            let mut status = unpoisoned(&self.status);
            if status.0 == self.number {
                status.1 = Arc::new(self.monitor.status().clone());
            }
        }
        self.checkpoints.set_due(self.number, self.monitor.due());
    }
}

#[cfg(test)]
mod tests;
