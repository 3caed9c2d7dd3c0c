//! The caller's interface to the tracing threads.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::job::{Priority, unpoisoned};
use crate::server::cost::{CostGrid, CostMap};
use crate::server::job::{RenderJob, Task};
use crate::server::render::PendingRender;
use crate::server::spans::{SpanLog, Spans};
use crate::server::stats::{Stats, StatsCell};
use crate::server::worker::{Work, Worker, trace_chunks};
use crate::stream::{BlockSink, Epoch, Event, Hub, LANE_BLOCKS, Lanes, lanes};
use crate::tracer::Integrator;

/// Errors of [`Server`].
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
        source: rayon::ThreadPoolBuildError,
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

/// A handle to the tracing threads. All methods may be called from any thread. Dropping it calls [`Server::term`].
pub struct Server {
    events: Mutex<Receiver<Event>>,
    events_out: Sender<Event>,
    hub: Arc<Hub>,
    /// The latest render.
    latest: Mutex<Option<Arc<Task>>>,
    threads: usize,
    timed: AtomicBool,
    spans: Arc<SpanLog>,
    workers: Arc<[Mutex<Worker>]>,
    pool: Mutex<Option<TracerPool>>,
}

/// The tracing threads.
struct TracerPool {
    pool: ThreadPool,
    threads: Vec<JoinHandle<()>>,
}

impl Server {
    /// Starts `threads` tracing threads. They sleep until the first render.
    ///
    /// # Errors
    ///
    /// [`ServerError::NoThreads`] for 0, [`ServerError::Spawn`] if the system refuses a thread.
    pub fn start(threads: usize) -> Result<(Server, Lanes), ServerError> {
        Self::start_with(threads, Priority::Normal)
    }

    /// As [`start`](Self::start), with a priority for the tracing threads.
    ///
    /// # Errors
    ///
    /// As [`start`](Self::start).
    pub fn start_with(threads: usize, priority: Priority) -> Result<(Server, Lanes), ServerError> {
        if threads == 0 {
            return Err(ServerError::NoThreads);
        }
        let (writers, lanes) = lanes(threads, LANE_BLOCKS);
        let (events_out, events) = channel();
        let spans = Arc::new(SpanLog::new(threads));
        let workers = writers.into_iter().enumerate().map(|(number, writer)| {
            Mutex::new(Worker { number, sink: BlockSink::new(writer), spans: spans.clone() })
        });
        let server = Server {
            events: Mutex::new(events),
            events_out,
            hub: lanes.hub().clone(),
            latest: Mutex::new(None),
            threads,
            timed: AtomicBool::new(false),
            workers: workers.collect(),
            pool: Mutex::new(Some(TracerPool::start(threads, priority)?)),
            spans,
        };
        Ok((server, lanes))
    }

    /// The command *render*: workers leave the render in progress after their current path and begin this one. Returns at once.
    /// [`Event::Finished`] follows when the range is done or the render is stopped.
    ///
    /// # Errors
    ///
    /// [`ServerError::StaleEpoch`] unless `epoch` is newer than every one before; [`ServerError::Terminated`].
    pub fn render<I: Integrator>(&self, job: RenderJob<I>, epoch: Epoch) -> Result<(), ServerError> {
        let timed = self.timed.load(Ordering::Relaxed);
        let task = Arc::new(Task::new(&job, epoch, self.threads, timed));
        let integrator = job.integrator;
        let work: Work =
            Arc::new(move |worker, task, watch| trace_chunks(integrator.as_ref(), worker, task, watch));
        // Locked until the end, so that epochs, tasks and commands stay in the same order.
        let mut latest = unpoisoned(&self.latest);
        if let Some(last) = latest.as_ref().map(|task| task.epoch).filter(|last| *last >= epoch) {
            return Err(ServerError::StaleEpoch { new: epoch, last });
        }
        let pool = unpoisoned(&self.pool);
        let TracerPool { pool, .. } = pool.as_ref().ok_or(ServerError::Terminated)?;
        self.hub.run(Some(epoch));
        *latest = Some(task.clone());
        let pending = PendingRender::new(task, work, self.threads, self.events_out.clone());
        let workers = self.workers.clone();
        // Each thread executes its broadcasts in order.
        pool.spawn_broadcast(move |thread| pending.run(&mut unpoisoned(&workers[thread.index()])));
        Ok(())
    }

