//! The unit of transfer: samples, with the numbers of paths that normalise them.

use crate::stream::{Epoch, PathCounts, Rejections, Sample};

/// Most samples of a block: 24 KiB, about a millisecond of one worker.
pub const BLOCK_SAMPLES: usize = 1024;

/// The header of a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// The render that the block belongs to.
    pub epoch: Epoch,
    /// Path index of its first sample, or of the first path that it counts.
    pub first_index: u64,
    /// Number of paths that *end* in this block: those of the indices `first_index .. first_index + index_count`. A path
    /// with more samples than a block holds is counted in its last block, so the number may be 0.
    pub index_count: u64,
    /// Numbers of these paths by stream.
    pub paths: PathCounts,
    /// How many samples of these paths were rejected; single contributions that were are not among them.
    pub rejected: u64,
}

/// One worker's samples from a contiguous range of path indices, in order of index.
#[derive(Clone, Debug)]
pub struct Block {
    /// The header.
    pub header: Header,
    /// What was rejected in these paths.
    pub rejections: Rejections,
    len: usize,
    samples: [Sample; BLOCK_SAMPLES],
}

impl Default for Block {
    fn default() -> Self {
        let empty = Sample { uv: [0.0; 2], xyz: crate::color::Xyz::BLACK, w: 0.0 };
        Self {
            header: Header::default(),
            rejections: Rejections::default(),
            len: 0,
            samples: [empty; BLOCK_SAMPLES],
        }
    }
}

impl Block {
    /// The samples.
    #[inline]
    pub fn samples(&self) -> &[Sample] {
        &self.samples[..self.len]
    }

    /// True if it has no samples and counts neither paths nor rejections.
    pub fn is_empty(&self) -> bool {
        self.len == 0 && self.header.index_count == 0 && self.header.rejected == 0
    }

    /// Appends a sample. Returns `false`, and changes nothing, if the block is full.
    #[inline]
    pub fn push(&mut self, sample: Sample) -> bool {
        let Some(slot) = self.samples.get_mut(self.len) else {
            return false;
        };
        *slot = sample;
        self.len += 1;
        true
    }

    /// Removes all samples after the first `len`.
    pub fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
    }

    /// Clears the block, which then begins with path `first_index` of `epoch`.
    pub fn restart(&mut self, epoch: Epoch, first_index: u64) {
        self.header = Header { epoch, first_index, ..Header::default() };
        self.rejections = Rejections::default();
        self.len = 0;
    }
}
