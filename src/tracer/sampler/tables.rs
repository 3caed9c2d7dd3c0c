//! Evaluation of the sequence: the eight coordinates of a point by table look-ups.

use std::sync::LazyLock;

use crate::tracer::sampler::nx8::{self, DIMENSIONS};
use crate::tracer::sampler::scramble::{BlockKey, owen_reversed};

/// The eight coordinates of a point, as 32-bit fractions.
pub type Coordinates = [u32; DIMENSIONS];

/// Entry `n` of table `k` is the XOR of the columns of the index bits that are set in `n`, where nibble `k` of the
/// **bit-reversed** index is `n`. Tables 0–7 are for the low half of the index, 8–15 for the high half. Of each coordinate
/// the top 32 bits are stored, also bit-reversed, because the scramble works on reversed words. With 8 KiB the tables fit
/// into the first-level cache.
type NibbleTables = [[Coordinates; 16]; 16];

fn tables() -> &'static NibbleTables {
    static TABLES: LazyLock<Box<NibbleTables>> = LazyLock::new(|| {
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

/// The unscrambled point of an index (as reversed halves), with bit-reversed coordinates.
#[inline(always)]
pub fn point_reversed([low, high]: [u32; 2]) -> Coordinates {
    let tables = tables();
    let mut x = [0; DIMENSIONS];
    for k in 0..8 {
        xor(&mut x, &tables[k][(low >> (4 * k) & 15) as usize]);
    }
    // For indices below 2^32 the high half is 0, also after the shuffle.
    if high != 0 {
        for k in 0..8 {
            xor(&mut x, &tables[8 + k][(high >> (4 * k) & 15) as usize]);
        }
    }
    x
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

#[inline(always)]
fn scramble(x: Coordinates, key: &BlockKey) -> Coordinates {
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
fn xor(x: &mut Coordinates, entry: &Coordinates) {
    for d in 0..DIMENSIONS {
        x[d] ^= entry[d];
    }
}
