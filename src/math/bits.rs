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

/// The bits of x and y in turn, x first from below: the Z-order curve over squares of less than 2^16 along a side.
#[inline]
pub fn interleave([x, y]: [u32; 2]) -> u32 {
    let spread = |mut bits: u32| {
        for (shift, mask) in [(8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)] {
            bits = (bits | bits << shift) & mask;
        }
        bits
    };
    spread(x & 0xffff) | spread(y & 0xffff) << 1
}
