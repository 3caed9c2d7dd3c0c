//! Eight lanes of AVX2, with instructions of AVX-512 where these are better.

use std::arch::x86_64::*;

use crate::tracer::accel::layout::F32x8;

use super::simd::{Simd8, Slots, methods};

/// A processor with AVX2, FMA and BMI, and for `WIDE` also AVX-512 F and VL.
#[derive(Clone, Copy)]
pub(in crate::tracer::accel) struct X86<const WIDE: bool>(());

impl<const WIDE: bool> X86<WIDE> {
    /// # Safety
    ///
    /// The processor must support these instruction sets.
    #[inline(always)]
    pub(in crate::tracer::accel) unsafe fn new() -> Self {
        Self(())
    }
}

/// Calls intrinsics. One reason makes all of these calls safe: a value of [`X86`] proves that the processor has them.
macro_rules! avx {
    ($call:expr) => {
        // SAFETY: the caller of `X86::new` promised a processor with these instructions. Pointers come from references to at
        // least as many bytes as are read or written, and unaligned loads and stores are used.
        unsafe { $call }
    };
}

/// For every mask, the set lanes in order, one per byte.
static SET_LANES: [u64; 256] = set_lanes();

const fn set_lanes() -> [u64; 256] {
    let (mut table, mut mask) = ([0; 256], 0);
    while mask < 256 {
        let (mut lane, mut end) = (0, 0);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask] |= lane << (8 * end);
                end += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
}

// SAFETY: masks come from the signs of eight floats, and every store writes all eight slots.
unsafe impl<const WIDE: bool> Simd8 for X86<WIDE> {
    type Floats = __m256;
    type Ints = __m256i;

    methods! {
        splat(x: f32) -> __m256 = avx!(_mm256_set1_ps(x));
        load(row: &F32x8) -> __m256 = avx!(_mm256_loadu_ps(row.as_ptr()));
        add(a: __m256, b: __m256) -> __m256 = avx!(_mm256_add_ps(a, b));
        sub(a: __m256, b: __m256) -> __m256 = avx!(_mm256_sub_ps(a, b));
        mul(a: __m256, b: __m256) -> __m256 = avx!(_mm256_mul_ps(a, b));
        div(a: __m256, b: __m256) -> __m256 = avx!(_mm256_div_ps(a, b));
        abs(a: __m256) -> __m256 = avx!(_mm256_andnot_ps(_mm256_set1_ps(-0.0), a));
        mul_add(a: __m256, b: __m256, c: __m256) -> __m256 = avx!(_mm256_fmadd_ps(a, b, c));
        min(a: __m256, b: __m256) -> __m256 = avx!(_mm256_min_ps(a, b));
        max(a: __m256, b: __m256) -> __m256 = avx!(_mm256_max_ps(a, b));
        le(a: __m256, b: __m256) -> u32 = avx!(_mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b))) as u32;
        lt(a: __m256, b: __m256) -> u32 = avx!(_mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b))) as u32;
        widen(bytes: &[u8; 8]) -> __m256i =
            avx!(_mm256_cvtepu8_epi32(_mm_loadl_epi64(bytes.as_ptr().cast())));
        store(keys: __m256i, to: &mut Slots<i32>) -> () =
            avx!(_mm256_storeu_si256(to.as_mut_ptr().cast(), keys));
    }

    #[inline(always)]
    fn to_array(self, a: __m256) -> F32x8 {
        let mut row = [0.0; 8];
        avx!(_mm256_storeu_ps(row.as_mut_ptr(), a));
        row
    }

    #[inline(always)]
    fn keys(self, distances: __m256) -> __m256i {
        avx!({
            let bits = _mm256_and_si256(_mm256_castps_si256(distances), _mm256_set1_epi32(!7));
            _mm256_or_si256(bits, _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7))
        })
    }

    #[inline(always)]
    fn select_keys_le(self, keys: __m256i, a: __m256, b: __m256, other: i32) -> __m256i {
        avx!({
            let which = _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LE_OQ>(a, b));
            _mm256_blendv_epi8(_mm256_set1_epi32(other), keys, which)
        })
    }

    #[inline(always)]
    fn smallest(self, keys: __m256i) -> i32 {
        avx!({
            let four = _mm_min_epi32(_mm256_castsi256_si128(keys), _mm256_extracti128_si256::<1>(keys));
            let two = _mm_min_epi32(four, _mm_shuffle_epi32::<0b0100_1110>(four));
            _mm_cvtsi128_si32(_mm_min_epi32(two, _mm_shuffle_epi32::<0b1011_0001>(two)))
        })
    }

    /// A bitonic sorting network (Batcher, 1968).
    #[inline(always)]
    fn sort_descending(self, keys: __m256i) -> __m256i {
        /// Compares pairs of keys: the smaller key goes to the lanes of `$smaller`, the larger to the others.
        macro_rules! step {
            ($keys:expr, $partner:expr, $smaller:literal) => {{
                let (keys, partner) = ($keys, $partner);
                _mm256_blend_epi32::<$smaller>(
                    _mm256_max_epi32(keys, partner),
                    _mm256_min_epi32(keys, partner),
                )
            }};
        }
        avx!({
            let reversed = _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0);
            let k = step!(keys, _mm256_shuffle_epi32::<0b1011_0001>(keys), 0b1010_1010);
            let k = step!(k, _mm256_shuffle_epi32::<0b0001_1011>(k), 0b1100_1100);
            let k = step!(k, _mm256_shuffle_epi32::<0b1011_0001>(k), 0b1010_1010);
            let k = step!(k, _mm256_permutevar8x32_epi32(k, reversed), 0b1111_0000);
            let k = step!(k, _mm256_shuffle_epi32::<0b0100_1110>(k), 0b1100_1100);
            step!(k, _mm256_shuffle_epi32::<0b1011_0001>(k), 0b1010_1010)
        })
    }

    #[inline(always)]
    fn lookup(self, a: __m256, b: __m256, indices: __m256i) -> __m256 {
        avx!(if WIDE {
            _mm256_permutex2var_ps(a, indices, b)
        } else {
            // Bit 3 of an index selects the table: it moves to the sign.
            let second = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(indices));
            let (a, b) = (_mm256_permutevar8x32_ps(a, indices), _mm256_permutevar8x32_ps(b, indices));
            _mm256_blendv_ps(a, b, second)
        })
    }

    #[inline(always)]
    fn store_permuted(self, row: &F32x8, keys: __m256i, to: &mut Slots<u32>) {
        avx!({
            let row = _mm256_loadu_si256(row.as_ptr().cast());
            _mm256_storeu_si256(to.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(row, keys));
        });
    }

    #[inline(always)]
    fn store_compressed(self, row: &F32x8, mask: u32, to: &mut Slots<u32>) {
        avx!({
            let row = _mm256_loadu_si256(row.as_ptr().cast());
            let lanes = if WIDE {
                _mm256_maskz_compress_epi32(mask as u8, row)
            } else {
                let lanes = SET_LANES[mask as u8 as usize];
                _mm256_permutevar8x32_epi32(row, _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(lanes as i64)))
            };
            _mm256_storeu_si256(to.as_mut_ptr().cast(), lanes);
        });
    }

    #[inline(always)]
    fn prefetch<const LINES: usize>(self, address: *const u8) {
        for line in 0..LINES {
            avx!(_mm_prefetch::<_MM_HINT_T0>(address.wrapping_add(64 * line).cast()));
        }
    }
}
