//! Samples of the present epoch, retained in main memory to fill a film of another size, filter or device.
//!
//! Samples are independent of resolution (paper §3.1), so a picture of another size and the same aspect ratio needs no new ones; only their
//! stratification within pixels is that of the size they were traced for. The store is bounded: once it is full, further samples go to the
//! film alone, and a new film starts with the retained ones. All memory is allocated at the start, so that the process does not grow while
//! it runs.

use crate::stream::block::{BLOCK_SAMPLES, Block};
use crate::stream::{PathCounts, Sample};

/// Most samples that are retained: 64 MiB, 10 per pixel of a 512×512 window.
pub const RETAINED_SAMPLES: usize = (64 << 20) / size_of::<Sample>();

/// Most blocks that are retained: blocks are sent at a certain age even when they are not full.
const RETAINED_BLOCKS: usize = 4 * RETAINED_SAMPLES / BLOCK_SAMPLES;

/// Samples in order of arrival, and how many of them the present film has received.
#[derive(Debug)]
pub struct RetainedSamples {
    samples: Vec<Sample>,
    blocks: Vec<RetainedBlock>,
    /// A block did not fit: the store holds only the beginning of the epoch.
    full: bool,
    /// Capacity in samples and in blocks.
    limits: (usize, usize),
    /// Number of blocks that the present film has received.
    fed: usize,
}

/// A retained block.
#[derive(Clone, Copy, Debug)]
struct RetainedBlock {
    /// End of its samples in the store.
    end: usize,
    first_index: u64,
    paths: PathCounts,
}

impl Default for RetainedSamples {
    fn default() -> Self {
        Self::with_room(RETAINED_SAMPLES, RETAINED_BLOCKS)
    }
}

impl RetainedSamples {
    /// Allocates room for this many samples and blocks.
    pub fn with_room(samples: usize, blocks: usize) -> Self {
        // Written once, so that the pages are resident from the start; `clear` keeps the memory.
        let mut store = vec![Sample::default(); samples];
        store.fill(Sample { w: 1.0, ..Sample::default() });
        store.clear();
        let blocks_store = Vec::with_capacity(blocks);
        Self { samples: store, blocks: blocks_store, full: false, limits: (samples, blocks), fed: 0 }
    }

    /// Discards everything for another epoch.
    pub fn clear(&mut self) {
        self.samples.clear();
        self.blocks.clear();
        (self.full, self.fed) = (false, 0);
    }

    /// Whether a full block fits.
    pub fn has_room(&self) -> bool {
        !self.full && self.samples.len() + BLOCK_SAMPLES <= self.limits.0 && self.blocks.len() < self.limits.1
    }

    /// Whether half of the capacity is used, in samples or in blocks.
    pub fn is_half_full(&self) -> bool {
        2 * self.samples.len() > self.limits.0 || 2 * self.blocks.len() > self.limits.1
    }

    /// Retains a block if it fits; `false` means that neither it nor any later block is retained.
    ///
    /// If the film has received all earlier blocks, this one counts as received too.
    pub fn push(&mut self, block: &Block) -> bool {
        if !self.has_room() {
            self.full = true;
            return false;
        }
        let caught_up = self.caught_up();
        self.samples.extend_from_slice(block.samples());
        let (end, header) = (self.samples.len(), &block.header);
        self.blocks.push(RetainedBlock { end, first_index: header.first_index, paths: header.paths });
        self.fed += usize::from(caught_up);
        true
    }

    /// As [`push`](Self::push), for a film that will receive the block only after the earlier ones.
    pub fn push_for_later(&mut self, block: &Block) -> bool {
        let fed = self.fed;
        let pushed = self.push(block);
        self.fed = fed;
        pushed
    }

    /// Marks all blocks as not received, for a new film.
    pub fn rewind(&mut self) {
        self.fed = 0;
    }

    /// Marks all blocks as received, for a film that got their samples from elsewhere.
    pub fn skip(&mut self) {
        self.fed = self.blocks.len();
    }

    /// Whether the film has received every retained block.
    pub fn caught_up(&self) -> bool {
        self.fed == self.blocks.len()
    }

    /// Whether every block of the epoch was retained.
    pub fn complete(&self) -> bool {
        !self.full
    }

    /// Number of retained samples.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Passes every block that the film has received to `show`: samples, first index and paths.
    pub fn each(&self, mut show: impl FnMut(&[Sample], u64, PathCounts)) {
        let mut start = 0;
        for block in &self.blocks[..self.fed] {
            show(&self.samples[start..block.end], block.first_index, block.paths);
            start = block.end;
        }
    }

    /// The next block that the film lacks: samples, first index and paths. Marks it as received.
    pub fn feed(&mut self) -> Option<(&[Sample], u64, PathCounts)> {
        let &RetainedBlock { end, first_index, paths } = self.blocks.get(self.fed)?;
        let start = self.fed.checked_sub(1).map_or(0, |before| self.blocks[before].end);
        self.fed += 1;
        Some((&self.samples[start..end], first_index, paths))
    }
}
