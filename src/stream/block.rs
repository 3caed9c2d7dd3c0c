//! The unit of transfer: samples together with the paths that made them.

use crate::stream::{Epoch, PathCounts, Rejections, Sample};

/// Samples a block can hold; 24 KiB, about a millisecond of one worker.
pub const BLOCK_SAMPLES: usize = 1024;

/// What a block says about its samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// The render it belongs to.
    pub epoch: Epoch,
    /// Path index of its first sample, or of the first path it counts.
    pub first_index: u64,
    /// Paths that *end* in this block: `first_index .. first_index + index_count`, contiguous. A path too long for
    /// one block is counted by the last one it needs, so the count may be 0.
    pub index_count: u64,
    /// Paths started for each stream, counted where they end.
    pub paths: PathCounts,
    /// Samples that were kept out.
    pub rejections: Rejections,
}

/// One worker's samples of a contiguous range of indices, in order of index.
#[derive(Clone, Debug)]
pub struct Block {
    /// What it says about itself.
    pub header: Header,
    len: usize,
    samples: [Sample; BLOCK_SAMPLES],
}

impl Default for Block {
    fn default() -> Self {
        let empty = Sample { uv: [0.0; 2], xyz: crate::color::Xyz::BLACK, w: 0.0 };
        Self { header: Header::default(), len: 0, samples: [empty; BLOCK_SAMPLES] }
    }
}

impl Block {
    /// The samples.
    #[inline]
    pub fn samples(&self) -> &[Sample] {
        &self.samples[..self.len]
    }

    /// True when neither samples nor paths nor rejections are in it.
    pub fn is_empty(&self) -> bool {
        self.len == 0 && self.header.index_count == 0 && self.header.rejections.total() == 0
    }

    /// Appends a sample; `false` means the block is full and was left as it is.
    #[inline]
    pub fn push(&mut self, sample: Sample) -> bool {
        let Some(slot) = self.samples.get_mut(self.len) else {
            return false;
        };
        *slot = sample;
        self.len += 1;
        true
    }

    /// Drops all samples after the first `len`.
    pub fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
    }

    /// Makes it an empty block of `epoch` that begins at path `first_index`.
    pub fn restart(&mut self, epoch: Epoch, first_index: u64) {
        self.header = Header { epoch, first_index, ..Header::default() };
        self.len = 0;
    }
}
