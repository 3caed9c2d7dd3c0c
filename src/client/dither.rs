//! Patterns that hide the steps of 8 bits: a threshold is added to a value, in steps, before it is rounded down.
//!
//! Thresholds are spread evenly over (0, 1), so that the mean over a tile is the value itself.

use std::sync::LazyLock;

use crate::client::settings::Dither;

/// Side of the blue-noise mask, texels.
pub const MASK_SIDE: usize = 64;

/// Texels of the mask.
const MASK: usize = MASK_SIDE * MASK_SIDE;

/// Offsets of the mask for red, green and blue: with equal offsets the noise would be grey and most visible.
const SHIFTS: [[usize; 2]; 3] = [[0, 0], [21, 37], [43, 13]];

/// The thresholds that are added before rounding down, one per channel.
#[inline]
pub fn thresholds(kind: Dither, x: usize, y: usize) -> [f32; 3] {
    match kind {
        Dither::None => [0.5; 3],
        Dither::Ordered => [bayer(x, y); 3],
        Dither::BlueNoise => {
            let mask = blue_noise();
            SHIFTS.map(|[dx, dy]| mask[(x + dx) % MASK_SIDE + MASK_SIDE * ((y + dy) % MASK_SIDE)])
        }
    }
}

/// Ordered dither of 8×8 (Bayer 1973): the bits of `x ^ y` and `y`, interleaved from the lowest one.
#[inline]
fn bayer(x: usize, y: usize) -> f32 {
    let rank = (0..3).fold(0, |v, k| 4 * v + 2 * (((x ^ y) >> k) & 1) + ((y >> k) & 1));
    (rank as f32 + 0.5) / 64.0
}

/// The blue-noise mask, `[MASK_SIDE][MASK_SIDE]`, made on first use.
pub fn blue_noise() -> &'static [f32] {
    static MADE: LazyLock<Vec<f32>> = LazyLock::new(void_and_cluster);
    &MADE
}

/// Standard deviation of the Gaussian that measures how crowded a texel's neighbourhood is, texels (Ulichney's 1.5).
const SIGMA: f32 = 1.5;

/// Beyond this distance along an axis the Gaussian counts as zero: it is below 2e-8.
const REACH: i32 = 9;

/// Point set on a torus, with the Gaussian-weighted density at every texel.
#[derive(Clone)]
struct Pattern {
    kernel: Vec<f32>,
    taken: Vec<bool>,
    crowd: Vec<f32>,
}

impl Pattern {
    fn new() -> Self {
        let gauss = |d: i32| (-(d * d) as f32 / (2.0 * SIGMA * SIGMA)).exp();
        let kernel = (-REACH..=REACH).map(gauss).collect();
        Self { kernel, taken: vec![false; MASK], crowd: vec![0.0; MASK] }
    }

    /// Adds or removes a point.
    fn put(&mut self, at: usize, taken: bool) {
        self.taken[at] = taken;
        let sign = if taken { 1.0 } else { -1.0 };
        let side = MASK_SIDE as i32;
        let (x, y) = ((at % MASK_SIDE) as i32, (at / MASK_SIDE) as i32);
        for dy in -REACH..=REACH {
            let row = ((y + dy).rem_euclid(side) * side) as usize;
            let across = sign * self.kernel[(dy + REACH) as usize];
            for dx in -REACH..=REACH {
                let column = (x + dx).rem_euclid(side) as usize;
                self.crowd[row + column] += across * self.kernel[(dx + REACH) as usize];
            }
        }
    }

    /// The point in the tightest cluster or, if `taken` is false, the texel in the largest void.
    fn extreme(&self, taken: bool) -> usize {
        let sign = if taken { -1.0 } else { 1.0 };
        let among = (0..MASK).filter(|&i| self.taken[i] == taken);
        // There is always at least one texel of either kind when this is called.
        among.min_by(|&a, &b| (sign * self.crowd[a]).total_cmp(&(sign * self.crowd[b]))).unwrap_or(0)
    }
}

/// Ranks by Ulichney's void-and-cluster method (1993), as thresholds in (0, 1).
fn void_and_cluster() -> Vec<f32> {
    let start = initial_pattern();
    let points = start.taken.iter().filter(|t| **t).count();
    let mut ranks = vec![0usize; MASK];
    // Initial points get the lowest ranks; removed from the tightest cluster first, they take these ranks from the highest down.
    let mut pattern = start.clone();
    for rank in (0..points).rev() {
        let at = pattern.extreme(true);
        pattern.put(at, false);
        ranks[at] = rank;
    }
    // The remaining ranks fill the largest void one after another.
    pattern = start;
    for rank in points..MASK {
        let at = pattern.extreme(false);
        pattern.put(at, true);
        ranks[at] = rank;
    }
    ranks.into_iter().map(|rank| (rank as f32 + 0.5) / MASK as f32).collect()
}

/// A tenth of the texels, scattered, then moved from the tightest cluster to the largest void until nothing changes.
fn initial_pattern() -> Pattern {
    let mut pattern = Pattern::new();
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut left = MASK / 10;
    while left > 0 {
        // Marsaglia's xorshift; another generator would change the bytes of dithered pictures.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        let at = (state >> 40) as usize % MASK;
        if !pattern.taken[at] {
            pattern.put(at, true);
            left -= 1;
        }
    }
    // Ends when a moved point would return to its place. The bound covers rounding, which may alternate between two places.
    for _ in 0..4 * MASK {
        let from = pattern.extreme(true);
        pattern.put(from, false);
        let to = pattern.extreme(false);
        pattern.put(to, true);
        if to == from {
            break;
        }
    }
    pattern
}
