//! Fan-in: one lane per worker, drained by the client.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use crate::stream::block::Block;
use crate::stream::control::{Epoch, RunningEpoch};
use crate::stream::ring::{self, Consumer};
use crate::stream::signal::Signal;
use crate::stream::writer::LaneWriter;

/// Blocks a lane holds: 1.5 MiB and, at a million samples per second and worker, 65 ms of tracing.
pub const LANE_BLOCKS: usize = 64;

/// What both ends of the lanes share.
#[derive(Debug, Default)]
pub struct Hub {
    /// The epoch that may run.
    pub(super) running: RunningEpoch,
    /// Rung when a slot becomes free or `running` changes: parked workers listen.
    pub(super) space: Signal,
    /// Rung when a block or an event arrives: the client listens.
    pub(super) data: Signal,
    events: AtomicU64,
    /// The client's end is gone.
    closed: AtomicBool,
}

impl Hub {
    /// The epoch that may run.
    pub fn running(&self) -> &RunningEpoch {
        &self.running
    }

    /// Lets `epoch` run, or nothing; parked workers wake up and look. Without a client nothing runs.
    pub fn run(&self, epoch: Option<Epoch>) {
        self.running.set(epoch);
        if self.closed.load(Ordering::SeqCst) {
            // After `set`: whichever of the two threads comes second, nothing runs in the end.
            self.running.set(None);
        }
        self.space.ring();
    }

    /// Stops `epoch` if it is the one that runs.
    pub fn stop(&self, epoch: Epoch) {
        self.running.stop(epoch);
        self.space.ring();
    }

    /// Ends a client's [`Lanes::wait`], because an event waits for it.
    pub fn announce(&self) {
        self.events.fetch_add(1, Ordering::SeqCst);
        self.data.ring();
    }
}

/// Makes `count` lanes of `blocks` blocks each (rounded up to a power of two): the workers' ends and the client's end.
pub fn lanes(count: usize, blocks: usize) -> (Vec<LaneWriter>, Lanes) {
    let hub = Arc::new(Hub::default());
    let (writers, lanes) = (0..count)
        .map(|_| {
            let (producer, consumer) = ring::ring(blocks, Box::<Block>::default);
            (LaneWriter::new(producer, hub.clone()), consumer)
        })
        .unzip();
    (writers, Lanes { lanes, next: 0, hub, events_seen: 0, stale: 0 })
}

/// What one call of a draining function did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drained {
    /// Blocks handed over.
    pub blocks: usize,
    /// Samples in them.
    pub samples: usize,
    /// Blocks dropped because they were of an older epoch.
    pub stale: usize,
}

/// How full the lanes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fill {
    /// Blocks waiting, over all lanes.
    pub blocks: usize,
    /// Blocks that fit, over all lanes.
    pub capacity: usize,
}

/// The client's end of the stream. Dropping it stops the render.
#[derive(Debug)]
pub struct Lanes {
    pub(super) lanes: Vec<Consumer<Box<Block>>>,
    /// The lane to look at first.
    next: usize,
    pub(super) hub: Arc<Hub>,
    events_seen: u64,
    stale: u64,
}

impl Lanes {
    /// Hands over waiting blocks of `epoch`, one from each lane in turn, as long as the next one fits into `budget`
    /// samples; drops blocks of older epochs. A budget of [`BLOCK_SAMPLES`] or more always gets on.
    ///
    /// Never waits. Blocks of newer epochs stay where they are.
    ///
    /// [`BLOCK_SAMPLES`]: crate::stream::block::BLOCK_SAMPLES
    pub fn drain(&mut self, epoch: Epoch, budget: usize, mut take: impl FnMut(&Block)) -> Drained {
        let mut done = Drained::default();
        let mut idle = 0;
        while idle < self.lanes.len() {
            done.stale += self.drop_stale(self.next, epoch);
            match self.lanes[self.next].read() {
                Some(block) if block.header.epoch == epoch => {
                    if done.samples + block.samples().len() > budget {
                        break;
                    }
                    take(&block);
                    done.blocks += 1;
                    done.samples += block.samples().len();
                    block.release();
                    self.hub.space.ring();
                    idle = 0;
                }
                _ => idle += 1,
            }
            self.next = (self.next + 1) % self.lanes.len();
        }
        done
    }

    /// Sleeps until a block or a new event is there, at most `timeout`; `false` means the time is over.
    ///
    /// An event counts once: the next call sleeps again.
    pub fn wait(&mut self, timeout: Duration) -> bool {
        let Self { lanes, hub, events_seen, .. } = self;
        let answer = hub.data.wait(Some(timeout), || {
            hub.events.load(Ordering::SeqCst) != *events_seen || lanes.iter().any(|lane| !lane.is_empty())
        });
        *events_seen = hub.events.load(Ordering::SeqCst);
        answer
    }

    /// As [`Lanes::wait`], but only `ready` and events end the sleep.
    pub(super) fn wait_for(&mut self, timeout: Duration, mut ready: impl FnMut(&mut Self) -> bool) -> bool {
        let hub = self.hub.clone();
        let seen = self.events_seen;
        let answer =
            hub.data.wait(Some(timeout), || hub.events.load(Ordering::SeqCst) != seen || ready(self));
        self.events_seen = hub.events.load(Ordering::SeqCst);
        answer
    }

    /// How full the lanes are.
    pub fn fill(&self) -> Fill {
        Fill {
            blocks: self.lanes.iter().map(Consumer::len).sum(),
            capacity: self.lanes.iter().map(Consumer::capacity).sum(),
        }
    }

    /// Blocks dropped because they were of an older epoch, since the start.
    pub fn stale_blocks(&self) -> u64 {
        self.stale
    }

    /// Lanes, one per worker.
    pub fn count(&self) -> usize {
        self.lanes.len()
    }

    /// What both ends share; for the server.
    pub fn hub(&self) -> &Arc<Hub> {
        &self.hub
    }

    /// Drops blocks older than `epoch` from the head of one lane.
    pub(super) fn drop_stale(&mut self, lane: usize, epoch: Epoch) -> usize {
        let mut dropped = 0;
        while let Some(block) = self.lanes[lane].read() {
            if block.header.epoch >= epoch {
                break;
            }
            block.release();
            self.hub.space.ring();
            dropped += 1;
        }
        self.stale += dropped as u64;
        dropped
    }
}

impl Drop for Lanes {
    fn drop(&mut self) {
        // Nobody will make space any more: no worker may park for it.
        self.hub.closed.store(true, Ordering::SeqCst);
        self.hub.run(None);
    }
}
