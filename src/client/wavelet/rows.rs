//! Rows of several channels, and the neighbours of their pixels.
//!
//! Rows are `[height][channel][width]`, so that a row of all channels is one piece of memory, with a border that counts for nothing: zeros,
//! except that no pixel of the picture has the same share of lights.

use std::ops::{Deref, DerefMut, Range};

use rayon::prelude::*;

use super::LEVELS;

/// Pixels around the picture that are read and count for nothing.
pub(super) const BORDER: usize = 1 << (LEVELS - 1);

/// Floats in a line of the cache; the row of a channel is padded to a multiple of these.
const FLOATS_PER_LINE: usize = 16;

/// Channels of the two halves: sums X, Y, Z and counts, and again.
pub(super) const SUMS: usize = 8;
/// Channels of features with their tolerances: albedo, normal, distance, three tolerances, share of lights.
pub(super) const FEATURES: usize = 11;
/// Those of tolerances, and that of the share of lights.
pub(super) const TOLERANCES: Range<usize> = 7..10;
pub(super) const LIGHTS: usize = 10;
/// Weights to the neighbours to the right, below, below right, below left; those to the others are theirs.
pub(super) const WEIGHTS: usize = 4;
/// Channels of the result: X, Y, Z.
pub(super) const RESULT: usize = 3;
/// The first channel of each half, and the one of its counts after that.
pub(super) const HALVES: [usize; 2] = [0, 4];
pub(super) const COUNT: usize = 3;
/// Channels of a band: the mean of both halves, the product of their luminances, the noise.
pub(super) const BAND: usize = 5;
/// The channel of the product in a band; the noise follows.
pub(super) const SIGNAL: usize = 3;
/// Channels of what is averaged over the pixels around: the product, the noise, and one over the sum of the weights.
pub(super) const MEANS: usize = 3;
/// Channels of the means over those, and the gain.
pub(super) const SHRUNK: usize = 3;
/// Channels of a row of divisors: one over the sums of weights, and over the counts of both halves before and after.
pub(super) const INVERSES: usize = 5;

/// Floats, zeros at first, from the beginning of a line of the cache on: aligned loads of eight do not straddle two lines.
pub(super) struct AlignedFloats {
    lines: Vec<FloatLine>,
}

#[repr(C, align(64))]
#[derive(Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct FloatLine([f32; FLOATS_PER_LINE]);

impl AlignedFloats {
    /// At least so many; `None` without memory.
    pub(super) fn new(count: usize) -> Option<Self> {
        let (mut lines, count) = (Vec::new(), count.div_ceil(FLOATS_PER_LINE));
        lines.try_reserve_exact(count).ok()?;
        lines.resize(count, FloatLine::default());
        Some(Self { lines })
    }
}

impl Deref for AlignedFloats {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        bytemuck::cast_slice(&self.lines)
    }
}

impl DerefMut for AlignedFloats {
    fn deref_mut(&mut self) -> &mut [f32] {
        bytemuck::cast_slice_mut(&mut self.lines)
    }
}

/// Rows of several channels with a border.
pub(super) struct PlanarRows {
    channels: usize,
    /// Numbers in a row of one channel, with the border.
    pub(super) stride: usize,
    /// Numbers from row to row: an odd number of cache lines, so that rows which are a power of 2 apart do not compete for the same places of the
    /// cache.
    length: usize,
    data: AlignedFloats,
}

impl PlanarRows {
    /// Zeros; `None` without memory.
    pub(super) fn new(width: usize, height: usize, channels: usize) -> Option<Self> {
        let stride = 2 * BORDER + width.next_multiple_of(FLOATS_PER_LINE);
        let length = ((channels * stride).div_ceil(FLOATS_PER_LINE) | 1) * FLOATS_PER_LINE;
        let data = AlignedFloats::new(length.checked_mul(height + 2 * BORDER)?)?;
        Some(Self { channels, stride, length, data })
    }

    /// All channels of row `y`, counted from the top of the border.
    #[inline(always)]
    pub(super) fn row(&self, y: usize) -> &[f32] {
        &self.data[y * self.length..][..self.channels * self.stride]
    }

    /// Gives a channel one value, in the border too.
    pub(super) fn fill(&mut self, channel: usize, value: f32) {
        for row in self.data.chunks_exact_mut(self.length) {
            row[channel * self.stride..][..self.stride].fill(value);
        }
    }

