//! The samples of the present epoch, retained on the host: a film of another size, filter or device is filled from them.
//!
//! Samples know no resolution (paper §3.1), so a picture of another size and the same shape needs no new ones; they are only evener within the pixels for which they were
//! traced. The store is bounded: once it is full,
//! samples go to the film alone, and a film that is made anew begins with the retained ones. All memory is taken at the
//! start, so that the process does not grow while it runs.

use crate::stream::block::{BLOCK_SAMPLES, Block};
use crate::stream::{PathCounts, Sample};

/// Most samples that are retained: 64 MiB, 10 per pixel of a 512×512 window.
pub const RETAINED_SAMPLES: usize = (64 << 20) / size_of::<Sample>();

/// Most blocks that are retained: blocks are sent at a certain age even when they are not full.
const RETAINED_BLOCKS: usize = 4 * RETAINED_SAMPLES / BLOCK_SAMPLES;

/// Samples in the order of arrival, and how many of them the present film has.
#[derive(Debug)]
pub struct RetainedSamples {
    samples: Vec<Sample>,
    blocks: Vec<RetainedBlock>,
    /// A block did not fit: the store holds the beginning of the epoch only.
    full: bool,
    /// Largest number of samples and of blocks.
    limits: (usize, usize),
    /// Number of blocks that the present film has.
    fed: usize,
}

/// A block of the store.
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
    /// Room for this many samples and blocks, taken at once.
    pub fn with_room(samples: usize, blocks: usize) -> Self {
        // Written once, so that the pages are there from the start; `clear` leaves the memory where it is.
        let mut store = vec![Sample::default(); samples];
        store.fill(Sample { w: 1.0, ..Sample::default() });
        store.clear();
        let blocks_store = Vec::with_capacity(blocks);
        Self { samples: store, blocks: blocks_store, full: false, limits: (samples, blocks), fed: 0 }
    }

    /// Forgets everything: a new epoch.
    pub fn clear(&mut self) {
        self.samples.clear();
        self.blocks.clear();
        (self.full, self.fed) = (false, 0);
    }

    /// Whether a full block fits.
    pub fn has_room(&self) -> bool {
        !self.full && self.samples.len() + BLOCK_SAMPLES <= self.limits.0 && self.blocks.len() < self.limits.1
    }

    /// Whether half of the room is taken, by samples or by blocks.
    pub fn is_half_full(&self) -> bool {
        2 * self.samples.len() > self.limits.0 || 2 * self.blocks.len() > self.limits.1
    }

    /// Retains a block if it fits; `false` means that neither it nor any later one is retained.
    ///
    /// The block counts as one that the film has if the film has all before it.
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

    /// As [`push`](Self::push), for a film that gets the block only after those before it.
    pub fn push_for_later(&mut self, block: &Block) -> bool {
        let fed = self.fed;
        let pushed = self.push(block);
        self.fed = fed;
        pushed
    }

    /// Starts over for a new film.
    pub fn rewind(&mut self) {
        self.fed = 0;
    }

    /// The film has the samples of all blocks from elsewhere.
    pub fn skip(&mut self) {
        self.fed = self.blocks.len();
    }

    /// Whether the film has every retained block.
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

    /// Shows every block that the present film has: its samples, first index and paths.
    pub fn each(&self, mut show: impl FnMut(&[Sample], u64, PathCounts)) {
        let mut start = 0;
        for block in &self.blocks[..self.fed] {
            show(&self.samples[start..block.end], block.first_index, block.paths);
            start = block.end;
        }
    }

    /// The next block that the film lacks: its samples, first index and paths. From now on the film has it.
    pub fn feed(&mut self) -> Option<(&[Sample], u64, PathCounts)> {
        let &RetainedBlock { end, first_index, paths } = self.blocks.get(self.fed)?;
        let start = self.fed.checked_sub(1).map_or(0, |before| self.blocks[before].end);
        self.fed += 1;
        Some((&self.samples[start..end], first_index, paths))
    }
}
