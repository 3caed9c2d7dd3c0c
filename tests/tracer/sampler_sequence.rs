//! The sequence NX8: its check values, its quality parameter by linear algebra, and the sampler that is built on it.

use pointillist::math::bits::mix;
use pointillist::tracer::Sampler;
use pointillist::tracer::sampler::nx8::{columns, point, point_reversed, reversed_halves};
use pointillist::tracer::sampler::scramble::{BlockKey, first_block, owen, padded_block};
use pointillist::tracer::sampler::{unit_f32, unit_f64};

/// Figures computed by an independent program from the same definition.
#[test]
fn columns_and_points_have_their_check_values() {
    #[rustfmt::skip]
    let top: [[u64; 6]; 8] = [
        [0xa000_0000, 0xf000_0000, 0x830c_00c0, 0xc104_0040, 0x4800_0000, 0x8c00_0000],
        [0xf000_0000, 0x5000_0000, 0x8104_0040, 0xc208_0080, 0x8400_0000, 0xc800_0000],
        [0xa000_0000, 0xf000_0000, 0x6104_0040, 0xb208_0080, 0xc400_0000, 0x4800_0000],
        [0xf000_0000, 0x5000_0000, 0x3208_0080, 0x130c_00c0, 0x4c00_0000, 0x8400_0000],
        [0xe000_0000, 0x7000_0000, 0xd30c_00c0, 0x6104_0040, 0xcc00_0000, 0x4400_0000],
        [0xb000_0000, 0xd000_0000, 0x2208_0080, 0x330c_00c0, 0x8800_0000, 0xcc00_0000],
        [0x3000_0000, 0x1000_0000, 0x9208_0080, 0xe30c_00c0, 0x0800_0000, 0x0c00_0000],
        [0x8000_0000, 0xc000_0000, 0xcc30_0300, 0x4410_0100, 0x3000_0000, 0x1000_0000],
    ];
    #[rustfmt::skip]
    let last: [[u64; 2]; 8] = [
        [0x8000_0000_0c30_0300, 0xc000_0000_0410_0100], [0xc000_0001_0410_0100, 0x4000_0002_0820_0200],
        [0x5eed_f7ba_1409_0096, 0xa776_59df_280e_00eb], [0x15ad_7569_380f_00fb, 0x2af6_9abe_1c05_005d],
        [0xfdab_ef69_1c05_005d, 0x56fd_75be_240a_00a6], [0x356f_7d59_380b_00ba, 0x1ab5_96ae_1c0d_00df],
        [0xbfa7_dfeb_1805_0059, 0xd5f9_657d_2c0a_00ae], [0x7a57_5e98_b038_03be, 0x9fa9_a7ec_d01c_01d7],
    ];
    for (d, column) in columns().iter().enumerate() {
        assert_eq!(column[..6].iter().map(|c| c >> 32).collect::<Vec<_>>(), top[d], "dimension {d}");
        assert_eq!(column[62..], last[d], "dimension {d}");
    }
    #[rustfmt::skip]
    let points: [(u64, [u64; 8]); 7] = [
        (0, [0; 8]),
        (1, [40960, 61440, 40960, 61440, 57344, 45056, 12288, 32768]),
        (4, [33548, 33028, 24836, 12808, 54028, 8712, 37384, 52272]),
        (7, [54028, 8452, 12548, 37384, 17164, 16904, 45576, 35888]),
        (1000, [3909, 43402, 55877, 51082, 44105, 6278, 2434, 30980]),
        (123_456_789, [59402, 15195, 2391, 23489, 55545, 9678, 41176, 39746]),
        (u64::MAX, [5129, 50096, 0, 0, 9226, 16880, 16736, 61487]),
    ];
    for (index, expected) in points {
        assert_eq!(point(index).map(|x| x >> 48), expected, "point {index}");
    }
}

