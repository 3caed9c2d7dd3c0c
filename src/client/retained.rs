//! The samples of the present epoch, retained on the host: a film of another size, filter or device is filled from them.
//!
//! Samples know no resolution (paper §3.1), so a resized window needs no new ones. The store is bounded: once it is full,
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

    /// The next block that the film lacks: its samples, first index and paths. From now on the film has it.
    pub fn feed(&mut self) -> Option<(&[Sample], u64, PathCounts)> {
        let &RetainedBlock { end, first_index, paths } = self.blocks.get(self.fed)?;
        let start = self.fed.checked_sub(1).map_or(0, |before| self.blocks[before].end);
        self.fed += 1;
        Some((&self.samples[start..end], first_index, paths))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::control::Epoch;

    fn block(samples: usize, first: u64) -> Block {
        let mut block = Block::default();
        block.restart(Epoch(1), first);
        block.header.paths = PathCounts { camera: samples as u64, light: 0 };
        for i in 0..samples {
            assert!(block.push(Sample { uv: [0.0, (first + i as u64) as f32], w: 1.0, ..Sample::default() }));
        }
        block
    }

    fn all(store: &mut RetainedSamples) -> (Vec<f32>, u64) {
        let (mut seen, mut paths) = (Vec::new(), 0);
        while let Some((samples, first_index, counts)) = store.feed() {
            assert!(samples.first().is_none_or(|s| s.uv[1] == first_index as f32));
            seen.extend(samples.iter().map(|s| s.uv[1]));
            paths += counts.camera;
        }
        (seen, paths)
    }

    #[test]
    fn a_new_film_gets_everything_in_order() {
        let mut store = RetainedSamples::with_room(8 * BLOCK_SAMPLES, 100);
        for i in 0..5 {
            assert!(store.push(&block(3, 3 * i)));
        }
        assert!(store.caught_up() && store.feed().is_none());
        store.rewind();
        assert!(store.feed().is_some_and(|(samples, ..)| samples.len() == 3));
        // While the new film is behind, blocks queue up.
        assert!(store.push_for_later(&block(2, 15)));
        let (seen, paths) = all(&mut store);
        assert_eq!(seen, (3..17).map(|i| i as f32).collect::<Vec<_>>());
        assert_eq!(paths, 14);
        assert!(store.push(&block(1, 17)) && store.caught_up());
    }

    #[test]
    fn the_store_is_bounded_and_has_no_gap() {
        let mut store = RetainedSamples::with_room(2 * BLOCK_SAMPLES, 100);
        assert!(store.push(&block(BLOCK_SAMPLES, 0)) && store.push(&block(10, 1024)));
        assert!(store.complete() && !store.has_room() && !store.push(&block(BLOCK_SAMPLES, 1034)));
        // A small one would fit, but not without a gap.
        assert!(!store.push(&block(1, 5000)) && !store.complete());
        store.rewind();
        assert_eq!(all(&mut store).1, 1034);
        store.clear();
        assert!(store.complete() && store.is_empty() && store.caught_up() && store.push(&block(5, 0)));
        // Blocks are bounded too.
        let mut store = RetainedSamples::with_room(1 << 20, 3);
        assert_eq!((0..10).filter(|&i| store.push(&block(1, i))).count(), 3);
    }
}
