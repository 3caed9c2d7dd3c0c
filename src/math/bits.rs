//! Bit mixing: the one hash behind scrambling seeds, shuffled paths and checks by chance.

/// 2⁶⁴ over the golden ratio: the step of SplitMix64.
pub const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A bijection that changes half of the bits on average: one step of SplitMix64 from state `z` (Steele, Lea and Flood,
/// *Fast Splittable Pseudorandom Number Generators*, 2014).
#[inline(always)]
pub fn mix(mut z: u64) -> u64 {
    z = z.wrapping_add(GOLDEN);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
