//! Samples of the present epoch, retained in main memory to fill a film of another size, filter or device.
//!
//! Samples are independent of resolution (paper §3.1), so a picture of another size and the same aspect ratio needs no new ones; only their
//! stratification within pixels is that of the size they were traced for. The store is bounded: once it is full, further samples go to the
//! film alone, and a new film starts with the retained ones. All memory is allocated at the start, so that the process does not grow while
//! it runs.

use crate::stream::block::{BLOCK_SAMPLES, Block};
use crate::stream::{BlockEyes, PathCounts, Sample};

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
    /// The eyes that blocks carry samples of.
    eyes: BlockEyes,
    /// Number of retained samples of the left eye, or the only one.
    left: usize,
    /// Capacity in samples and in blocks.
    limits: (usize, usize),
    /// Number of blocks that the present film has received.
    fed: usize,
}

/// A retained block.
#[derive(Clone, Copy, Debug)]
struct RetainedBlock {
    /// Ends of its samples of the left and of the right eye in the store, where those of the right follow those of the left.
    ends: [usize; 2],
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
        Self {
            samples: store,
            blocks: blocks_store,
            full: false,
            eyes: BlockEyes::One,
            left: 0,
            limits: (samples, blocks),
            fed: 0,
        }
    }

    /// Discards everything for another epoch of the same eyes.
    pub fn clear(&mut self) {
        self.samples.clear();
        self.blocks.clear();
        (self.full, self.fed, self.left) = (false, 0, 0);
    }

    /// Discards everything for another epoch, whose blocks carry samples of these eyes.
    pub fn begin(&mut self, eyes: BlockEyes) {
        self.clear();
        self.eyes = eyes;
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
        let eyes = self.eyes.split(block);
        let ends = eyes.map(|samples| {
            self.samples.extend_from_slice(samples);
            self.samples.len()
        });
        self.left += eyes[0].len();
        let header = &block.header;
        self.blocks.push(RetainedBlock { ends, first_index: header.first_index, paths: header.paths });
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

    /// Number of retained samples; of two eyes those of the left, as a film counts them.
    pub fn len(&self) -> usize {
        self.left
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Passes every block that the film has received to `show`: samples of the left and of the right eye, first index and paths.
    pub fn each(&self, mut show: impl FnMut([&[Sample]; 2], u64, PathCounts)) {
        for (at, block) in self.blocks[..self.fed].iter().enumerate() {
            show(self.samples_of(at), block.first_index, block.paths);
        }
    }

    /// The next block that the film lacks: samples of the left and of the right eye, first index and paths. Marks it as received.
    pub fn feed(&mut self) -> Option<([&[Sample]; 2], u64, PathCounts)> {
        let &RetainedBlock { first_index, paths, .. } = self.blocks.get(self.fed)?;
        self.fed += 1;
        Some((self.samples_of(self.fed - 1), first_index, paths))
    }

    /// Samples of both eyes of the block of this number.
    fn samples_of(&self, at: usize) -> [&[Sample]; 2] {
        let start = at.checked_sub(1).map_or(0, |before| self.blocks[before].ends[1]);
        let [left, right] = self.blocks[at].ends;
        [&self.samples[start..left], &self.samples[left..right]]
    }
}
