//! Accumulates the samples of a render on a thread, so that the loop that feeds the film only copies them.

use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use crate::job::unpoisoned;
use crate::stream::{PathCounts, Sample};
use crate::study::AccumulatedSamples;

/// Most queued samples: 64 MiB.
pub(super) const MOST: usize = (64 << 20) / size_of::<Sample>();

/// Room for samples that an empty queue keeps: 8 MiB.
const KEPT_ROOM: usize = (8 << 20) / size_of::<Sample>();

/// In a window, time after the beginning of a render during which samples only queue: a dragged camera begins sixty renders per second,
/// whose sums nobody reads.
const REST: Duration = Duration::from_millis(250);

/// Samples that arrive within this time are added together: a wake-up per block would cost the tracer threads more than the addition.
const PAUSE: Duration = Duration::from_millis(50);

/// When the error is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckpointPolicy {
    /// At exact numbers of paths: no sample is added while an estimate is made. For renders without a window, which must stop at the same
    /// sample every time.
    Exact,
    /// Once the last estimate is finished: accumulation goes on meanwhile. For the window, which must not wait.
    WhenIdle,
}

/// The samples of a render at the moment of a checkpoint.
pub struct DueCheckpoint {
    /// Number of the render.
    pub render: u64,
    pub samples: AccumulatedSamples,
    /// Time from the beginning of the render to the last of these samples.
    pub at: Duration,
}

/// The sums of one render.
pub struct RenderAccount {
    /// Number of the render; checkpoints bear it.
    pub render: u64,
    pub samples: AccumulatedSamples,
    /// Number of paths at the next checkpoint; infinite while one is being taken.
    pub due: f64,
}

/// An entry of the queue.
enum QueueEntry {
    /// A block with this number of the queued samples.
    Block {
        first_index: u64,
        paths: PathCounts,
        samples: usize,
        at: Duration,
    },
    Begin(Box<RenderAccount>),
    /// Begins to hold out some of the samples of each replicate.
    HoldOut,
    /// Weights of camera samples are the inverse of their density from here on.
    DensityWeights,
    /// Answers with a snapshot.
    Snapshot(Sender<AccumulatedSamples>),
}

/// The queued entries in order, and the samples of all their blocks, one after the other.
#[derive(Default)]
struct QueueEntries {
    entries: VecDeque<QueueEntry>,
    samples: Vec<Sample>,
}

/// The queue of a [`SampleAccumulator`].
struct Queue {
    waiting: QueueEntries,
    /// A snapshot is asked for.
    is_urgent: bool,
    /// Nothing that is not urgent is processed before this time.
    rest: Instant,
    /// Number of a render, and the number of its paths at which the next checkpoint is due; not yet read by the thread.
    due: Option<(u64, f64)>,
    /// Whether somebody takes checkpoints.
    has_taker: bool,
    /// Nothing more will come, or nobody is there to process it.
    is_closed: bool,
}

/// State shared by the handles and the thread.
struct Shared {
    queue: Mutex<Queue>,
    /// Signals the thread.
    news: Condvar,
    /// Signals room in the queue.
    room: Condvar,
    policy: CheckpointPolicy,
}

