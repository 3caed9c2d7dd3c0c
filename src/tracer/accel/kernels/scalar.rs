//! Eight lanes on any processor: plain loops, which the compiler vectorises with what the target has.

use std::array::from_fn;
use std::mem::MaybeUninit;

use crate::tracer::accel::layout::F32x8;

use super::simd::{Simd8, Slots};

/// Methods of [`Simd8`] that compute each lane by itself.
macro_rules! lanewise {
    ($($name:ident($($x:ident),+) = $lane:expr;)+) => {$(
        #[inline(always)]
        fn $name(self, $($x: F32x8),+) -> F32x8 {
            from_fn(|i| {
                $(let $x = $x[i];)+
                $lane
            })
        }
    )+};
}

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

    #[inline(always)]
    fn splat(self, x: f32) -> F32x8 {
        [x; 8]
    }

    #[inline(always)]
    fn load(self, row: &F32x8) -> F32x8 {
        *row
    }

    #[inline(always)]
    fn to_array(self, a: F32x8) -> F32x8 {
        a
    }

    lanewise! {
        add(a, b) = a + b;
        sub(a, b) = a - b;
        mul(a, b) = a * b;
        div(a, b) = a / b;
        abs(a) = a.abs();
        mul_add(a, b, c) = a * b + c;
        min(a, b) = if a < b { a } else { b };
        max(a, b) = if a > b { a } else { b };
    }

    #[inline(always)]
    fn le(self, a: F32x8, b: F32x8) -> u32 {
        mask(|i| a[i] <= b[i])
    }

    #[inline(always)]
    fn lt(self, a: F32x8, b: F32x8) -> u32 {
        mask(|i| a[i] < b[i])
    }

    #[inline(always)]
    fn keys(self, distances: F32x8) -> [i32; 8] {
        from_fn(|i| distances[i].to_bits() as i32 & !7 | i as i32)
    }

    #[inline(always)]
    fn select_keys_le(self, keys: [i32; 8], a: F32x8, b: F32x8, other: i32) -> [i32; 8] {
        from_fn(|i| if a[i] <= b[i] { keys[i] } else { other })
    }

    #[inline(always)]
    fn smallest(self, keys: [i32; 8]) -> i32 {
        keys.into_iter().fold(i32::MAX, i32::min)
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
    fn widen(self, bytes: &[u8; 8]) -> [i32; 8] {
        bytes.map(i32::from)
    }

    #[inline(always)]
    fn lookup(self, a: F32x8, b: F32x8, indices: [i32; 8]) -> F32x8 {
        let both = [a, b];
        indices.map(|n| both[(n >> 3 & 1) as usize][(n & 7) as usize])
    }

    #[inline(always)]
    fn store(self, keys: [i32; 8], to: &mut Slots<i32>) {
        *to = keys.map(MaybeUninit::new);
    }

    #[inline(always)]
    fn store_permuted(self, row: &F32x8, keys: [i32; 8], to: &mut Slots<u32>) {
        *to = keys.map(|key| MaybeUninit::new(row[(key & 7) as usize].to_bits()));
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
