//! Rejected samples, counted by cause, with examples that can be traced again.

/// Why a sample was rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Cause {
    /// u or v is NaN or infinite.
    PositionNotFinite,
    /// The position lies outside the window that samples must cover.
    OutsideWindow,
    /// X, Y or Z, or its product with the weight, is NaN or infinite.
    ColorNotFinite,
    /// The weight of a camera sample is NaN or infinite.
    WeightNotFinite,
    /// The weight of a camera sample is zero or negative, which would mean the light stream.
    WeightNotPositive,
    /// X, Y or Z, times the weight, or the weight itself exceeds [`MAX_VALUE`](crate::stream::MAX_VALUE), so that sums might
    /// overflow.
    ColorTooLarge,
}

impl Cause {
    /// All causes, in the order of their discriminants.
    pub const ALL: [Cause; 6] = [
        Cause::PositionNotFinite,
        Cause::OutsideWindow,
        Cause::ColorNotFinite,
        Cause::WeightNotFinite,
        Cause::WeightNotPositive,
        Cause::ColorTooLarge,
    ];

    /// A short description for reports.
    pub fn describe(self) -> &'static str {
        match self {
            Cause::PositionNotFinite => "position not finite",
            Cause::OutsideWindow => "position outside the window",
            Cause::ColorNotFinite => "color not finite",
            Cause::WeightNotFinite => "weight not finite",
            Cause::WeightNotPositive => "weight not positive",
            Cause::ColorTooLarge => "color too large",
        }
    }
}

/// Most examples that are kept.
pub const EXAMPLES: usize = 8;

/// Counts of rejected samples by cause, and the first few of them by path index, so that their paths can be traced again
/// with `--seed` and the index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rejections {
    counts: [u64; Cause::ALL.len()],
    /// Ascending. The first `len` are valid.
    examples: [(u64, Cause); EXAMPLES],
    len: u8,
}

impl Default for Rejections {
    fn default() -> Self {
        Self { counts: [0; Cause::ALL.len()], examples: [(0, Cause::PositionNotFinite); EXAMPLES], len: 0 }
    }
}

impl Rejections {
    /// Counts one sample of path `index`.
    #[cold]
    pub fn add(&mut self, index: u64, cause: Cause) {
        self.counts[cause as usize] += 1;
        self.keep((index, cause));
    }

    /// Adds the counts of `other` and keeps the smallest indices of both. The result does not depend on the order of merging,
    /// and so not on threads.
    pub fn merge(&mut self, other: &Rejections) {
        if other.total() == 0 {
            return;
        }
        for (sum, count) in self.counts.iter_mut().zip(other.counts) {
            *sum = sum.saturating_add(count);
        }
        other.examples().iter().for_each(|&example| self.keep(example));
    }

    /// Number of samples rejected for one cause.
    pub fn count(&self, cause: Cause) -> u64 {
        self.counts[cause as usize]
    }

    /// Number of samples rejected for all causes.
    pub fn total(&self) -> u64 {
        self.counts.iter().fold(0, |sum, count| sum.saturating_add(*count))
    }

    /// The samples with the smallest path indices, ascending, at most [`EXAMPLES`].
    pub fn examples(&self) -> &[(u64, Cause)] {
        &self.examples[..usize::from(self.len)]
    }

    fn keep(&mut self, example: (u64, Cause)) {
        let len = usize::from(self.len);
        let at = self.examples[..len].partition_point(|kept| *kept < example);
        if at == EXAMPLES || self.examples[..len].get(at) == Some(&example) {
            return;
        }
        let last = len.min(EXAMPLES - 1);
        self.examples.copy_within(at..last, at + 1);
        self.examples[at] = example;
        self.len = (last + 1) as u8;
    }
}