/// A handle to the thread; dropping it ends the thread.
pub struct SampleAccumulator {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// The side of a [`SampleAccumulator`] that other threads read.
#[derive(Clone)]
pub struct AccountReader(Arc<Shared>);

/// The side of a [`SampleAccumulator`] that belongs to the thread that takes checkpoints. When it is dropped no more checkpoints are taken.
pub(super) struct CheckpointTaker(Arc<Shared>);

impl SampleAccumulator {
    /// Starts the thread. It calls `take_checkpoint` whenever a checkpoint is due; the next one comes after
    /// [`set_due`](CheckpointTaker::set_due).
    ///
    /// # Errors
    ///
    /// When the system gives no thread.
    pub fn start(
        first: RenderAccount,
        policy: CheckpointPolicy,
        take_checkpoint: impl Fn(DueCheckpoint) + Send + 'static,
    ) -> std::io::Result<Self> {
        let queue = Queue {
            waiting: QueueEntries::default(),
            is_urgent: false,
            rest: Instant::now(),
            due: None,
            has_taker: true,
            is_closed: false,
        };
        let shared =
            Arc::new(Shared { queue: Mutex::new(queue), news: Condvar::new(), room: Condvar::new(), policy });
        let own = shared.clone();
        let work = move || {
            let _last = CloseOnExit(&own);
            accumulate(&own, first, &take_checkpoint);
        };
        let thread = Builder::new().name("accounting".into()).spawn(work)?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// The part for the thread that takes the checkpoints.
    pub(super) fn checkpoint_taker(&self) -> CheckpointTaker {
        CheckpointTaker(self.shared.clone())
    }

    /// Reads this accumulator from other threads.
    pub fn reader(&self) -> AccountReader {
        AccountReader(self.shared.clone())
    }

    /// Begins another account; queued samples of the last one are dropped.
    pub fn begin(&self, account: RenderAccount) {
        let mut queue = unpoisoned(&self.shared.queue);
        queue.waiting.clear();
        queue.is_urgent = false;
        if self.shared.policy == CheckpointPolicy::WhenIdle {
            queue.rest = Instant::now() + REST;
        }
        self.shared.push(&mut queue, QueueEntry::Begin(Box::new(account)));
    }

    /// Copies the samples of a block into the queue, `at` this time after the render began. Waits for room.
    pub fn add(&self, first_index: u64, paths: PathCounts, samples: &[Sample], at: Duration) {
        let mut queue = unpoisoned(&self.shared.queue);
        let fits = |queue: &Queue| queue.waiting.samples.len() + samples.len() <= MOST;
        while !(fits(&queue) || queue.waiting.samples.is_empty() || queue.is_closed) {
            queue = self.shared.room.wait(queue).unwrap_or_else(|poisoned| poisoned.into_inner());
        }
        queue.waiting.samples.extend_from_slice(samples);
        self.shared.push(&mut queue, QueueEntry::Block { first_index, paths, samples: samples.len(), at });
    }

    /// Begins to hold out some of the samples of each replicate.
    pub fn hold_out(&self) {
        self.shared.push(&mut unpoisoned(&self.shared.queue), QueueEntry::HoldOut);
    }

    /// From now on weights of camera samples are the inverse of their density on the screen.
    pub fn set_density_weights(&self) {
        self.shared.push(&mut unpoisoned(&self.shared.queue), QueueEntry::DensityWeights);
    }

    /// Takes no more samples and ends the thread soon.
    pub(super) fn close(&self) {
        self.shared.close();
    }

    /// Number of queued samples.
    #[cfg(test)]
    pub(super) fn waiting(&self) -> usize {
        unpoisoned(&self.shared.queue).waiting.samples.len()
    }
}

impl Drop for SampleAccumulator {
    fn drop(&mut self) {
        self.close();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl AccountReader {
    /// Asks for the sums of all samples so far. There is no answer if another account begins before, or the thread is gone.
    pub fn ask(&self) -> Receiver<AccumulatedSamples> {
        let (answer, answers) = channel();
        self.0.push(&mut unpoisoned(&self.0.queue), QueueEntry::Snapshot(answer));
        answers
    }

    /// Waits for the sums of all samples so far; `None` as where [`ask`](Self::ask) has no answer. While a checkpoint is taken under
    /// [`CheckpointPolicy::Exact`] it waits for its end, so the thread that takes it must not ask.
    pub fn read(&self) -> Option<AccumulatedSamples> {
        self.ask().recv().ok()
    }
}

impl CheckpointTaker {
    /// Sets the number of paths of this render at which the next checkpoint is due.
    pub fn set_due(&self, render: u64, due: f64) {
        unpoisoned(&self.0.queue).due = Some((render, due));
        self.0.news.notify_one();
    }
}

impl Drop for CheckpointTaker {
    fn drop(&mut self) {
        unpoisoned(&self.0.queue).has_taker = false;
        self.0.news.notify_one();
    }
}

impl QueueEntries {
    fn clear(&mut self) {
        self.entries.clear();
        self.samples.clear();
    }
}

impl Shared {
    fn push(&self, queue: &mut Queue, entry: QueueEntry) {
        if queue.is_closed {
            return queue.waiting.clear();
        }
        queue.is_urgent |= matches!(entry, QueueEntry::Snapshot(_));
        queue.waiting.entries.push_back(entry);
        // Otherwise the thread is awake, or deliberately left asleep.
        if queue.waiting.entries.len() == 1 || queue.is_urgent || queue.waiting.samples.len() > MOST / 2 {
            self.news.notify_one();
        }
    }

    fn close(&self) {
        let mut queue = unpoisoned(&self.queue);
        // Queued work would have no reader.
        queue.waiting.clear();
        queue.is_closed = true;
        self.news.notify_one();
        self.room.notify_all();
    }

    /// Waits for entries and exchanges them for `processed` ones; false at the end. Samples of a render that has just begun stay queued,
    /// and so do those for which shared sums would have to be copied, unless they become many or a snapshot is asked for.
    fn next(&self, account: &mut RenderAccount, processed: &mut QueueEntries) -> bool {
        let mut queue = unpoisoned(&self.queue);
        while !queue.is_closed {
            let left = queue.rest.saturating_duration_since(Instant::now());
            let is_pressing = queue.is_urgent || queue.waiting.samples.len() > MOST / 2;
            queue = match queue.waiting.entries.is_empty() {
                true => self.news.wait(queue).unwrap_or_else(|poisoned| poisoned.into_inner()),
                false if is_pressing || left.is_zero() && !account.samples.is_shared() => break,
                false => {
                    let waited = self.news.wait_timeout(queue, left.max(PAUSE));
                    waited.unwrap_or_else(|poisoned| poisoned.into_inner()).0
                }
            };
        }
        queue.is_urgent = false;
        queue.rest = queue.rest.max(Instant::now() + PAUSE);
        std::mem::swap(&mut queue.waiting, processed);
        self.take_due(&mut queue, account);
        self.room.notify_all();
        !queue.is_closed
    }

    /// Reads when the next checkpoint is due; returns whether that was known.
    fn take_due(&self, queue: &mut Queue, account: &mut RenderAccount) -> bool {
        let due = queue.due.take_if(|(render, _)| *render == account.render);
        account.due = due.map_or(account.due, |(_, due)| due);
        due.is_some()
    }

    /// Under [`CheckpointPolicy::Exact`], waits for the end of a checkpoint.
    fn wait_for_due(&self, account: &mut RenderAccount) {
        if self.policy == CheckpointPolicy::Exact {
            let mut queue = unpoisoned(&self.queue);
            while !self.take_due(&mut queue, account) && queue.has_taker && !queue.is_closed {
                queue = self.news.wait(queue).unwrap_or_else(|poisoned| poisoned.into_inner());
            }
        }
    }
}

/// Closes the queue when dropped, so that nobody waits for a thread that is gone.
struct CloseOnExit<'a>(&'a Shared);

impl Drop for CloseOnExit<'_> {
    fn drop(&mut self) {
        self.0.close();
    }
}

/// Body of the thread.
fn accumulate(shared: &Shared, mut account: RenderAccount, take_checkpoint: &dyn Fn(DueCheckpoint)) {
    let mut taken = QueueEntries::default();
    while shared.next(&mut account, &mut taken) {
        let mut samples = taken.samples.as_slice();
        for entry in taken.entries.drain(..) {
            match entry {
                QueueEntry::Block { first_index, paths, samples: count, at } => {
                    let (block, rest) = samples.split_at(count);
                    samples = rest;
                    account.samples.add(first_index, paths, block);
                    if account.samples.paths() as f64 >= account.due {
                        account.due = f64::INFINITY;
                        let (render, samples) = (account.render, account.samples.clone());
                        take_checkpoint(DueCheckpoint { render, samples, at });
                        shared.wait_for_due(&mut account);
                    }
                }
                QueueEntry::Begin(new) => account = *new,
                QueueEntry::HoldOut => account.samples.hold_out(),
                QueueEntry::DensityWeights => account.samples.set_density_weights(),
                // If nobody waits for it any more, it is dropped.
                QueueEntry::Snapshot(answer) => _ = answer.send(account.samples.clone()),
            }
        }
        taken.samples.clear();
        taken.samples.shrink_to(KEPT_ROOM);
    }
}
