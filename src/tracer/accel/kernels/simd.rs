//! The interface to SIMD arithmetic on eight lanes.
//!
//! Sums, products, quotients and comparisons follow IEEE 754, lane by lane, so that the decision on a hit does not depend on
//! the processor. Only [`Simd8::mul_add`] may be rounded once or twice. The boxes are wide enough for both.

use std::mem::MaybeUninit;

use crate::tracer::accel::layout::F32x8;

/// Eight consecutive entries of a stack.
pub(in crate::tracer::accel) type Slots<T> = [MaybeUninit<T>; 8];

/// Methods of [`Simd8`] that are one expression each, of arguments whose types are given.
macro_rules! methods {
    ($($name:ident($($x:ident: $type:ty),+) -> $result:ty = $value:expr;)+) => {$(
        #[inline(always)]
        fn $name(self, $($x: $type),+) -> $result {
            $value
        }
    )+};
}

pub(super) use methods;

/// Eight lanes of some processor. A value of the type proves that this processor supports them.
///
/// # Safety
///
/// Masks have bits 0 to 7 only. [`Simd8::store`] and [`Simd8::store_permuted`] write all eight slots.
/// [`Simd8::store_compressed`] writes at least as many as its mask has bits. The stack relies on it.
pub(in crate::tracer::accel) unsafe trait Simd8: Copy {
    /// Eight floats.
    type Floats: Copy;
    /// Eight signed integers of 32 bits.
    type Ints: Copy;

    fn splat(self, x: f32) -> Self::Floats;
    fn load(self, row: &F32x8) -> Self::Floats;
    fn to_array(self, a: Self::Floats) -> F32x8;

    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn div(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn abs(self, a: Self::Floats) -> Self::Floats;
    /// `a · b + c`, rounded once or twice.
    fn mul_add(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats;
    /// The minimum, or `b` where either is NaN.
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// The maximum, or `b` where either is NaN.
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// The mask of the lanes where `a ≤ b`.
    fn le(self, a: Self::Floats, b: Self::Floats) -> u32;
    /// The mask of the lanes where `a < b`.
    fn lt(self, a: Self::Floats, b: Self::Floats) -> u32;

    /// Sorting keys: the bits of `distances`, which must not be negative, with the lane in the lowest three bits.
    fn keys(self, distances: Self::Floats) -> Self::Ints;
    /// `keys` where `a ≤ b`, and `other` elsewhere.
    fn select_keys_le(self, keys: Self::Ints, a: Self::Floats, b: Self::Floats, other: i32) -> Self::Ints;
    /// The smallest key.
    fn smallest(self, keys: Self::Ints) -> i32;
    /// The keys in descending order.
    fn sort_descending(self, keys: Self::Ints) -> Self::Ints;
    /// Converts eight bytes to integers.
    fn widen(self, bytes: &[u8; 8]) -> Self::Ints;
    /// Looks each index, below 16, up in the table of the eight lanes of `a` and the eight lanes of `b`.
    fn lookup(self, a: Self::Floats, b: Self::Floats, indices: Self::Ints) -> Self::Floats;
    /// Stores `keys`.
    fn store(self, keys: Self::Ints, to: &mut Slots<i32>);
    /// Stores for each key the bits of `row` in the key's lane.
    fn store_permuted(self, row: &F32x8, keys: Self::Ints, to: &mut Slots<u32>);
    /// Stores the bits of `row` in the lanes of `mask`, in order. The slots after them may be overwritten too.
    fn store_compressed(self, row: &F32x8, mask: u32, to: &mut Slots<u32>);
    /// Prefetches `LINES` cache lines from `address` on.
    fn prefetch<const LINES: usize>(self, address: *const u8);
}
