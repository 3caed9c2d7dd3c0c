//! The error observer: a thread that estimates the error of the picture, so that neither tracing nor display is blocked.
//!
//! The bounded queue of blocks belongs to the present render: when another begins, queued blocks are dropped. In a window the thread runs
//! at the lowest priority and ignores a render that has only just begun, because a dragged camera begins sixty renders per second whose
//! errors are never displayed.

use std::collections::VecDeque;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result, WrapErr};

use crate::gpu::Region;
use crate::job::unpoisoned;
use crate::render::predictions;
use crate::render::run_spec::RunSpec;
use crate::scene::desc::PhotonUse;
use crate::server::Priority;
use crate::stream::{PathCounts, Sample};
use crate::study::blur::BlurSchedule;
use crate::study::error::OtherSamples;
use crate::study::error_tile::ReplicatePixel;
use crate::study::prediction::PredictionOutcome;
use crate::study::witness::Witnesses;
use crate::study::{
    ErrorMonitor, ErrorStatus, ErrorTarget, ExactReplicates, MonitorProgress, Replicates, SamplesApart,
};
use crate::tracer::integrator::{LAST_GENERATION, SAMPLES_PER_GENERATION};

/// Upper bound on the queued samples: 64 MiB.
const MOST: usize = (64 << 20) / size_of::<Sample>();

/// In a window, pause between two updates.
const REST: Duration = Duration::from_millis(250);

/// Blocks that arrive within this time are processed together: a wake-up per block would cost the tracer threads more than the summation.
const PAUSE: Duration = Duration::from_millis(50);

/// Back-pressure policy: what happens when the queue is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backpressure {
    /// The caller blocks until there is room. For renders without a window.
    Wait,
    /// Blocks are dropped, so that the error is overestimated, never underestimated. For the window, which must not block. The thread runs
    /// at the lowest priority.
    LeaveOut,
}

/// A message to the thread.
enum Message {
    Block {
        first_index: u64,
        paths: PathCounts,
        samples: Box<[Sample]>,
        at: Duration,
    },
    /// Begins another render after the last one took this long, or the same render in another picture, whose witness paths continue.
    /// Everything queued before is dropped.
    Begin {
        watch: Box<ErrorMonitor>,
        ended: Duration,
        last: Arc<RunSpec>,
        goes_on: bool,
    },
    Aim(Option<ErrorTarget>),
    Witnesses(Witnesses),
    /// Publishes this observer's estimate to another.
    Share(SharedEstimate, Subscriber),
    /// Asks the first observer to send its estimate of a rectangle to the second, after everything it received from here.
    AskFor(Region, Subscriber, Subscriber),
    /// Receives another observer's estimate, `Duration` after this render began.
    Others(OtherSamples, Duration),
    /// Answers when everything queued before has been processed.
    Sync(Sender<()>),
    /// Answers with mean and difference of the replicates of every pixel.
    Pixels(Sender<Vec<ReplicatePixel>>),
    /// Answers with the sums of the replicates.
    Replicates(Sender<Option<Replicates>>),
    /// Keeps some of the samples of each replicate apart.
    KeepApart,
    /// Answers with the samples kept apart, if any.
    TakeApart(Sender<Option<SamplesApart>>),
    /// Answers with the exact sums and the monitor's progress, if there are any.
    Progress(Sender<Option<(ExactReplicates, MonitorProgress)>>),
    /// Takes a last checkpoint and answers with the outcomes of the predictions.
    End(Duration, Sender<Vec<PredictionOutcome>>),
}

/// Estimates that an observer publishes.
enum SharedEstimate {
    /// The displayed picture in a rectangle.
    Shown(Region),
    /// Its own render, whose origin is at this pixel of the other picture.
    Own([i64; 2]),
}

/// An observer that receives another's estimates.
struct Subscriber {
    shared: Arc<Shared>,
    /// Number of its render; estimates are not sent to later renders.
    number: u64,
    /// Time since its render began.
    at: Duration,
}

