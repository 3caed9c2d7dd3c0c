//! One lane per worker, and the consumer's end of all of them.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use crate::stream::block::Block;
use crate::stream::control::Epoch;
use crate::stream::hub::Hub;
use crate::stream::ring::{self, Consumer, Producer};

/// Blocks a lane holds: 1.5 MiB and, at a million samples per second and worker, 65 ms of tracing.
pub const LANE_BLOCKS: usize = 64;

/// Makes `count` lanes of `blocks` blocks each (rounded up to a power of two): the workers' ends and the consumer's end.
pub fn lanes(count: usize, blocks: usize) -> (Vec<LaneWriter>, Lanes) {
    let hub = Arc::new(Hub::default());
    let (writers, lanes) = (0..count)
        .map(|_| {
            let (producer, consumer) = ring::ring(blocks, Box::<Block>::default);
            let hub = hub.clone();
            (LaneWriter { producer, hub, parked: Duration::ZERO, last_park: None }, consumer)
        })
        .unzip();
    let (epoch, order) = (Epoch::default(), DrainOrder::Arrival);
    (
        writers,
        Lanes {
            lanes,
            hub,
            epoch,
            order,
            next_index: 0,
            next_lane: 0,
            events_seen: 0,
            stale: Drained::default(),
        },
    )
}

/// A worker's end of its lane.
#[derive(Debug)]
pub struct LaneWriter {
    producer: Producer<Box<Block>>,
    hub: Arc<Hub>,
    parked: Duration,
    last_park: Option<(Instant, Instant)>,
}

impl LaneWriter {
    /// Sends `block` and leaves an old one with arbitrary content in its place: the boxes are swapped, no sample is
    /// copied.
    ///
    /// Sleeps while the lane is full and the block's epoch may run. Returns `false` if the block was not sent, because
    /// its epoch was stopped while the lane was full, or because a newer epoch runs.
    pub fn send(&mut self, block: &mut Box<Block>) -> bool {
        let epoch = block.header.epoch;
        let hub = &self.hub;
        if self.producer.is_full() && hub.is_running(epoch) {
            let start = Instant::now();
            hub.space.wait(None, || !self.producer.is_full() || !hub.is_running(epoch));
            let end = Instant::now();
            self.parked += end - start;
            self.last_park = Some((start, end));
        }
        if !hub.is_running(epoch) && !hub.is_idle() {
            return false;
        }
        let Some(mut slot) = self.producer.grant() else {
            return false;
        };
        std::mem::swap(&mut *slot, block);
        slot.commit();
        self.hub.data.ring();
        true
    }

    /// Time spent asleep on a full lane since the start.
    pub fn parked(&self) -> Duration {
        self.parked
    }

    /// Begin and end of the last sleep on a full lane.
    pub fn last_park(&self) -> Option<(Instant, Instant)> {
        self.last_park
    }

    /// The state that both ends share.
    pub fn hub(&self) -> &Arc<Hub> {
        &self.hub
    }
}

/// The order in which a consumer takes the blocks of one render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrainOrder {
    /// As they arrive, one from each lane in turn.
    Arrival,
    /// In order of path index, so that the picture is the same, bit for bit, with any number of workers.
    ///
    /// The *sequence of samples* depends on job and seed only. With a job that flushes full blocks only
    /// (`deadline: None`) so do the blocks, and with them every batch that a consumer makes by filling a budget.
    ///
    /// Nothing is buffered: a block waits in its lane until its turn. This cannot stall. Workers claim chunks in
    /// ascending order and finish one before they claim the next, so each lane ascends, and the chunk that holds the
    /// expected index has been claimed before every later one. Let w be its worker: all blocks of w before the expected
    /// one have been taken, so the expected block is at the head of w's lane, or that lane is empty and w, not parked, is
    /// still tracing it. Others may be parked on full lanes meanwhile, but these hold later indices only.
    Index {
        /// First index of the render's range.
        first: u64,
    },
}

/// The result of [`Lanes::drain`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drained {
    /// Blocks handed over.
    pub blocks: usize,
    /// Samples in them, those of groups of lights included.
    pub samples: usize,
}

/// The fill level of the lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fill {
    /// Blocks waiting, over all lanes.
    pub blocks: usize,
    /// Blocks that fit, over all lanes.
    pub capacity: usize,
}

