//! The samples of the present epoch, kept on the host: a film of another size, filter or device is filled from them.
//!
//! Samples know no resolution (paper §3.1), so a resized window needs no new ones. The store is bounded: later samples go to
//! the film alone, and a film that is made anew begins with the first ones. All memory is taken at the start, which keeps
//! the process from growing while it runs.

use crate::stream::block::{BLOCK_SAMPLES, Block};
use crate::stream::{PathCounts, Sample};

/// Samples kept: 64 MiB, 10 per pixel of a 512×512 window.
pub const KEPT_SAMPLES: usize = (64 << 20) / size_of::<Sample>();

/// Blocks kept. Blocks are sent at a certain age even when they are not full.
const KEPT_BLOCKS: usize = 4 * KEPT_SAMPLES / BLOCK_SAMPLES;

/// Samples in order of arrival, and how far the present film has got with them.
#[derive(Debug)]
pub struct Kept {
    samples: Vec<Sample>,
    /// End of every block in `samples`, its first index, and the paths that it counts.
    blocks: Vec<(usize, u64, PathCounts)>,
    /// A block did not fit: the store is the beginning of the epoch only.
    full: bool,
    /// Most samples and blocks.
    limits: (usize, usize),
    /// Blocks that the present film has.
    fed: usize,
}

impl Default for Kept {
    fn default() -> Self {
        Self::with_room(KEPT_SAMPLES, KEPT_BLOCKS)
    }
}

impl Kept {
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

    /// True while a block surely fits.
    pub fn has_room(&self) -> bool {
        !self.full && self.samples.len() + BLOCK_SAMPLES <= self.limits.0 && self.blocks.len() < self.limits.1
    }

    /// Keeps a block if it fits; `false` means that it was not kept, and nothing later will be.
    ///
    /// The block counts as one that the film has if the film had all before it.
    pub fn push(&mut self, block: &Block) -> bool {
        if !self.has_room() {
            self.full = true;
            return false;
        }
        let caught_up = self.caught_up();
        self.samples.extend_from_slice(block.samples());
        self.blocks.push((self.samples.len(), block.header.first_index, block.header.paths));
        self.fed += usize::from(caught_up);
        true
    }

    /// As [`push`](Self::push), for a film that is behind and shall get the block in its turn.
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

    /// True when the film has every block that is kept.
    pub fn caught_up(&self) -> bool {
        self.fed == self.blocks.len()
    }

    /// True when every block of the epoch was kept.
    pub fn complete(&self) -> bool {
        !self.full
    }

    /// Samples kept.
    pub fn len(&self) -> usize {
        self.samples.len()
    }

    /// True without samples.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// The next block that the film lacks: samples, first index and paths. It counts as one that the film has from now on.
    pub fn feed(&mut self) -> Option<(&[Sample], u64, PathCounts)> {
        let &(end, first_index, paths) = self.blocks.get(self.fed)?;
        let start = self.fed.checked_sub(1).map_or(0, |before| self.blocks[before].0);
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

    fn all(kept: &mut Kept) -> (Vec<f32>, u64) {
        let (mut seen, mut paths) = (Vec::new(), 0);
        while let Some((samples, first_index, counts)) = kept.feed() {
            assert!(samples.first().is_none_or(|s| s.uv[1] == first_index as f32));
            seen.extend(samples.iter().map(|s| s.uv[1]));
            paths += counts.camera;
        }
        (seen, paths)
    }

    #[test]
    fn a_new_film_gets_everything_in_order() {
        let mut kept = Kept::with_room(8 * BLOCK_SAMPLES, 100);
        for i in 0..5 {
            assert!(kept.push(&block(3, 3 * i)));
        }
        assert!(kept.caught_up() && kept.feed().is_none());
        kept.rewind();
        assert!(kept.feed().is_some_and(|(samples, ..)| samples.len() == 3));
        // While the new film is behind, blocks queue up.
        assert!(kept.push_for_later(&block(2, 15)));
        let (seen, paths) = all(&mut kept);
        assert_eq!(seen, (3..17).map(|i| i as f32).collect::<Vec<_>>());
        assert_eq!(paths, 14);
        assert!(kept.push(&block(1, 17)) && kept.caught_up());
    }

    #[test]
    fn room_is_bounded_and_what_is_kept_has_no_gap() {
        let mut kept = Kept::with_room(2 * BLOCK_SAMPLES, 100);
        assert!(kept.push(&block(BLOCK_SAMPLES, 0)) && kept.push(&block(10, 1024)));
        assert!(kept.complete() && !kept.has_room() && !kept.push(&block(BLOCK_SAMPLES, 1034)));
        // A small one would fit, but not without a gap.
        assert!(!kept.push(&block(1, 5000)) && !kept.complete());
        kept.rewind();
        assert_eq!(all(&mut kept).1, 1034);
        kept.clear();
        assert!(kept.complete() && kept.is_empty() && kept.caught_up() && kept.push(&block(5, 0)));
        // Blocks are bounded too.
        let mut kept = Kept::with_room(1 << 20, 3);
        assert_eq!((0..10).filter(|&i| kept.push(&block(1, i))).count(), 3);
    }
}