/// State shared by the handle and the thread.
struct Shared {
    inbox: Mutex<Inbox>,
    /// Signals new work.
    news: Condvar,
    /// Signals room in the queue.
    room: Condvar,
    /// The number of the render, and its status at the last checkpoint.
    state: Mutex<(u64, Arc<ErrorStatus>)>,
}

/// The queue of messages.
struct Inbox {
    messages: VecDeque<Message>,
    /// Samples in the queue.
    samples: usize,
    /// A caller is waiting for an answer.
    asked: bool,
    /// Blocks are not processed before this time.
    rest: Instant,
    /// No more messages will come.
    closed: bool,
    /// The thread has ended.
    gone: bool,
}

/// A handle to the thread; dropping it ends the thread.
pub struct Observer {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    backpressure: Backpressure,
    began: Instant,
    run: Arc<RunSpec>,
    target: Option<ErrorTarget>,
}

impl Observer {
    /// Starts observing a render of `run`, which must be divided into replicates.
    pub fn start(run: &RunSpec, target: Option<ErrorTarget>, backpressure: Backpressure) -> Result<Self> {
        Self::start_with(watch(run, target, backpressure), run, target, backpressure)
    }

    /// Resumes observing a render without a window from its saved exact sums.
    pub fn resume(
        run: &RunSpec,
        target: Option<ErrorTarget>,
        sums: ExactReplicates,
        seen: MonitorProgress,
    ) -> Result<Self> {
        let watch = watch(run, target, Backpressure::Wait).exact(sums, seen);
        Self::start_with(watch, run, target, Backpressure::Wait)
    }

    fn start_with(
        watch: ErrorMonitor,
        run: &RunSpec,
        target: Option<ErrorTarget>,
        backpressure: Backpressure,
    ) -> Result<Self> {
        let inbox = Inbox {
            messages: VecDeque::new(),
            samples: 0,
            asked: false,
            rest: Instant::now(),
            closed: false,
            gone: false,
        };
        let shared = Arc::new(Shared {
            inbox: Mutex::new(inbox),
            news: Condvar::new(),
            room: Condvar::new(),
            state: Mutex::default(),
        });
        let own = shared.clone();
        let work = move || {
            if backpressure == Backpressure::LeaveOut {
                Priority::Background.apply();
            }
            let _last = ExitGuard(&own);
            observe(watch, &own);
        };
        let thread = Builder::new().name("observer".to_string()).spawn(work).into_diagnostic();
        let thread =
            thread.wrap_err("cannot start the thread that watches the error; --replicates 1 does without")?;
        let run = Arc::new(run.clone());
        Ok(Self { shared, thread: Some(thread), backpressure, began: Instant::now(), run, target })
    }

    /// Begins another render with these witness paths; logs the outcomes of the last one's predictions.
    pub fn begin(&mut self, run: &RunSpec, witnesses: Option<Witnesses>) {
        let ended = self.began.elapsed();
        self.began = Instant::now();
        let mut watch = Box::new(watch(run, self.target, self.backpressure));
        if let Some(witnesses) = witnesses {
            watch.set_witnesses(witnesses);
        }
        self.forget(run, watch, ended, false);
    }

    /// Continues the same render in another picture (another size or filter), which is filled from its first sample on.
    pub fn begin_again(&mut self, run: &RunSpec) {
        let watch = Box::new(watch(run, self.target, self.backpressure));
        self.forget(run, watch, self.began.elapsed(), true);
    }

    fn forget(&mut self, run: &RunSpec, watch: Box<ErrorMonitor>, ended: Duration, goes_on: bool) {
        let last = std::mem::replace(&mut self.run, Arc::new(run.clone()));
        let mut inbox = unpoisoned(&self.shared.inbox);
        inbox.messages.retain(|message| !matches!(message, Message::Block { .. }));
        inbox.samples = 0;
        if self.backpressure == Backpressure::LeaveOut {
            inbox.rest = Instant::now() + REST;
        }
        inbox.messages.push_back(Message::Begin { watch, ended, last, goes_on });
        // Under the lock, so that the thread cannot have begun the new render already.
        let mut state = unpoisoned(&self.shared.state);
        *state = (state.0 + 1, Arc::default());
        self.shared.news.notify_one();
    }

