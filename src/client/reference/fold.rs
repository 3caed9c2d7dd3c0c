//! The reference of `fold`: adds a batch image to the two-float accumulators.
//!
//! A plain `f32` sum of unit weights stops at 2^24, and a filter tap of weight f is lost once W > f·2^24
//! (paper §4.2 blends into one texture). Each batch is summed on its own and added by TwoSum
//! (Knuth, TAOCP 2, §4.2.2), so `hi + lo` carries 48 bits. After each fold `hi` is `hi + lo` rounded.

use std::ops::{Add, Sub};

use crate::client::settings::Summation;

/// `(hi, lo) + batch`, renormalised: `hi` is the rounded sum, `lo` what it leaves out.
///
/// Six operations of TwoSum, then FastTwoSum; the order is part of the definition.
#[inline]
pub fn two_float_add<T>(hi: T, lo: T, batch: T) -> (T, T)
where
    T: Copy + Add<Output = T> + Sub<Output = T>,
{
    let sum = hi + batch;
    let part = sum - hi;
    let error = (hi - (sum - part)) + (batch - part);
    let low = lo + error;
    let new_hi = sum + low;
    (new_hi, low - (new_hi - sum))
}

/// Folds a batch of one band into its accumulators; plain sums leave `lo` as it is.
pub fn fold<T>(sums: Summation, hi: &mut [T], lo: &mut [T], batch: &[T])
where
    T: Copy + Add<Output = T> + Sub<Output = T>,
{
    match sums {
        Summation::TwoFloat => hi
            .iter_mut()
            .zip(lo)
            .zip(batch)
            .for_each(|((hi, lo), &batch)| (*hi, *lo) = two_float_add(*hi, *lo, batch)),
        Summation::Plain => hi.iter_mut().zip(batch).for_each(|(hi, &batch)| *hi = *hi + batch),
    }
}
