//! The points of the sequence within one square of the screen, one after the other.
//!
//! Of every 4^k consecutive points, aligned, exactly one lies in each of the 2^k × 2^k squares of the screen. So square and number
//! of the block determine an index (Grünschloß, Raab and Keller 2012, *Enumerating Quasi-Monte Carlo Point Sequences in
//! Elementary Intervals*). Taken square by square the points of one are those of the whole sequence there: a sequence of low
//! discrepancy in all dimensions, however many are taken in other squares.

use crate::math::bits::interleave;

use super::cells::ScreenCells;

/// The sequence of one seed, square by square.
#[derive(Clone, Debug)]
pub struct ScreenSquares {
    /// Binary logarithm of the number of squares along a side.
    level: u32,
    /// The index below 4^level that lies in each square, in the order of [`interleave`].
    first: Vec<u32>,
    /// For each bit of the block's number the change of the index within the block.
    columns: Vec<u32>,
}

/// Finest division: 256 squares along a side.
pub const MAX_LEVEL: u32 = 8;

impl ScreenSquares {
    /// The sequence of `seed`, as a picture of these cells enumerates the screen by it, in 2^level × 2^level squares, where `level` is at most
    /// [`MAX_LEVEL`].
    pub fn new(level: u32, seed: u32, cells: &ScreenCells) -> Self {
        let level = level.min(MAX_LEVEL);
        let count = 1u64 << (2 * level);
        let leading = |x: u32| x.checked_shr(32 - level).unwrap_or(0);
        let mut first = vec![0; count as usize];
        // The same of the sequence without scrambling, which is linear: the change of a block does not depend on the square.
        let mut plain = first.clone();
        let plain_square = |index: u64| {
            let [x, y, ..] = cells.plain_block(index).map(leading);
            interleave([x, y]) as usize
        };
        for index in 0..count {
            let [x, y, ..] = cells.first_block(index, seed).map(leading);
            first[interleave([x, y]) as usize] = index as u32;
            plain[plain_square(index)] = index as u32;
        }
        let columns = (2 * level..u64::BITS).map(|bit| plain[plain_square(1 << bit)]).collect();
        Self { level, first, columns }
    }

    /// The index of the point of block `block` in this square, in the order of [`interleave`].
    #[inline]
    pub fn index(&self, square: usize, block: u64) -> u64 {
        let mut within = self.first[square];
        let mut bits = block;
        while bits != 0 {
            within ^= self.columns[bits.trailing_zeros() as usize];
            bits &= bits - 1;
        }
        block << (2 * self.level) | u64::from(within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracer::Sampler;

    /// Every square is visited once per block, by a point that lies in it, and no index comes twice.
    #[test]
    fn squares_and_blocks_are_the_whole_sequence() {
        for (level, seed, pixels) in [
            (0, 3, 1.0),
            (1, 3, 64.0),
            (2, 0, 32.0),
            (3, 0xffff_ffff, 512.0),
            (5, 7, 1024.0),
            (8, 1, 512.0),
            (8, 1, 1024.0),
        ] {
            for cells in [false, true].map(|second| {
                let cells = ScreenCells::of_pixels([pixels; 2]);
                if second { cells.beside(5) } else { cells }
            }) {
                let squares = ScreenSquares::new(level, seed, &cells);
                let (side, count) = (f64::from(1 << level), 1usize << (2 * level));
                for block in [0, 1, 2, 7, 1 << 20 | 5, (1 << 44) - 1] {
                    let mut seen = vec![false; count];
                    for square in 0..count {
                        let index = squares.index(square, block);
                        assert_eq!(index >> (2 * level), block);
                        assert!(!std::mem::replace(&mut seen[(index as usize) & (count - 1)], true));
                        let at =
                            Sampler::in_cells(index, seed, &cells).camera().screen.map(|x| (x * side) as u32);
                        assert_eq!(interleave(at) as usize, square, "level {level}, index {index}");
                    }
                }
            }
        }
    }
}
