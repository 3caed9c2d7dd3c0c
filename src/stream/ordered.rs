//! Draining in order of index, so that one machine gives one picture, bit for bit, however many threads trace.

use std::time::Duration;

use crate::stream::block::Block;
use crate::stream::control::Epoch;
use crate::stream::lanes::{Drained, Lanes};

/// Where an ordered client stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cursor {
    epoch: Epoch,
    expected: u64,
}

impl Cursor {
    /// Starts at the first index of the render of `epoch`.
    pub fn new(epoch: Epoch, first_index: u64) -> Self {
        Self { epoch, expected: first_index }
    }

    /// All paths before this index have been handed over. The render is through when it reaches the end of the range.
    pub fn expected(&self) -> u64 {
        self.expected
    }
}

/// A merge of the lanes by first index; nothing is buffered, a block waits in its lane until its turn.
///
/// It cannot stall. Workers claim chunks in ascending order and finish one before they claim the next, so each lane
/// ascends, and the chunk that holds the expected index has been claimed before every later one. Let w be its worker:
/// all blocks of w before the expected one have been taken, so the expected block is at the head of w's lane, or that
/// lane is empty and w, not parked, is still tracing it. Others may be parked on full lanes meanwhile; they hold later
/// indices only.
impl Lanes {
    /// Hands over blocks in order of index as long as the next one in order is there and fits into `budget` samples;
    /// drops blocks of older epochs.
    ///
    /// The *sequence of samples* depends on (job, seed) only. With a job that flushes full blocks only
    /// (`deadline: None`) so do the blocks, and with them every batch a client makes by filling a budget completely.
    pub fn drain_ordered(
        &mut self,
        cursor: &mut Cursor,
        budget: usize,
        mut take: impl FnMut(&Block),
    ) -> Drained {
        let mut done = Drained::default();
        for lane in 0..self.lanes.len() {
            done.stale += self.drop_stale(lane, cursor.epoch);
        }
        while let Some(lane) = self.lane_of(cursor) {
            let Some(block) = self.lanes[lane].read() else { break };
            if done.samples + block.samples().len() > budget {
                break;
            }
            take(&block);
            cursor.expected += block.header.index_count;
            done.blocks += 1;
            done.samples += block.samples().len();
            block.release();
            self.hub.space.ring();
        }
        done
    }

    /// Sleeps until the next block in order or a new event is there, at most `timeout`.
    pub fn wait_ordered(&mut self, cursor: &Cursor, timeout: Duration) -> bool {
        self.wait_for(timeout, |lanes| {
            for lane in 0..lanes.lanes.len() {
                lanes.drop_stale(lane, cursor.epoch);
            }
            lanes.lane_of(cursor).is_some()
        })
    }

    /// The lane whose oldest block is the next one in order. At most one lane has it: indices are claimed once.
    fn lane_of(&mut self, cursor: &Cursor) -> Option<usize> {
        self.lanes.iter_mut().position(|lane| {
            lane.read().is_some_and(|block| {
                block.header.epoch == cursor.epoch && block.header.first_index == cursor.expected
            })
        })
    }
}
