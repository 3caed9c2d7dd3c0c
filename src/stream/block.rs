//! The unit of transfer: samples, with the numbers of paths that normalise them.

use crate::stream::{Epoch, PathCounts, Rejections, Sample, eye, replicate};

/// Most samples of a block: 24 KiB, about a millisecond of one worker.
pub const BLOCK_SAMPLES: usize = 1024;

/// Most groups of lights of a render.
pub const MOST_GROUPS: usize = 8;

/// The eyes of a render, which its blocks carry samples of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BlockEyes {
    /// One: all samples of the picture are its.
    #[default]
    One,
    /// Two, whose chunks take turns ([`eye`]): samples of the picture are those of the eye whose chunk it is, those of the first group are of
    /// the other.
    Both {
        /// Whether indices alternate between replicates.
        replicated: bool,
    },
    /// Two, whose chunks take turns, in a render with groups of lights: all samples, those of groups too, are of the eye whose chunk it is.
    Apart {
        /// Whether indices alternate between replicates.
        replicated: bool,
    },
}

impl BlockEyes {
    /// The samples of the left and of the right eye in a block of such a render; a single eye is the left one.
    pub fn split(self, block: &Block) -> [&[Sample]; 2] {
        let other = match self {
            Self::Both { .. } => block.groups().next().unwrap_or_default(),
            Self::One | Self::Apart { .. } => &[],
        };
        let own = block.samples();
        if self.of_index(block.header.first_index) == 0 { [own, other] } else { [other, own] }
    }

    /// The eye whose chunk has this index: 0 for the left one, or a single one.
    pub fn of_index(self, index: u64) -> usize {
        match self {
            Self::One => 0,
            Self::Both { replicated: true } | Self::Apart { replicated: true } => eye(replicate(index).1).0,
            Self::Both { replicated: false } | Self::Apart { replicated: false } => eye(index).0,
        }
    }
}

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

/// One worker's samples from a contiguous range of path indices, in order of index: those of the picture, and behind them those of each
/// group of lights, where a render has groups.
#[derive(Clone, Debug)]
pub struct Block {
    /// The header.
    pub header: Header,
    /// Values of these paths that were rejected.
    pub rejections: Rejections,
    /// Number of samples of the picture.
    len: usize,
    /// Number of samples that the picture may have: the rest of the block is reserved for those of groups.
    room: usize,
    /// Number of groups, and the ends of their samples.
    groups: usize,
    group_ends: [usize; MOST_GROUPS],
    samples: [Sample; BLOCK_SAMPLES],
}

impl Default for Block {
    fn default() -> Self {
        let empty = Sample { uv: [0.0; 2], xyz: crate::color::Xyz::BLACK, w: 0.0 };
        Self {
            header: Header::default(),
            rejections: Rejections::default(),
            len: 0,
            room: BLOCK_SAMPLES,
            groups: 0,
            group_ends: [0; MOST_GROUPS],
            samples: [empty; BLOCK_SAMPLES],
        }
    }
}

impl Block {
    /// The samples of the picture.
    #[inline]
    pub fn samples(&self) -> &[Sample] {
        &self.samples[..self.len]
    }

    /// The samples of each group of lights; none in a render without groups.
    pub fn groups(&self) -> impl Iterator<Item = &[Sample]> {
        let starts = std::iter::once(self.len).chain(self.group_ends);
        starts.zip(&self.group_ends[..self.groups]).map(|(start, end)| &self.samples[start..*end])
    }

    /// Number of samples of the picture and of all groups.
    #[inline]
    pub fn sample_count(&self) -> usize {
        if self.groups == 0 { self.len } else { self.group_ends[self.groups - 1] }
    }

    /// True if it has no samples and counts neither paths nor rejections.
    pub fn is_empty(&self) -> bool {
        self.len == 0 && self.header.index_count == 0 && self.header.rejected == 0
    }

    /// Appends a sample of the picture. Returns `false`, and changes nothing, if the block is full.
    #[inline]
    pub fn push(&mut self, sample: Sample) -> bool {
        let Some(slot) = self.samples.get_mut(..self.room).and_then(|room| room.get_mut(self.len)) else {
            return false;
        };
        *slot = sample;
        self.len += 1;
        true
    }

    /// Keeps room for this number of samples of groups, at most [`BLOCK_SAMPLES`], and returns how many samples of the picture then fit in
    /// addition.
    #[inline]
    pub(super) fn reserve(&mut self, samples: usize) -> usize {
        self.room = BLOCK_SAMPLES.saturating_sub(samples);
        self.room.saturating_sub(self.len)
    }

    /// Puts the samples of `count` groups, for which room was [reserved](Self::reserve), behind those of the picture, group by group and
    /// each in the order of `parts`.
    pub(super) fn append_groups(&mut self, count: usize, parts: &[(u8, Sample)]) {
        let mut ends = [self.len; MOST_GROUPS];
        for group in 0..count {
            let before = if group == 0 { self.len } else { ends[group - 1] };
            let of_group = parts.iter().filter(|(of, _)| usize::from(*of) == group).map(|(_, sample)| sample);
            let slots = self.samples[before..].iter_mut();
            ends[group] = before + slots.zip(of_group).map(|(slot, sample)| *slot = *sample).count();
        }
        (self.groups, self.group_ends) = (count, ends);
    }

    /// Removes all samples of the picture after the first `len`.
    pub fn truncate(&mut self, len: usize) {
        self.len = self.len.min(len);
    }

    /// Clears the block, which then begins with path `first_index` of `epoch`.
    pub fn restart(&mut self, epoch: Epoch, first_index: u64) {
        self.header = Header { epoch, first_index, ..Header::default() };
        self.rejections = Rejections::default();
        (self.len, self.room, self.groups) = (0, BLOCK_SAMPLES, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stream::CHUNK;

    #[test]
    fn chunks_of_a_block_take_turns_between_the_eyes() {
        let sample = |x: f32| Sample { uv: [x, 0.0], ..Sample::default() };
        let places = |samples: &[Sample]| samples.iter().map(|sample| sample.uv[0]).collect::<Vec<_>>();
        let mut block = Block::default();
        for (chunk, replicated, is_of_right) in
            [(0, false, false), (1, false, true), (2, false, false), (1, true, false), (2, true, true)]
        {
            block.restart(Epoch(1), chunk * CHUNK);
            assert!(block.push(sample(1.0)) && block.push(sample(2.0)));
            block.append_groups(1, &[(0, sample(3.0))]);
            let [left, right] = BlockEyes::Both { replicated }.split(&block).map(places);
            let [own, other] = if is_of_right { [right, left] } else { [left, right] };
            assert_eq!((own, other), (vec![1.0, 2.0], vec![3.0]), "chunk {chunk}, {replicated}");
            assert_eq!(BlockEyes::One.split(&block).map(places), [vec![1.0, 2.0], vec![]]);
            // With groups of lights those of the first group are no samples of the other eye.
            let [left, right] = BlockEyes::Apart { replicated }.split(&block).map(places);
            let [own, other] = if is_of_right { [right, left] } else { [left, right] };
            assert_eq!((own, other), (vec![1.0, 2.0], vec![]), "chunk {chunk}, {replicated}");
        }
    }
}
