//! What a walk asks of the processor: arithmetic on eight lanes.
//!
//! Sums, products, quotients and comparisons are IEEE's, lane by lane, so that what is accepted as a hit does not depend on who
//! computes it. Only [`Lanes::mul_add`] may be rounded once or twice: boxes are wide enough for both.

use std::mem::MaybeUninit;

use crate::tracer::accel::layout::Row;

/// Eight places on a stack.
pub(in crate::tracer::accel) type Slots<T> = [MaybeUninit<T>; 8];

/// Eight lanes of some processor. A value of the type says that the processor has them.
///
/// # Safety
///
/// Masks have bits 0 to 7 only. [`Lanes::put`] and [`Lanes::put_named`] write all eight slots, [`Lanes::put_packed`] at least as many as
/// its mask has bits: the stack takes them for written.
pub(in crate::tracer::accel) unsafe trait Lanes: Copy {
    /// Eight floats.
    type Floats: Copy;
    /// Eight signed integers of 32 bits.
    type Ints: Copy;

    fn splat(self, x: f32) -> Self::Floats;
    fn load(self, row: &Row) -> Self::Floats;
    fn to_array(self, a: Self::Floats) -> Row;

    fn add(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn sub(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn mul(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn div(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    fn abs(self, a: Self::Floats) -> Self::Floats;
    /// `a · b + c`, rounded once or twice.
    fn mul_add(self, a: Self::Floats, b: Self::Floats, c: Self::Floats) -> Self::Floats;
    /// The smaller; `b` where either is NaN.
    fn min(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// The larger; `b` where either is NaN.
    fn max(self, a: Self::Floats, b: Self::Floats) -> Self::Floats;
    /// Bits of the lanes where `a ≤ b`.
    fn le(self, a: Self::Floats, b: Self::Floats) -> u32;
    /// Bits of the lanes where `a < b`.
    fn lt(self, a: Self::Floats, b: Self::Floats) -> u32;

    /// The bits of `distances` (which are not negative) with the number of the lane in the lowest three.
    fn keys(self, distances: Self::Floats) -> Self::Ints;
    /// `keys` where `a ≤ b`, elsewhere `other`.
    fn keys_where_le(self, keys: Self::Ints, ab: (Self::Floats, Self::Floats), other: i32) -> Self::Ints;
    /// The smallest.
    fn smallest(self, keys: Self::Ints) -> i32;
    /// Largest first.
    fn sorted(self, keys: Self::Ints) -> Self::Ints;
    /// Eight small numbers.
    fn numbers(self, bytes: &[u8; 8]) -> Self::Ints;
    /// For every number what `a`, or from 8 on `b`, has in the lane of that number, below 16.
    fn pick(self, a: Self::Floats, b: Self::Floats, numbers: Self::Ints) -> Self::Floats;
    /// Writes `keys` over `to`.
    fn put(self, keys: Self::Ints, to: &mut Slots<i32>);
    /// Writes for every key what `row` has, as bits, in the lane that the key names.
    fn put_named(self, row: &Row, keys: Self::Ints, to: &mut Slots<u32>);
    /// Writes what `row` has, as bits, in the lanes of `mask`, in their order; the slots after them may be written too.
    fn put_packed(self, row: &Row, mask: u32, to: &mut Slots<u32>);
    /// Says that `lines` lines from `address` on will soon be read.
    fn prefetch<const LINES: usize>(self, address: *const u8);
}
