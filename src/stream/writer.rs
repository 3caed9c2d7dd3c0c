//! A worker's end of its lane: sends whole blocks, parks when the lane is full.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::stream::block::Block;
use crate::stream::lanes::Hub;
use crate::stream::ring::Producer;

/// Sends one worker's blocks.
#[derive(Debug)]
pub struct LaneWriter {
    producer: Producer<Box<Block>>,
    hub: Arc<Hub>,
    parked: Duration,
    last_park: Option<(Instant, Instant)>,
}

impl LaneWriter {
    pub(super) fn new(producer: Producer<Box<Block>>, hub: Arc<Hub>) -> Self {
        Self { producer, hub, parked: Duration::ZERO, last_park: None }
    }

    /// Sends `block` and leaves an old one with arbitrary content in its place: the boxes are swapped, no sample is
    /// copied.
    ///
    /// Sleeps while the lane is full and the block's epoch may run. `false` means that it was not sent: the epoch
    /// has been stopped while the lane was full, or a newer one runs.
    pub fn send(&mut self, block: &mut Box<Block>) -> bool {
        let epoch = block.header.epoch;
        let running = &self.hub.running;
        if self.producer.is_full() && running.is(epoch) {
            let start = Instant::now();
            self.hub.space.wait(None, || !self.producer.is_full() || !running.is(epoch));
            let end = Instant::now();
            self.parked += end - start;
            self.last_park = Some((start, end));
        }
        if !running.is(epoch) && !running.is_none() {
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

    /// What both ends share.
    pub fn hub(&self) -> &Arc<Hub> {
        &self.hub
    }
}
