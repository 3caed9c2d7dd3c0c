//! Evaluation: eight coordinates of one point in a dozen table look-ups.

use std::sync::LazyLock;

use crate::tracer::sampler::nx8::{self, DIMENSIONS};
use crate::tracer::sampler::scramble::{BlockKey, owen_reversed};

/// Eight coordinates, one lane per dimension.
pub type Lanes = [u32; DIMENSIONS];

/// `TABLES[k][n]`: XOR of the columns whose index bits are set in nibble `k` of the **bit-reversed** index, each
/// coordinate's top 32 bits bit-reversed too; tables 0–7 are for the low half, 8–15 for the high half. 8 KiB: lives in
/// the first-level cache. Reversed on both ends because the scramble works on reversed words.
type Tables = [[Lanes; 16]; 16];

fn tables() -> &'static Tables {
    static TABLES: LazyLock<Box<Tables>> = LazyLock::new(|| {
        let mut tables = Box::new([[[0; DIMENSIONS]; 16]; 16]);
        for (k, table) in tables.iter_mut().enumerate() {
            for (n, entry) in table.iter_mut().enumerate() {
                // Bit j of nibble k of a reversed half is bit 31 − (4k + j) of that half.
                let half_base = if k < 8 { 0 } else { 32 };
                let index = (0..4).fold(0u64, |index, j| {
                    index | (n as u64 >> j & 1) << (half_base + 31 - (4 * (k % 8) + j))
                });
                *entry = nx8::point(index).map(|x| ((x >> 32) as u32).reverse_bits());
            }
        }
        tables
    });
    &TABLES
}

/// The index as bit-reversed halves `[low, high]`.
#[inline(always)]
pub fn reversed_halves(index: u64) -> [u32; 2] {
    [(index as u32).reverse_bits(), ((index >> 32) as u32).reverse_bits()]
}

/// Top 32 bits of the eight unscrambled coordinates, bit-reversed, at the index given as reversed halves.
#[inline(always)]
pub fn point_reversed([low, high]: [u32; 2]) -> Lanes {
    let tables = tables();
    let mut x = [0; DIMENSIONS];
    for k in 0..8 {
        xor(&mut x, &tables[k][(low >> (4 * k) & 15) as usize]);
    }
    // Up to 2^32 samples block 0 never needs the high half; a padded block's shuffled index always does.
    if high != 0 {
        for k in 0..8 {
            xor(&mut x, &tables[8 + k][(high >> (4 * k) & 15) as usize]);
        }
    }
    x
}

/// Block 0 of path `index`: scrambled, not shuffled. 32-bit fractions.
#[inline(always)]
pub fn first_block(index: [u32; 2], key: &BlockKey) -> Lanes {
    scramble(point_reversed(index), key)
}

/// A later block of path `index`: shuffled, then scrambled. 32-bit fractions.
#[inline(always)]
pub fn padded_block(index: [u32; 2], key: &BlockKey) -> Lanes {
    scramble(point_reversed(key.shuffle(index)), key)
}

#[inline(always)]
fn scramble(x: Lanes, key: &BlockKey) -> Lanes {
    let mut out = [0; DIMENSIONS];
    for d in 0..DIMENSIONS {
        out[d] = owen_reversed(x[d], key.dimensions[d]);
    }
    for x in &mut out {
        *x = x.reverse_bits();
    }
    out
}

#[inline(always)]
fn xor(x: &mut Lanes, entry: &Lanes) {
    for d in 0..DIMENSIONS {
        x[d] ^= entry[d];
    }
}
