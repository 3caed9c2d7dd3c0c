//! Rows of several channels, pixels that are computed together, and the neighbours of a pixel.
//!
//! Rows are `[height][channel][width]`, so that a row of all channels is one piece of memory, with a border of zeros that counts for nothing.

use rayon::prelude::*;

use super::LEVELS;

/// Pixels around the picture that are read and count for nothing.
pub(super) const BORDER: usize = 1 << (LEVELS - 1);

/// Pixels that are computed together.
pub(super) const LANES: usize = 8;

/// Channels of the two halves: sums X, Y, Z and counts, and again.
pub(super) const SUMS: usize = 8;
/// Channels of features with their tolerances: albedo, normal, distance, three tolerances, share of lights.
pub(super) const FEATURES: usize = 11;
/// Weights to the neighbours to the right, below right, below, below left; those to the others are theirs.
pub(super) const WEIGHTS: usize = 4;
/// Channels of the result: X, Y, Z, and the gain of the last band.
pub(super) const RESULT: usize = 4;
/// Channels of a band: the mean of both halves, the product of their luminances, the noise.
pub(super) const BAND: usize = 5;

pub(super) type PixelBlock = [f32; LANES];

#[inline(always)]
pub(super) fn each(f: impl Fn(usize) -> f32) -> PixelBlock {
    std::array::from_fn(f)
}

/// Rows of several channels with a border.
pub(super) struct PlanarRows {
    channels: usize,
    /// Numbers in a row of one channel, with the border.
    pub(super) stride: usize,
    data: Vec<f32>,
}

impl PlanarRows {
    /// Zeros; `None` without memory.
    pub(super) fn new(width: usize, height: usize, channels: usize) -> Option<Self> {
        let stride = 2 * BORDER + width.next_multiple_of(LANES);
        let mut data = Vec::new();
        data.try_reserve_exact(stride * channels * (height + 2 * BORDER)).ok()?;
        data.resize(stride * channels * (height + 2 * BORDER), 0.0);
        Some(Self { channels, stride, data })
    }

    /// All channels of row `y`, counted from the top of the border.
    #[inline(always)]
    pub(super) fn row(&self, y: usize) -> &[f32] {
        let length = self.channels * self.stride;
        &self.data[y * length..][..length]
    }

    /// The rows of the picture, without the border.
    pub(super) fn inner(&mut self) -> impl IndexedParallelIterator<Item = &mut [f32]> {
        let length = self.channels * self.stride;
        let border = BORDER * length;
        let end = self.data.len() - border;
        self.data[border..end].par_chunks_mut(length)
    }
}

/// Eight numbers of a channel of a row.
#[inline(always)]
pub(super) fn load(row: &[f32], stride: usize, channel: usize, x: usize) -> PixelBlock {
    let at = channel * stride + x;
    row[at..at + LANES].try_into().unwrap_or_default()
}

#[inline(always)]
pub(super) fn store(row: &mut [f32], stride: usize, channel: usize, x: usize, values: PixelBlock) {
    row[channel * stride + x..][..LANES].copy_from_slice(&values);
}

/// The neighbours: offset in steps, and where the weight to them stands: the channel, and whether it is their own weight to here.
pub(super) const NEIGHBOURS: [FilterTap; 8] = [
    FilterTap { dx: 1, dy: 0, weight: 0, theirs: false },
    FilterTap { dx: 1, dy: 1, weight: 1, theirs: false },
    FilterTap { dx: 0, dy: 1, weight: 2, theirs: false },
    FilterTap { dx: -1, dy: 1, weight: 3, theirs: false },
    FilterTap { dx: -1, dy: 0, weight: 0, theirs: true },
    FilterTap { dx: -1, dy: -1, weight: 1, theirs: true },
    FilterTap { dx: 0, dy: -1, weight: 2, theirs: true },
    FilterTap { dx: 1, dy: -1, weight: 3, theirs: true },
];

/// A neighbour.
pub(super) struct FilterTap {
    pub(super) dx: isize,
    pub(super) dy: isize,
    /// The channel of the weight.
    pub(super) weight: usize,
    /// The weight stands at the neighbour.
    theirs: bool,
}

impl FilterTap {
    /// Binomial coefficient over that of the corner; the centre has 4.
    #[inline(always)]
    fn tap(&self) -> f32 {
        if self.dx == 0 || self.dy == 0 { 2.0 } else { 1.0 }
    }

    /// The row of this neighbour of row `y`, and its first column for column `x`.
    #[inline(always)]
    pub(super) fn place(&self, y: usize, x: usize, step: usize) -> (usize, usize) {
        let step = step as isize;
        (y.wrapping_add_signed(self.dy * step), x.wrapping_add_signed(self.dx * step))
    }
}

/// A neighbour as it is seen from one row.
pub(super) struct RowTap<'a> {
    /// Its row.
    there: &'a [f32],
    /// The row and channel of the weight to it.
    weights: &'a [f32],
    /// Pixels from here to it, and to the place of the weight.
    dx: isize,
    weight_dx: isize,
    /// Its binomial coefficient.
    pub(super) tap: f32,
}

impl<'a> RowTap<'a> {
    /// All neighbours of the pixels of row `y`, `step` pixels apart.
    #[inline(always)]
    pub(super) fn of_row(from: &'a PlanarRows, weights: &'a PlanarRows, y: usize, step: usize) -> [Self; 8] {
        NEIGHBOURS.each_ref().map(|neighbour| {
            let (row, dx) = (neighbour.place(y, 0, step).0, neighbour.dx * step as isize);
            let (weight_row, weight_dx) = if neighbour.theirs { (row, dx) } else { (y, 0) };
            let channel = neighbour.weight * weights.stride;
            let weights = &weights.row(weight_row)[channel..][..weights.stride];
            RowTap { there: from.row(row), weights, dx, weight_dx, tap: neighbour.tap() }
        })
    }

    /// The weights to the neighbours of pixels `x ..`.
    #[inline(always)]
    pub(super) fn weight(&self, x: usize) -> PixelBlock {
        load(self.weights, 0, 0, x.wrapping_add_signed(self.weight_dx))
    }

    /// A channel of the neighbours of pixels `x ..`.
    #[inline(always)]
    pub(super) fn value(&self, stride: usize, channel: usize, x: usize) -> PixelBlock {
        load(self.there, stride, channel, x.wrapping_add_signed(self.dx))
    }
}