    /// Changes the error target.
    pub fn set_target(&mut self, target: Option<ErrorTarget>) {
        if self.target != target {
            self.target = target;
            self.send(Message::Aim(target), false);
        }
    }

    /// Includes the light that these witness paths find and the picture lacks in the estimated error.
    pub fn call(&self, witnesses: Witnesses) {
        self.send(Message::Witnesses(witnesses), false);
    }

    /// Sends the estimate of a rectangle of the displayed picture to `to`, whose error is from now on that of the mean of both, weighted by
    /// their paths.
    pub fn share_shown(&self, rectangle: Region, to: &Observer) {
        self.send(Message::Share(SharedEstimate::Shown(rectangle), Subscriber::new(to)), false);
    }

    /// As `whole.share_shown(rectangle, to)`, but after everything that `whole` received from this observer.
    pub fn ask_for(&self, rectangle: Region, whole: &Observer, to: &Observer) {
        self.send(Message::AskFor(rectangle, Subscriber::new(whole), Subscriber::new(to)), false);
    }

    /// Sends this render's own estimate to the observer of the picture in which it begins at pixel `origin`: the reverse of
    /// [`share_shown`](Self::share_shown).
    pub fn share_own(&self, to: &Observer, origin: [i64; 2]) {
        self.send(Message::Share(SharedEstimate::Own(origin), Subscriber::new(to)), false);
    }

    /// The error target.
    pub fn target(&self) -> Option<ErrorTarget> {
        self.target
    }

    /// Copies the samples of a block that goes to the film.
    pub fn samples(&self, first_index: u64, paths: PathCounts, samples: &[Sample]) {
        let (at, count) = (self.began.elapsed(), samples.len());
        let samples: Box<[Sample]> = samples.into();
        let mut inbox = unpoisoned(&self.shared.inbox);
        while inbox.samples + count > MOST && !inbox.gone {
            if self.backpressure == Backpressure::LeaveOut {
                return;
            }
            inbox = self.shared.room.wait(inbox).unwrap_or_else(|poisoned| poisoned.into_inner());
        }
        inbox.samples += count;
        inbox.messages.push_back(Message::Block { first_index, paths, samples, at });
        // Otherwise the thread is awake, or deliberately left asleep.
        if inbox.messages.len() == 1 || inbox.samples > MOST / 2 {
            self.shared.news.notify_one();
        }
    }

    /// Status at the last checkpoint; after [`sync`](Self::sync), at the last one due.
    pub fn state(&self) -> Arc<ErrorStatus> {
        unpoisoned(&self.shared.state).1.clone()
    }

    /// Time since the render began.
    pub fn elapsed(&self) -> Duration {
        self.began.elapsed()
    }

    /// Excludes a pause of this length from the render time.
    pub fn stood_still(&mut self, time: Duration) {
        self.began += time;
    }

    /// Number of queued samples.
    #[cfg(test)]
    fn waiting(&self) -> usize {
        unpoisoned(&self.shared.inbox).samples
    }

    /// Waits until everything queued before has been processed.
    pub fn sync(&self) {
        self.ask(Message::Sync);
    }

    /// Mean and difference of the replicates of every pixel so far, as [`Replicates::pixels`](crate::study::Replicates::pixels) returns them; empty before
    /// each replicate has traced a path.
    pub fn pixels(&self) -> Vec<ReplicatePixel> {
        self.ask(Message::Pixels)
    }

    /// The sums of the replicates so far; `None` if the thread is gone.
    pub fn replicates(&self) -> Option<Replicates> {
        self.ask(Message::Replicates)
    }

    /// Begins to keep some of the samples of each replicate apart.
    pub fn keep_apart(&self) {
        self.send(Message::KeepApart, false);
    }

