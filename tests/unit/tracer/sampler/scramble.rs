//! Tests of `tracer::sampler::scramble`.

use pointillist::math::bits::mix;
use pointillist::tracer::sampler::scramble::*;

/// Flipping bit k flips bit k of the result and nothing more significant: nested, and a bijection by induction.
#[test]
fn the_scramble_is_nested_and_bijective() {
    let mut z = 7;
    for _ in 0..2000 {
        z = mix(z);
        let (x, seed) = (z as u32, (z >> 32) as u32);
        for k in 0..32 {
            let changed = owen(x, seed) ^ owen(x ^ 1 << k, seed);
            assert_eq!(31 - changed.leading_zeros(), k, "x {x:#x} seed {seed:#x}");
        }
    }
    let mut seen = vec![false; 1 << 16];
    for x in 0..1u32 << 16 {
        let y = owen(x << 16, 0x9e37_79b9) >> 16;
        assert!(!std::mem::replace(&mut seen[y as usize], true), "{x} collides");
    }
}

#[test]
fn the_shuffled_index_keeps_aligned_ranges_together_in_64_bits() {
    let key = BlockKey::new(3, 5);
    let natural = |i: u64| {
        let [low, high] = key.shuffle([(i as u32).reverse_bits(), ((i >> 32) as u32).reverse_bits()]);
        u64::from(high.reverse_bits()) << 32 | u64::from(low.reverse_bits())
    };
    let mut z = 11;
    for _ in 0..500 {
        z = mix(z);
        for k in 0..64 {
            let changed = natural(z) ^ natural(z ^ 1 << k);
            assert_eq!(63 - changed.leading_zeros(), k, "index {z:#x}");
        }
    }
}