/// Rank over F₂ of the first `digits[i]` output bits of dimension `dims[i]` in the first `m` index bits.
fn rank(dims: &[usize], digits: &[usize], m: usize) -> usize {
    let mut basis: Vec<u64> = Vec::new();
    for (&d, &count) in dims.iter().zip(digits) {
        for bit in 0..count {
            let mut row = (0..m).fold(0, |row, k| row | (columns()[d][k] >> (63 - bit) & 1) << k);
            for &b in &basis {
                row = row.min(row ^ b);
            }
            if row != 0 {
                basis.push(row);
            }
        }
    }
    basis.len()
}

/// Calls `f` with every way to write `sum` as `parts` ordered summands.
fn compositions(parts: usize, sum: usize, f: &mut impl FnMut(&[usize])) {
    fn go(prefix: &mut Vec<usize>, parts: usize, sum: usize, f: &mut impl FnMut(&[usize])) {
        if prefix.len() + 1 == parts {
            prefix.push(sum);
            f(prefix);
            prefix.pop();
            return;
        }
        for first in 0..=sum {
            prefix.push(first);
            go(prefix, parts, sum - first, f);
            prefix.pop();
        }
    }
    go(&mut Vec::new(), parts, sum, f);
}

/// The quality parameter t of the first (2^bits)^m points in `dims`. Multiplication in F₄ is linear over F₂, so rows
/// over F₄ are independent exactly when their pairs of bit rows are.
fn t_value(dims: &[usize], m: usize, bits: usize) -> usize {
    (0..=m)
        .find(|t| {
            let mut full = true;
            compositions(dims.len(), m - t, &mut |digits| {
                let digits: Vec<usize> = digits.iter().map(|d| d * bits).collect();
                full &= rank(dims, &digits, m * bits) == (m - t) * bits;
            });
            full
        })
        .expect("t = m always holds")
}

#[test]
fn quality_parameters() {
    let all = [0, 1, 2, 3, 4, 5, 6, 7];
    for m in 1..=6 {
        assert_eq!(t_value(&all, m, 2), 1, "base 4, 8 dimensions, m = {m}");
    }
    for pair in [[0, 1], [2, 3], [4, 5]] {
        for m in 1..=12 {
            assert_eq!(t_value(&pair, m, 2), 0, "base 4, pair {pair:?}, m = {m}");
        }
    }
    let screen: Vec<usize> = (1..=20).map(|m| t_value(&[0, 1], m, 1)).collect();
    assert_eq!(screen, [0, 0, 1, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 0]);
    let base2: Vec<usize> = (1..=8).map(|m| t_value(&all, m, 1)).collect();
    assert_eq!(base2, [1, 2, 2, 2, 3, 3, 4, 5]);
}

/// The paper's claim (§3.2): 2^64 samples before two screen positions coincide, already with 32 bits a coordinate.
#[test]
fn all_screen_positions_of_2_to_the_64_indices_differ() {
    assert_eq!(rank(&[0, 1], &[32, 32], 64), 64);
    // Scrambling is a bijection per coordinate, f64 holds all 32 bits: nothing is lost on the way to the splat.
    assert_ne!(unit_f64(0x8000_0000), unit_f64(0x8000_0001));
}

#[test]
fn bit_loop_byte_tables_nibble_tables_and_increments_agree() {
    let byte_tables: Vec<[[u64; 8]; 256]> =
        (0..8).map(|k| std::array::from_fn(|n| point((n as u64) << (8 * k)))).collect();
    let bytes = |index: u64| {
        index
            .to_le_bytes()
            .iter()
            .zip(&byte_tables)
            .fold([0; 8], |x, (&n, table)| std::array::from_fn(|d| x[d] ^ table[usize::from(n)][d]))
    };
    let nibbles = |index: u64| point_reversed(reversed_halves(index)).map(u32::reverse_bits);
    let random = (0..2000).map(mix).chain([0, 1, u64::MAX, 1 << 32, (1 << 32) - 1, 1 << 63]);
    for index in random {
        assert_eq!(point(index), bytes(index), "{index:#x}");
        assert_eq!(point(index).map(|x| (x >> 32) as u32), nibbles(index), "{index:#x}");
    }
    // x(i + 1) = x(i) ^ prefix(trailing ones of i): the XOR of all columns up to the highest bit that changes.
    let prefix: [[u64; 8]; 64] = std::array::from_fn(|k| point(u64::MAX >> (63 - k)));
    let start = (1u64 << 40) - 500;
    let mut x = point(start);
    for index in start + 1..start + 1000 {
        let changed = index.trailing_zeros() as usize;
        x = std::array::from_fn(|d| x[d] ^ prefix[changed][d]);
        assert_eq!(x, point(index), "{index}");
    }
}