    /// Takes the samples kept apart, if any.
    pub fn take_apart(&self) -> Option<SamplesApart> {
        self.ask(Message::TakeApart)
    }

    /// Exact sums of the replicates and the state to resume from; `None` if none are kept.
    pub fn progress(&self) -> Option<(ExactReplicates, MonitorProgress)> {
        self.ask(Message::Progress)
    }

    /// Takes a last checkpoint; returns the status and the outcomes of the predictions.
    pub fn end(&self) -> (Arc<ErrorStatus>, Vec<PredictionOutcome>) {
        let kept = self.ask(|answer| Message::End(self.began.elapsed(), answer));
        (self.state(), kept)
    }

    /// Sends a query and waits for its answer. If the thread has ended the answer is empty.
    fn ask<T: Default>(&self, question: impl FnOnce(Sender<T>) -> Message) -> T {
        let (answer, answers) = channel();
        self.send(question(answer), true);
        answers.recv().unwrap_or_default()
    }

    fn send(&self, message: Message, asks: bool) {
        let mut inbox = unpoisoned(&self.shared.inbox);
        if !inbox.gone {
            inbox.asked |= asks;
            inbox.messages.push_back(message);
        }
        self.shared.news.notify_one();
    }
}

impl Drop for Observer {
    fn drop(&mut self) {
        {
            let mut inbox = unpoisoned(&self.shared.inbox);
            // Queued work would have no reader.
            inbox.messages.clear();
            inbox.closed = true;
        }
        self.shared.news.notify_one();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    /// Waits for the next message; `None` at the end. Blocks of a render that has just begun stay queued, unless they become many or a
    /// caller is waiting.
    fn next(&self) -> Option<Message> {
        let mut inbox = unpoisoned(&self.inbox);
        loop {
            let left = inbox.rest.saturating_duration_since(Instant::now());
            let patient = !inbox.asked && !inbox.closed && inbox.samples <= MOST / 2 && !left.is_zero();
            match inbox.messages.front() {
                None if inbox.closed => return None,
                Some(Message::Block { .. }) if patient => {
                    let waited = self.news.wait_timeout(inbox, left);
                    inbox = waited.unwrap_or_else(|poisoned| poisoned.into_inner()).0;
                }
                Some(_) => break,
                None => {
                    inbox = self.news.wait(inbox).unwrap_or_else(|poisoned| poisoned.into_inner());
                }
            }
        }
        let message = inbox.messages.pop_front();
        if let Some(Message::Block { samples, .. }) = &message {
            inbox.samples = inbox.samples.saturating_sub(samples.len());
            self.room.notify_one();
        }
        inbox.asked &= !inbox.messages.is_empty();
        if inbox.messages.is_empty() {
            inbox.rest = inbox.rest.max(Instant::now() + PAUSE);
        }
        message
    }

    /// Publishes the status of render `number`, unless that is over.
    fn publish(&self, number: u64, watch: &ErrorMonitor) {
        let mut state = unpoisoned(&self.state);
        if state.0 == number {
            state.1 = Arc::new(watch.status().clone());
        }
    }
}

impl Subscriber {
    /// The observer and its present render.
    fn new(observer: &Observer) -> Self {
        let number = unpoisoned(&observer.shared.state).0;
        Self { shared: observer.shared.clone(), number, at: observer.elapsed() }
    }

    /// Sends a message, unless the render is over.
    fn tell(&self, message: Message) {
        let mut inbox = unpoisoned(&self.shared.inbox);
        if !inbox.gone && unpoisoned(&self.shared.state).0 == self.number {
            inbox.messages.push_back(message);
            self.shared.news.notify_one();
        }
    }
}

/// Marks the thread as ended when dropped, so that no caller waits for it.
struct ExitGuard<'a>(&'a Shared);

