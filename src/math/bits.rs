//! Bit mixing: the one hash behind scrambling seeds, shuffled paths and checks by chance.

/// 2⁶⁴ over the golden ratio: the step of SplitMix64.
pub const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// A bijection that changes half of the bits on average: one step of SplitMix64 from state `z` (Steele, Lea and Flood,
/// *Fast Splittable Pseudorandom Number Generators*, 2014).
#[inline(always)]
pub fn mix(z: u64) -> u64 {
    finalize(z.wrapping_add(GOLDEN))
}

/// [`mix`] of the `index`-th state from 0: the outputs of SplitMix64 in order.
#[inline(always)]
pub fn mix_sequence(index: u64) -> u64 {
    finalize(index.wrapping_mul(GOLDEN))
}

#[inline(always)]
fn finalize(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}