/// Owen scrambling with one independent coin per node of the tree of prefixes, which the hash replaces.
fn exact_owen(x: u32, seed: u32) -> u32 {
    (0..32).fold(0, |y, k| {
        let prefix = (u64::from(x) >> (32 - k)) | 1 << k;
        let coin = mix(prefix ^ u64::from(seed) << 33) as u32 >> 31;
        y | ((x >> (31 - k) & 1) ^ coin) << (31 - k)
    })
}

/// RMS error over 64 seeds of the mean of a smooth function over the first 256 points of dimensions 0 and 1.
fn rms_error(scramble: impl Fn(u32, u32) -> u32) -> f64 {
    let sum: f64 = (0..64u64)
        .map(|seed| {
            let mean: f64 = (0..256)
                .map(|i| {
                    let x = point(i).map(|x| (x >> 32) as u32);
                    let u = |d: usize| unit_f64(scramble(x[d], mix(2 * seed + 1000 + d as u64) as u32));
                    (u(0) * 3.0 + u(1) * u(1) * 2.0).sin()
                })
                .sum::<f64>()
                / 256.0;
            (mean - TRUTH).powi(2)
        })
        .sum();
    (sum / 64.0).sqrt()
}

/// ∫∫ sin(3u + 2v²), by the midpoint rule with 2000² cells.
const TRUTH: f64 = 0.466_301_754;

#[test]
fn the_hashed_scramble_is_as_good_as_exact_owen_scrambling() {
    let (hashed, exact) = (rms_error(owen), rms_error(exact_owen));
    let shift_only = rms_error(|x, seed| x.wrapping_add(seed));
    // Each RMS of 64 values has a standard error of 9 %: a factor 1.6 is five of them apart.
    assert!(hashed / exact < 1.6 && exact / hashed < 1.6, "hashed {hashed:e} exact {exact:e}");
    assert!(exact < 2e-3, "{exact:e} shift {shift_only:e}");
}

/// A slot names the same dimension of the same block whatever was asked before.
#[test]
fn every_number_has_its_slot() {
    let (index, seed) = (0x1234_5678_9abc, 77);
    let halves = reversed_halves(index);
    let first = first_block(halves, &BlockKey::new(seed, 0));
    let padded = |block| padded_block(halves, &BlockKey::new(seed, block));
    let sampler = Sampler::at(index, seed);
    let (late, early) = (sampler.vertex(9), sampler.vertex(0));
    assert_eq!(sampler.camera().screen, [unit_f64(first[0]), unit_f64(first[1])]);
    assert_eq!(sampler.camera().lens, [unit_f32(padded(1)[0]), unit_f32(padded(1)[1])]);
    assert_eq!(
        (sampler.camera().wavelength, sampler.camera().time),
        (unit_f32(first[6]), unit_f32(first[7]))
    );
    assert_eq!(early.light, [unit_f32(first[2]), unit_f32(first[3])]);
    assert_eq!(early.bsdf, [unit_f32(first[4]), unit_f32(first[5])]);
    assert_eq!(early.roulette, unit_f32(padded(1)[7]));
    assert_eq!(late.light, [unit_f32(padded(10)[0]), unit_f32(padded(10)[1])]);
    assert_eq!(late.light_choice, unit_f64(padded(10)[4]));
    assert_eq!([late.lobe, late.roulette], [5, 7].map(|d| unit_f32(padded(10)[d])));
}