    /// The command *abort*: stops the render in progress after at most one path per worker. Blocks that were sent, and unfinished
    /// ones that still fit into their lanes, remain valid: the picture so far can be completed from them.
    pub fn abort(&self) {
        self.hub.run(None);
    }

    /// The command *term*: stops the render in progress and ends all threads. Returns when they have ended, after at most one
    /// path per worker, whether or not anybody drains the lanes.
    pub fn term(&self) {
        let _latest = unpoisoned(&self.latest);
        self.hub.run(None);
        if let Some(TracerPool { pool, threads }) = unpoisoned(&self.pool).take() {
            // The threads end when they have ended their renders.
            drop(pool);
            for thread in threads {
                // Panics of paths were reported as events.
                let _ = thread.join();
            }
        }
    }

    /// The oldest event that has not been read. [`Lanes::wait`] wakes up for events, too.
    pub fn event(&self) -> Option<Event> {
        unpoisoned(&self.events).try_recv().ok()
    }

    /// As [`Server::event`], but waits for an event. Another thread must drain the lanes meanwhile, or a render that fills them
    /// cannot finish.
    pub fn wait_event(&self, timeout: Duration) -> Option<Event> {
        unpoisoned(&self.events).recv_timeout(timeout).ok()
    }

    /// Statistics of the latest render. They are exact once it has finished, and slightly out of date before.
    pub fn stats(&self) -> Stats {
        unpoisoned(&self.latest).as_ref().map_or_else(Stats::default, |task| Stats {
            epoch: task.epoch,
            workers: task.stats.iter().map(StatsCell::read).collect(),
        })
    }

    /// Switches the cost map on or off from the next render on; see [`Server::cost_map`]. It costs a few nanoseconds per path.
    pub fn set_cost_map(&self, on: bool) {
        self.timed.store(on, Ordering::Relaxed);
    }

    /// The cost of the latest render's paths by region of the picture. Empty unless [`Server::set_cost_map`] was called before.
    ///
    /// A path is attributed to the position of its first camera sample, or of its first sample if there is none. So the map is
    /// meaningful for methods that trace one path from the camera per index.
    pub fn cost_map(&self) -> CostMap {
        unpoisoned(&self.latest).as_ref().map_or_else(CostMap::default, |task| CostGrid::read(&task.costs))
    }

    /// Switches the recording of [`ChunkSpan`](crate::server::ChunkSpan)s on or off for chunks that begin from now on. When off,
    /// it costs one relaxed load per chunk.
    pub fn set_tracing(&self, on: bool) {
        self.spans.set(on);
    }

    /// Takes the chunks recorded since the last call: of each worker at most the last
    /// [`MAX_SPANS`](crate::server::spans::MAX_SPANS).
    pub fn take_spans(&self) -> Spans {
        self.spans.take()
    }

    /// Number of tracing threads.
    pub fn threads(&self) -> usize {
        self.threads
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.term();
    }
}

impl TracerPool {
    fn start(count: usize, priority: Priority) -> Result<Self, ServerError> {
        let mut threads = Vec::with_capacity(count);
        let pool = ThreadPoolBuilder::new()
            .num_threads(count)
            .start_handler(move |_| priority.apply())
            .spawn_handler(|thread| {
                let builder = Builder::new().name(format!("tracer {}", thread.index())).stack_size(8 << 20);
                threads.push(builder.spawn(|| thread.run())?);
                Ok(())
            })
            .build();
        match pool {
            Ok(pool) => Ok(Self { pool, threads }),
            Err(source) => Err(ServerError::Spawn { number: threads.len(), threads: count, source }),
        }
    }
}