/// The consumer's end of the stream. It follows one render at a time. Dropping it stops the render.
#[derive(Debug)]
pub struct Lanes {
    lanes: Vec<Consumer<Box<Block>>>,
    hub: Arc<Hub>,
    /// The render that is followed.
    epoch: Epoch,
    order: DrainOrder,
    /// All paths before this index have been handed over, if the order is that of the index.
    next_index: u64,
    /// The lane to look at first.
    next_lane: usize,
    events_seen: u64,
    stale: Drained,
}

impl Lanes {
    /// Turns to the render of `epoch`. From now on blocks of older epochs are dropped.
    pub fn follow(&mut self, epoch: Epoch, order: DrainOrder) {
        self.epoch = epoch;
        self.order = order;
        self.next_index = match order {
            DrainOrder::Arrival => 0,
            DrainOrder::Index { first } => first,
        };
    }

    /// Hands over waiting blocks of the followed epoch, as long as the next one in order is there and fits into `budget`
    /// samples. A budget of [`BLOCK_SAMPLES`](crate::stream::BLOCK_SAMPLES) or more always makes progress.
    ///
    /// Never waits. Blocks of newer epochs stay where they are.
    pub fn drain(&mut self, budget: usize, mut take: impl FnMut(&Block)) -> Drained {
        let mut done = Drained::default();
        while let Some(lane) = self.lane_of_next() {
            let Some(block) = self.lanes[lane].read() else { break };
            if done.samples + block.sample_count() > budget {
                break;
            }
            take(&block);
            self.next_index += block.header.index_count;
            self.next_lane = lane + 1;
            done.blocks += 1;
            done.samples += block.sample_count();
            block.release();
            self.hub.space.ring();
        }
        done
    }

    /// Sleeps until the next block in order or a new event is there, at most `timeout`. `false` means the time is over.
    ///
    /// An event counts once: the next call sleeps again.
    pub fn wait(&mut self, timeout: Duration) -> bool {
        let (hub, seen) = (self.hub.clone(), self.events_seen);
        let answer = hub.data.wait(Some(timeout), || {
            hub.events.load(Ordering::SeqCst) != seen || self.lane_of_next().is_some()
        });
        self.events_seen = hub.events.load(Ordering::SeqCst);
        answer
    }

    /// True once the followed render has ended and every block of it was taken. Its [`Event::Finished`] can be read then.
    ///
    /// [`Event::Finished`]: crate::stream::Event::Finished
    pub fn is_drained(&mut self) -> bool {
        // The end is read before the lanes: what they hold after it is all that will come.
        self.hub.has_ended(self.epoch) && self.lane_of_next().is_none()
    }

    /// All paths before this index have been handed over, where the order is [`DrainOrder::Index`].
    pub fn next_index(&self) -> u64 {
        self.next_index
    }

    /// The fill level of the lanes.
    pub fn fill(&self) -> Fill {
        Fill {
            blocks: self.lanes.iter().map(Consumer::len).sum(),
            capacity: self.lanes.iter().map(Consumer::capacity).sum(),
        }
    }

    /// Blocks dropped because they were of an older epoch, since the start.
    pub fn stale_blocks(&self) -> u64 {
        self.stale.blocks as u64
    }

    /// Samples in them, those of groups of lights included.
    pub fn stale_samples(&self) -> u64 {
        self.stale.samples as u64
    }

    /// The state that both ends share. A producer starts, stops and ends epochs with it.
    pub fn hub(&self) -> &Arc<Hub> {
        &self.hub
    }

    /// The lane whose oldest block is the next one in order. Drops blocks of older epochs that are in the way.
    fn lane_of_next(&mut self) -> Option<usize> {
        let (first, count) = (self.next_lane, self.lanes.len());
        (first..first + count).map(|lane| lane % count).find(|&lane| self.has_next(lane))
    }

    fn has_next(&mut self, lane: usize) -> bool {
        while let Some(block) = self.lanes[lane].read() {
            let header = &block.header;
            if header.epoch >= self.epoch {
                // In order of index one lane at most has the next block: indices are claimed once.
                let in_turn = self.order == DrainOrder::Arrival || header.first_index == self.next_index;
                return header.epoch == self.epoch && in_turn;
            }
            self.stale.blocks += 1;
            self.stale.samples += block.sample_count();
            block.release();
            self.hub.space.ring();
        }
        false
    }
}

impl Drop for Lanes {
    fn drop(&mut self) {
        // No more space will be made: wakes workers that are parked for it.
        self.hub.close();
    }
}
