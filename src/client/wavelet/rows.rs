//! Rows of several channels, and the neighbours of their pixels.
//!
//! Rows are `[height][channel][width]`, so that all channels of a row are contiguous, with a border that has no influence: zeros, and a
//! share of lights that no pixel of the picture has.

use std::ops::{Deref, DerefMut, Range};

use rayon::prelude::*;

/// Levels of the transform; level l has steps of 2^l pixels.
pub const LEVELS: u32 = 5;

/// Pixels of border around the picture, which are read and have no influence.
pub(super) const BORDER: usize = 1 << (LEVELS - 1);

/// Floats per cache line; the row of a channel is padded to a multiple.
const FLOATS_PER_LINE: usize = 16;

/// Channels of the sums: X, Y, Z and count of each half.
pub(super) const SUMS: usize = 8;
/// Channels of features with their tolerances: albedo, normal, distance, three tolerances, share of lights.
pub(super) const FEATURES: usize = 11;
/// Channels of the tolerances, and channel of the share of lights.
pub(super) const TOLERANCES: Range<usize> = 7..10;
pub(super) const LIGHTS: usize = 10;
/// Weights to the neighbours right, below, below right and below left; weights to the other four are stored at those neighbours.
pub(super) const WEIGHTS: usize = 4;
/// Channels of the result: X, Y, Z.
pub(super) const RESULT: usize = 3;
/// First channel of each half; its counts are in the fourth.
pub(super) const HALVES: [usize; 2] = [0, 4];
pub(super) const COUNT: usize = 3;
/// Channels of a band: the mean of both halves, the product of their luminances, the noise.
pub(super) const BAND: usize = 5;
/// The channel of the product in a band; the noise follows.
pub(super) const SIGNAL: usize = 3;
/// Channels of the local means: product, noise, and the reciprocal of the sum of weights.
pub(super) const MEANS: usize = 3;
/// Channels of the means over those means, and the gain.
pub(super) const SHRUNK: usize = 3;
/// Channels of reciprocals: of the sums of weights, and of the counts of both halves before and after smoothing.
pub(super) const INVERSES: usize = 5;

/// Zero-initialised floats, aligned to a cache line, so that vector loads do not straddle two lines.
pub(super) struct AlignedFloats {
    lines: Vec<FloatLine>,
}

#[repr(C, align(64))]
#[derive(Clone, Copy, Default, bytemuck::Pod, bytemuck::Zeroable)]
struct FloatLine([f32; FLOATS_PER_LINE]);

impl AlignedFloats {
    /// At least `count` floats; `None` if memory runs out.
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
    /// Floats in a row of one channel, including the border.
    pub(super) stride: usize,
    /// Floats between rows: an odd number of cache lines, so that rows a power of two apart do not map to the same cache sets.
    length: usize,
    data: AlignedFloats,
}

impl PlanarRows {
    /// Zeros; `None` if memory runs out.
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

    /// Fills a channel with one value, including the border.
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

    /// As [`inner`](Self::inner), for several threads.
    pub(super) fn inner_parallel(&mut self) -> impl IndexedParallelIterator<Item = &mut [f32]> {
        let (border, end) = (BORDER * self.length, self.data.len() - BORDER * self.length);
        let channels = self.channels * self.stride;
        self.data[border..end].par_chunks_exact_mut(self.length).map(move |row| &mut row[..channels])
    }
}

/// A channel of a row from the first pixel of the picture on, shifted by `dx` pixels.
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

/// Offsets of the eight neighbours: edge neighbours, then corner neighbours.
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

/// A neighbour: its offset in steps, and its weight.
pub(super) struct FilterTap {
    pub(super) dx: isize,
    pub(super) dy: isize,
    /// Channel of the weight.
    pub(super) weight: usize,
    /// Whether the weight is stored at the neighbour.
    pub(super) theirs: bool,
}

/// The neighbours of the pixels of one row, in the order of [`NEIGHBOURS`].
pub(super) struct RowNeighbours<'a> {
    /// Row of each neighbour.
    rows: [&'a [f32]; 8],
    /// Column offset of each neighbour, pixels.
    dx: [isize; 8],
    /// Weights to each neighbour.
    pub(super) weights: [&'a [f32]; 8],
}

impl<'a> RowNeighbours<'a> {
    /// Neighbours of row `y`, counted from the top of the border. `rows`: the row `step` above, the row itself, and the row `step` below.
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

    /// A channel of each neighbour.
    #[inline(always)]
    pub(super) fn values(&self, stride: usize, of: usize) -> [&'a [f32]; 8] {
        let mut values: [&[f32]; 8] = [&[]; 8];
        for (value, (row, dx)) in values.iter_mut().zip(self.rows.iter().zip(self.dx)) {
            *value = channel(row, stride, of, dx);
        }
        values
    }
}