    /// The rows of the picture, without the border above and below.
    pub(super) fn inner(&mut self) -> impl Iterator<Item = &mut [f32]> {
        let (border, end) = (BORDER * self.length, self.data.len() - BORDER * self.length);
        let channels = self.channels * self.stride;
        self.data[border..end].chunks_exact_mut(self.length).map(move |row| &mut row[..channels])
    }

    /// The same for several threads.
    pub(super) fn inner_parallel(&mut self) -> impl IndexedParallelIterator<Item = &mut [f32]> {
        let (border, end) = (BORDER * self.length, self.data.len() - BORDER * self.length);
        let channels = self.channels * self.stride;
        self.data[border..end].par_chunks_exact_mut(self.length).map(move |row| &mut row[..channels])
    }
}

/// A channel of a row from the first pixel of the picture on, or from so many pixels beside it.
#[inline(always)]
pub(super) fn channel(row: &[f32], stride: usize, channel: usize, dx: isize) -> &[f32] {
    &row[(channel * stride + BORDER).wrapping_add_signed(dx)..]
}

/// All channels of a row, each from the first pixel of the picture on.
#[inline(always)]
pub(super) fn channels_mut<const N: usize>(row: &mut [f32]) -> [&mut [f32]; N] {
    let stride = row.len() / N;
    let mut channels: [&mut [f32]; N] = std::array::from_fn(|_| Default::default());
    for (channel, row) in channels.iter_mut().zip(row.chunks_exact_mut(stride)) {
        *channel = &mut row[BORDER..];
    }
    channels
}

/// The neighbours: those beside a pixel, then those at its corners.
pub(super) const NEIGHBOURS: [FilterTap; 8] = [
    FilterTap { dx: 1, dy: 0, weight: 0, theirs: false },
    FilterTap { dx: 0, dy: 1, weight: 1, theirs: false },
    FilterTap { dx: -1, dy: 0, weight: 0, theirs: true },
    FilterTap { dx: 0, dy: -1, weight: 1, theirs: true },
    FilterTap { dx: 1, dy: 1, weight: 2, theirs: false },
    FilterTap { dx: -1, dy: 1, weight: 3, theirs: false },
    FilterTap { dx: -1, dy: -1, weight: 2, theirs: true },
    FilterTap { dx: 1, dy: -1, weight: 3, theirs: true },
];

/// A neighbour: offset in steps.
pub(super) struct FilterTap {
    pub(super) dx: isize,
    pub(super) dy: isize,
    /// The channel of the weight.
    pub(super) weight: usize,
    /// The weight stands at the neighbour.
    pub(super) theirs: bool,
}

/// The neighbours of the pixels of one row, in the order of [`NEIGHBOURS`].
pub(super) struct RowNeighbours<'a> {
    /// The row of each.
    rows: [&'a [f32]; 8],
    /// Pixels to each.
    dx: [isize; 8],
    /// The weights to each.
    pub(super) weights: [&'a [f32]; 8],
}

impl<'a> RowNeighbours<'a> {
    /// Those of row `y`, counted from the top of the border: `rows` are the row `step` above, itself, and the row `step` below.
    #[inline(always)]
    pub(super) fn new(rows: [&'a [f32]; 3], weights: &'a PlanarRows, y: usize, step: usize) -> Self {
        let mut all = Self { rows: [&[]; 8], dx: [0; 8], weights: [&[]; 8] };
        for (i, neighbour) in NEIGHBOURS.iter().enumerate() {
            let [dx, dy] = [neighbour.dx, neighbour.dy].map(|by| by * step as isize);
            let (weight_y, weight_dx) =
                if neighbour.theirs { (y.wrapping_add_signed(dy), dx) } else { (y, 0) };
            all.rows[i] = rows[neighbour.dy.wrapping_add(1) as usize];
            all.dx[i] = dx;
            all.weights[i] = channel(weights.row(weight_y), weights.stride, neighbour.weight, weight_dx);
        }
        all
    }

    /// A channel of each.
    #[inline(always)]
    pub(super) fn values(&self, stride: usize, of: usize) -> [&'a [f32]; 8] {
        let mut values: [&[f32]; 8] = [&[]; 8];
        for (value, (row, dx)) in values.iter_mut().zip(self.rows.iter().zip(self.dx)) {
            *value = channel(row, stride, of, dx);
        }
        values
    }
}
