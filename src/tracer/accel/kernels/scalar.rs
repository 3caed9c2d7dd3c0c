//! Eight lanes on any processor: plain loops, which the compiler vectorises with what the target has.

use std::array::from_fn;
use std::mem::MaybeUninit;

use crate::tracer::accel::layout::F32x8;

use super::simd::{Simd8, Slots, methods};

/// Any processor.
#[derive(Clone, Copy)]
pub(in crate::tracer::accel) struct Scalar;

#[inline(always)]
fn mask(of: impl Fn(usize) -> bool) -> u32 {
    (0..8).fold(0, |m, i| m | u32::from(of(i)) << i)
}

// SAFETY: `mask` sets bits 0 to 7 only, and the stores write the slots that the trait demands.
unsafe impl Simd8 for Scalar {
    type Floats = F32x8;
    type Ints = [i32; 8];

    methods! {
        splat(x: f32) -> F32x8 = [x; 8];
        load(row: &F32x8) -> F32x8 = *row;
        to_array(a: F32x8) -> F32x8 = a;
        add(a: F32x8, b: F32x8) -> F32x8 = from_fn(|i| a[i] + b[i]);
        sub(a: F32x8, b: F32x8) -> F32x8 = from_fn(|i| a[i] - b[i]);
        mul(a: F32x8, b: F32x8) -> F32x8 = from_fn(|i| a[i] * b[i]);
        div(a: F32x8, b: F32x8) -> F32x8 = from_fn(|i| a[i] / b[i]);
        abs(a: F32x8) -> F32x8 = from_fn(|i| a[i].abs());
        mul_add(a: F32x8, b: F32x8, c: F32x8) -> F32x8 = from_fn(|i| a[i] * b[i] + c[i]);
        min(a: F32x8, b: F32x8) -> F32x8 = from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] });
        max(a: F32x8, b: F32x8) -> F32x8 = from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] });
        le(a: F32x8, b: F32x8) -> u32 = mask(|i| a[i] <= b[i]);
        lt(a: F32x8, b: F32x8) -> u32 = mask(|i| a[i] < b[i]);
        keys(distances: F32x8) -> [i32; 8] = from_fn(|i| distances[i].to_bits() as i32 & !7 | i as i32);
        select_keys_le(keys: [i32; 8], a: F32x8, b: F32x8, other: i32) -> [i32; 8] =
            from_fn(|i| if a[i] <= b[i] { keys[i] } else { other });
        smallest(keys: [i32; 8]) -> i32 = keys.into_iter().fold(i32::MAX, i32::min);
        widen(bytes: &[u8; 8]) -> [i32; 8] = bytes.map(i32::from);
        lookup(a: F32x8, b: F32x8, indices: [i32; 8]) -> F32x8 = {
            let both = [a, b];
            indices.map(|n| both[(n >> 3 & 1) as usize][(n & 7) as usize])
        };
        store(keys: [i32; 8], to: &mut Slots<i32>) -> () = *to = keys.map(MaybeUninit::new);
        store_permuted(row: &F32x8, keys: [i32; 8], to: &mut Slots<u32>) -> () =
            *to = keys.map(|key| MaybeUninit::new(row[(key & 7) as usize].to_bits()));
    }

    #[inline(always)]
    fn sort_descending(self, mut keys: [i32; 8]) -> [i32; 8] {
        // Insertion sort: mostly one to three lanes are hits, and the other keys are equal.
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
    fn store_compressed(self, row: &F32x8, mut mask: u32, to: &mut Slots<u32>) {
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
