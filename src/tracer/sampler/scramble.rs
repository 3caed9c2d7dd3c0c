//! Randomisation: Owen scrambling, the shuffled index of padded blocks, and their seeds.

use crate::math::bits::mix;

use super::nx8::{Coordinates, DIMENSIONS, point_reversed};

/// Nested uniform (Owen) scrambling by hashing, on **bit-reversed** words: bit 0 is the most significant digit.
///
/// Whether a bit is flipped depends on the more significant bits only, so elementary intervals are mapped to elementary
/// intervals. `seed` must be well mixed: 0 hardly scrambles at all. The form is that of Laine and Karras, *Stratified
/// Sampling for Stochastic Transparency* (2011), with constants found by N. Vegdahl (2021).
#[inline(always)]
pub fn owen_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// [`owen_reversed`] for words in natural order, with bit 31 as the most significant digit.
pub fn owen(x: u32, seed: u32) -> u32 {
    owen_reversed(x.reverse_bits(), seed).reverse_bits()
}

/// The seeds of one block of dimensions, a function of (seed, block).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockKey {
    /// One scrambling seed per dimension.
    pub dimensions: [u32; DIMENSIONS],
    shuffle: u64,
}

impl BlockKey {
    /// Mixes seed and block number. Different blocks, or different seeds, have unrelated keys.
    #[inline(always)]
    pub fn new(seed: u32, block: u32) -> Self {
        let mut word = mix(u64::from(block) << 32 | u64::from(seed));
        let mut dimensions = [0; DIMENSIONS];
        for pair in dimensions.chunks_exact_mut(2) {
            let z = next(&mut word);
            (pair[0], pair[1]) = (z as u32, (z >> 32) as u32);
        }
        Self { dimensions, shuffle: next(&mut word) }
    }

    /// The shuffled 64-bit index of a padded block. Both the argument and the result are bit-reversed halves `[low, high]`.
    ///
    /// The shuffle is an Owen scramble of the 64-bit word, most significant bit first. It maps aligned ranges of 2^m indices
    /// to aligned ranges, so each padded block is a net for every such range, but is unrelated to the other blocks. The high
    /// half is XORed with a constant so that 0 stays 0: then paths below 2^32 need no look-up for it. This loses
    /// nothing, because the coordinates are scrambled afterwards.
    #[inline(always)]
    pub fn shuffle(&self, [low, high]: [u32; 2]) -> [u32; 2] {
        if high == 0 {
            return [owen_reversed(low, self.shuffle as u32), 0];
        }
        let high_seed = (self.shuffle >> 32) as u32;
        let low_seed = (self.shuffle ^ mix(u64::from(high))) as u32;
        [owen_reversed(low, low_seed), owen_reversed(high, high_seed) ^ owen_reversed(0, high_seed)]
    }
}

/// The next 64 random bits (wyrand, Wang Yi, 2019), by one wide multiplication.
#[inline(always)]
fn next(word: &mut u64) -> u64 {
    *word = word.wrapping_add(0xa076_1d64_78bd_642f);
    let product = u128::from(*word) * u128::from(*word ^ 0xe703_7ed1_a0b4_28db);
    product as u64 ^ (product >> 64) as u64
}

/// Block 0 of path `index`: scrambled, not shuffled.
#[inline(always)]
pub fn first_block(index: [u32; 2], key: &BlockKey) -> Coordinates {
    scramble(point_reversed(index), key)
}

/// A padded block of path `index`: shuffled, then scrambled.
#[inline(always)]
pub fn padded_block(index: [u32; 2], key: &BlockKey) -> Coordinates {
    scramble(point_reversed(key.shuffle(index)), key)
}

/// The coordinates of a point, whose digits are in reversed order, scrambled and in natural order.
#[inline(always)]
pub fn scramble(x: Coordinates, key: &BlockKey) -> Coordinates {
    let mut out = [0; DIMENSIONS];
    for d in 0..DIMENSIONS {
        out[d] = owen_reversed(x[d], key.dimensions[d]);
    }
    for x in &mut out {
        *x = x.reverse_bits();
    }
    out
}
