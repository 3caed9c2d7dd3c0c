//! Eight lanes on any processor: plain loops, which a compiler turns into what vectors there are.

use std::array::from_fn;
use std::mem::MaybeUninit;

use crate::tracer::accel::layout::Row;

use super::lanes::{Lanes, Slots};

/// Any processor.
#[derive(Clone, Copy)]
pub(in crate::tracer::accel) struct Scalar;

#[inline(always)]
fn mask(of: impl Fn(usize) -> bool) -> u32 {
    (0..8).fold(0, |m, i| m | u32::from(of(i)) << i)
}

// SAFETY: as the trait asks, to be read below.
unsafe impl Lanes for Scalar {
    type Floats = Row;
    type Ints = [i32; 8];

    #[inline(always)]
    fn splat(self, x: f32) -> Row {
        [x; 8]
    }

    #[inline(always)]
    fn load(self, row: &Row) -> Row {
        *row
    }

    #[inline(always)]
    fn to_array(self, a: Row) -> Row {
        a
    }

    #[inline(always)]
    fn add(self, a: Row, b: Row) -> Row {
        from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn sub(self, a: Row, b: Row) -> Row {
        from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn mul(self, a: Row, b: Row) -> Row {
        from_fn(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn div(self, a: Row, b: Row) -> Row {
        from_fn(|i| a[i] / b[i])
    }

    #[inline(always)]
    fn abs(self, a: Row) -> Row {
        a.map(f32::abs)
    }

    #[inline(always)]
    fn mul_add(self, a: Row, b: Row, c: Row) -> Row {
        from_fn(|i| a[i] * b[i] + c[i])
    }

    #[inline(always)]
    fn min(self, a: Row, b: Row) -> Row {
        from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn max(self, a: Row, b: Row) -> Row {
        from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn le(self, a: Row, b: Row) -> u32 {
        mask(|i| a[i] <= b[i])
    }

    #[inline(always)]
    fn lt(self, a: Row, b: Row) -> u32 {
        mask(|i| a[i] < b[i])
    }

    #[inline(always)]
    fn keys(self, distances: Row) -> [i32; 8] {
        from_fn(|i| distances[i].to_bits() as i32 & !7 | i as i32)
    }

    #[inline(always)]
    fn keys_where_le(self, keys: [i32; 8], (a, b): (Row, Row), other: i32) -> [i32; 8] {
        from_fn(|i| if a[i] <= b[i] { keys[i] } else { other })
    }

    #[inline(always)]
    fn smallest(self, keys: [i32; 8]) -> i32 {
        keys.into_iter().fold(i32::MAX, i32::min)
    }

    #[inline(always)]
    fn sorted(self, mut keys: [i32; 8]) -> [i32; 8] {
        // Insertion: mostly one to three are hits, and what is no hit is all the same.
        for end in 1..8 {
            let key = keys[end];
            let mut at = end;
            while at > 0 && keys[at - 1] < key {
                keys[at] = keys[at - 1];
                at -= 1;
            }
            keys[at] = key;
        }
        keys
    }

    #[inline(always)]
    fn numbers(self, bytes: &[u8; 8]) -> [i32; 8] {
        bytes.map(i32::from)
    }

    #[inline(always)]
    fn pick(self, a: Row, b: Row, numbers: [i32; 8]) -> Row {
        let both = [a, b];
        numbers.map(|n| both[(n >> 3 & 1) as usize][(n & 7) as usize])
    }

    #[inline(always)]
    fn put(self, keys: [i32; 8], to: &mut Slots<i32>) {
        *to = keys.map(MaybeUninit::new);
    }

    #[inline(always)]
    fn put_named(self, row: &Row, keys: [i32; 8], to: &mut Slots<u32>) {
        *to = keys.map(|key| MaybeUninit::new(row[(key & 7) as usize].to_bits()));
    }

    #[inline(always)]
    fn put_packed(self, row: &Row, mut mask: u32, to: &mut Slots<u32>) {
        let mut end = 0;
        while mask != 0 {
            to[end & 7].write(row[mask.trailing_zeros() as usize & 7].to_bits());
            mask &= mask - 1;
            end += 1;
        }
    }

    #[inline(always)]
    fn prefetch<const LINES: usize>(self, _: *const u8) {}
}
