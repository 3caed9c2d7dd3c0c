//! Sums that do not depend on the order of their terms, so that parts of a picture add up to the same bits in any way.

/// A sum of numbers from 0 on in fixed point: 64 bits before the point and 64 behind it.
///
/// Integers add up to the same value in any order, and so does [`merge`](Self::merge) whatever the tree of merges. A term below 2^64 is
/// rounded to a multiple of 2^−64, which changes none that is at least 2^−41; a sum beyond 2^64 stays at the largest value, which is
/// as independent of the order.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ExactSum(u128);

/// Exponent bits of a number whose last mantissa bit is 2^−64.
const LAST_BIT: u32 = 150 - 64;

impl ExactSum {
    /// The sum of no terms.
    pub const ZERO: Self = Self(0);

    /// The sum that consists of these bits.
    pub const fn from_bits(bits: u128) -> Self {
        Self(bits)
    }

    /// The bits, in units of 2^−64.
    pub const fn to_bits(self) -> u128 {
        self.0
    }

    /// Adds `value`, which is neither negative nor NaN: −0 counts as 0, everything else as its amount.
    #[inline]
    pub fn add(&mut self, value: f32) {
        self.0 = self.0.saturating_add(fixed(value));
    }

    /// Adds another sum.
    #[inline]
    pub fn merge(&mut self, other: Self) {
        self.0 = self.0.saturating_add(other.0);
    }

    /// The nearest number; the largest sum is 2^64.
    #[inline]
    pub fn to_f64(self) -> f64 {
        self.0 as f64 * (0.5f64).powi(64)
    }

    /// The nearest number.
    #[inline]
    pub fn to_f32(self) -> f32 {
        self.to_f64() as f32
    }
}

/// `|value|` in units of 2^−64, to the nearest.
#[inline]
fn fixed(value: f32) -> u128 {
    let bits = value.to_bits() & 0x7fff_ffff;
    let exponent = bits >> 23;
    if exponent < LAST_BIT {
        // Subnormal numbers are below half a unit like all others this small.
        let mantissa = u64::from(bits & 0x7f_ffff | 0x80_0000);
        let shift = (LAST_BIT - exponent).min(40);
        return u128::from((mantissa + (1 << (shift - 1))) >> shift);
    }
    let mantissa = u128::from(bits & 0x7f_ffff | 0x80_0000);
    // Beyond 104 the first bit would be lost.
    let shift = exponent - LAST_BIT;
    if shift <= 104 { mantissa << shift } else { u128::MAX }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;

    fn sum(values: &[f32]) -> ExactSum {
        let mut sum = ExactSum::ZERO;
        values.iter().for_each(|value| sum.add(*value));
        sum
    }

    #[test]
    fn terms_are_what_they_are() {
        for value in [0.0f32, 1.0, 0.1, 3.5e-10, 1.5, 16_777_215.0, 1.2e19, (0.5f32).powi(41) * 1.000_000_1] {
            assert_eq!(sum(&[value]).to_f32(), value, "{value:e}");
            assert_eq!(sum(&[value]).to_f64(), f64::from(value), "{value:e}");
        }
        assert_eq!(sum(&[-0.0]), ExactSum::ZERO);
    }

    #[test]
    fn small_terms_are_rounded_to_the_nearest_unit() {
        let unit = (0.5f32).powi(64);
        for (value, units) in [
            (0.49, 0),
            (0.5, 1),
            (1.0, 1),
            (1.49, 1),
            (1.5, 2),
            (1000.4, 1000),
            (8_388_608.0, 8_388_608),
            (1e-30, 0),
        ] {
            // In two steps: 2^−64 times 1e−30 is a number, the unit of its reciprocal is not.
            assert_eq!(sum(&[value * unit]).to_bits(), units, "{value}");
        }
        assert_eq!(sum(&[f32::from_bits(1), f32::MIN_POSITIVE]), ExactSum::ZERO);
    }

    #[test]
    fn what_is_too_large_stays_at_the_end_in_any_order() {
        let end = ExactSum::from_bits(u128::MAX);
        for values in [[f32::MAX, 1.0], [1.0, f32::MAX], [1.2e19, 1.2e19], [f32::INFINITY, 0.0]] {
            assert_eq!(sum(&values), end);
        }
        assert_eq!(end.to_f32(), (2.0f32).powi(64));
        let mut part = sum(&[1.5e19]);
        part.merge(sum(&[0.5e19]));
        assert_eq!(part, end);
    }

    #[test]
    fn neither_order_nor_grouping_changes_a_bit() {
        let mut random = Random(7);
        let mut values: Vec<f32> =
            (0..4000).map(|_| random.f32() * (2.0f32).powi((random.f32() * 90.0) as i32 - 60)).collect();
        let whole = sum(&values);
        for _ in 0..50 {
            for i in (1..values.len()).rev() {
                values.swap(i, (random.f32() * (i + 1) as f32) as usize);
            }
            let (left, right) = values.split_at((random.f32() * values.len() as f32) as usize);
            let mut merged = sum(right);
            merged.merge(sum(left));
            assert_eq!(merged, whole);
        }
        // And it is the sum: f64 loses less than this of so few terms.
        let plain: f64 = values.iter().map(|v| f64::from(*v)).sum();
        assert!((whole.to_f64() / plain - 1.0).abs() < 1e-12);
    }
}