impl Drop for ExitGuard<'_> {
    fn drop(&mut self) {
        let mut inbox = unpoisoned(&self.0.inbox);
        (inbox.gone, inbox.samples) = (true, 0);
        inbox.messages.clear();
        self.0.room.notify_all();
    }
}

fn watch(run: &RunSpec, target: Option<ErrorTarget>, backpressure: Backpressure) -> ErrorMonitor {
    let watch = ErrorMonitor::new([run.film.width, run.film.height], run.film.filter.energy(), target)
        .with_coverage(run.film.coverage())
        .that_blurs(run.is_blurred());
    let watch = if run.adaptive { watch.with_density_weights() } else { watch };
    match blur(run, backpressure) {
        Some(schedule) => watch.with_blur(schedule),
        None => watch,
    }
}

/// Schedule of the photon radius of this render; `None` without photons, and if it may begin with the photon maps of the last render.
fn blur(run: &RunSpec, backpressure: Backpressure) -> Option<BlurSchedule> {
    let last_generation = match run.integrator.traits().photons {
        PhotonUse::Gathered if run.deterministic || backpressure == Backpressure::Wait => LAST_GENERATION,
        // Only a small fraction of its light paths store photons.
        PhotonUse::Merged if run.photons.caustics => u64::MAX,
        _ => return None,
    };
    Some(BlurSchedule {
        samples_per_generation: SAMPLES_PER_GENERATION,
        samples_per_index: run.integrator.paths_per_index(),
        alpha: run.photons.alpha.unwrap_or(0.0),
        last_generation,
    })
}

/// Body of the thread.
fn observe(mut watch: ErrorMonitor, shared: &Shared) {
    let mut number = 0;
    while let Some(message) = shared.next() {
        match message {
            Message::Block { first_index, paths, samples, at } => {
                watch.add(first_index, paths, &samples);
                if watch.is_due() {
                    watch.take_checkpoint(at.as_secs_f64());
                    shared.publish(number, &watch);
                }
            }
            Message::Begin { watch: new, ended, last, goes_on } => {
                predictions::log(&last, &watch.prediction_outcomes(ended.as_secs_f64()));
                let witnesses = watch.take_witnesses().filter(|_| goes_on);
                (watch, number) = (*new, number + 1);
                witnesses.into_iter().for_each(|witnesses| watch.set_witnesses(witnesses));
            }
            Message::Aim(target) => {
                watch.set_target(target);
                shared.publish(number, &watch);
            }
            Message::Witnesses(witnesses) => watch.set_witnesses(witnesses),
            Message::Share(estimate, subscriber) => {
                let others = match estimate {
                    SharedEstimate::Shown(Region { origin, extent }) => {
                        watch.shown(origin.map(|n| n as usize), extent.map(|n| n as usize))
                    }
                    SharedEstimate::Own(origin) => watch.own(origin),
                };
                if let Some(others) = others {
                    subscriber.tell(Message::Others(others, subscriber.at));
                }
            }
            Message::AskFor(rectangle, whole, to) => {
                whole.tell(Message::Share(SharedEstimate::Shown(rectangle), to));
            }
            Message::Others(others, at) => {
                watch.add_others(others, at.as_secs_f64());
                shared.publish(number, &watch);
            }
            Message::Sync(answer) => {
                let _ = answer.send(());
            }
            Message::Pixels(answer) => {
                let _ = answer.send(watch.replicates().pixels().unwrap_or_default());
            }
            Message::Replicates(answer) => {
                let _ = answer.send(Some(watch.replicates().clone()));
            }
            Message::KeepApart => watch.keep_apart(),
            Message::TakeApart(answer) => {
                let _ = answer.send(watch.take_apart());
            }
            Message::Progress(answer) => {
                let _ = answer.send(watch.progress());
            }
            Message::End(at, answer) => {
                watch.take_checkpoint(at.as_secs_f64());
                shared.publish(number, &watch);
                let _ = answer.send(watch.prediction_outcomes(at.as_secs_f64()));
            }
        }
    }
}

#[cfg(test)]
mod tests;
