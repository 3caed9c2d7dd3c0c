//! Morton codes over the scene's bounding box, which is halved again and again across its longest side (paper §3.4).
//!
//! All cells of one depth are congruent, so the axis that a level splits depends on the box alone, and the path from the
//! root to a photon is a bit string: its Morton code ([`MortonGrid::code`]). Photons sorted by code are the leaves of the
//! tree from left to right, a subtree is a range of them, and two trees over one box are merged like two sorted lists.

use glam::Vec3;

/// Largest depth: bits of a code.
pub const MAX_DEPTH: u32 = 64;
/// Most splits of one axis. Cells smaller than the spacing of `f32` at the far end of the box would be of no use.
const MAX_PER_AXIS: u32 = 24;
/// Bits of a coordinate that one table look-up spreads.
const CHUNK: u32 = 6;
const CHUNKS: usize = (MAX_PER_AXIS / CHUNK) as usize;

/// Bit positions of one coordinate in the code, for [`CHUNK`] bits at a time, lowest first.
type Spread = [[u64; 1 << CHUNK]; CHUNKS];

/// The scene's box and the order of its splits.
#[derive(Debug)]
pub struct MortonGrid {
    min: [f64; 3],
    /// Cells per metre; 0 for an axis that is never split.
    scale: [f64; 3],
    last: [u32; 3],
    spread: [Spread; 3],
    /// Axis that each bit of a code splits.
    axis: [u8; MAX_DEPTH as usize],
    depth: u32,
}

impl MortonGrid {
    /// The grid over the box from `min` to `max`. Sides may be zero or denormal: a side is split as long as it has an
    /// extent. Infinite coordinates are clamped to the largest finite ones, NaN counts as 0.
    pub fn new(min: Vec3, max: Vec3) -> Self {
        let finite = |v: Vec3| {
            v.to_array().map(|x| f64::from(if x.is_nan() { 0.0 } else { x }.clamp(f32::MIN, f32::MAX)))
        };
        let (min, max) = (finite(min), finite(max));
        let mut sides = [0, 1, 2].map(|a| (max[a] - min[a]).max(0.0));
        let whole = sides;
        let mut order = Vec::new();
        let mut bits = [0; 3];
        while (order.len() as u32) < MAX_DEPTH {
            let open = (0..3).filter(|&a| bits[a] < MAX_PER_AXIS && sides[a] > 0.0);
            // The first of equal sides.
            let Some(longest) = open.reduce(|a, b| if sides[b] > sides[a] { b } else { a }) else { break };
            order.push(longest);
            bits[longest] += 1;
            sides[longest] *= 0.5;
        }

        let depth = order.len() as u32;
        let mut axis = [0; MAX_DEPTH as usize];
        let mut spread = [[[0; 1 << CHUNK]; CHUNKS]; 3];
        let mut left = bits;
        for (level, &a) in order.iter().enumerate() {
            let place = depth - 1 - level as u32;
            axis[place as usize] = a as u8;
            left[a] -= 1;
            let (chunk, bit) = (left[a] / CHUNK, left[a] % CHUNK);
            for (value, places) in spread[a][chunk as usize].iter_mut().enumerate() {
                *places |= (value as u64 >> bit & 1) << place;
            }
        }
        let cells = bits.map(|b| (1u64 << b) as f64);
        Self {
            min,
            scale: [0, 1, 2].map(|a| if bits[a] > 0 { cells[a] / whole[a] } else { 0.0 }),
            last: bits.map(|b| ((1u64 << b) - 1) as u32),
            spread,
            axis,
            depth,
        }
    }

    /// The Morton code of `p`: the path from the root to the smallest cell around it, with the first split in the highest
    /// bit. A point outside the box is clamped to it.
    #[inline]
    pub fn code(&self, p: Vec3) -> u64 {
        let p = p.to_array();
        let mut code = 0;
        for (a, x) in p.into_iter().enumerate() {
            // The cast takes NaN to 0 and stops at 0 and at the largest number.
            let cell = ((f64::from(x) - self.min[a]) * self.scale[a]) as u32;
            let cell = cell.min(self.last[a]);
            for (chunk, places) in self.spread[a].iter().enumerate() {
                code |= places[(cell >> (chunk as u32 * CHUNK)) as usize & ((1 << CHUNK) - 1)];
            }
        }
        code
    }

    /// Axis that bit `bit` of a code splits.
    #[inline]
    pub fn axis(&self, bit: u32) -> u8 {
        self.axis[bit as usize]
    }

    /// Depth of the smallest cells.
    pub fn depth(&self) -> u32 {
        self.depth
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The code by repeated halving, as the paper describes it.
    fn by_halving(min: Vec3, max: Vec3, p: Vec3, depth: u32) -> u64 {
        let (mut lo, mut hi) = (min.as_dvec3(), max.as_dvec3());
        let p = p.as_dvec3();
        let mut code = 0;
        for _ in 0..depth {
            let side = hi - lo;
            let a = if side.x >= side.y && side.x >= side.z {
                0
            } else if side.y >= side.z {
                1
            } else {
                2
            };
            let mid = (lo[a] + hi[a]) * 0.5;
            let right = p[a] >= mid;
            if right {
                lo[a] = mid
            } else {
                hi[a] = mid
            }
            code = code << 1 | u64::from(right);
        }
        code
    }

    #[test]
    fn codes_are_the_splits_of_the_paper() {
        let boxes = [(Vec3::ZERO, Vec3::ONE), (Vec3::new(-8.0, 0.5, 2.0), Vec3::new(8.0, 1.0, 6.0))];
        for (min, max) in boxes {
            let grid = MortonGrid::new(min, max);
            for i in 0..2000 {
                let f = Vec3::new(i as f32 * 0.618_034, i as f32 * 0.754_878, i as f32 * 0.569_84).fract();
                let p = min + (max - min) * f;
                // Exact in f64 for boxes whose sides are powers of two.
                let depth = 40;
                assert_eq!(grid.code(p) >> (grid.depth() - depth), by_halving(min, max, p, depth), "{p}");
            }
        }
    }

    #[test]
    fn every_box_has_bounded_depth() {
        let tiny = f32::from_bits(1);
        for (min, max, depth) in [
            (Vec3::ZERO, Vec3::ZERO, 0),
            (Vec3::ZERO, Vec3::X, MAX_PER_AXIS),
            (Vec3::ZERO, Vec3::splat(tiny), MAX_DEPTH),
            (Vec3::splat(f32::MIN), Vec3::splat(f32::MAX), MAX_DEPTH),
            (Vec3::NEG_INFINITY, Vec3::INFINITY, MAX_DEPTH),
            (Vec3::ONE, Vec3::ZERO, 0),
            (Vec3::NAN, Vec3::ONE, MAX_DEPTH),
        ] {
            let grid = MortonGrid::new(min, max);
            assert_eq!(grid.depth(), depth, "{min} {max}");
            for p in [min, max, Vec3::NAN, Vec3::INFINITY, Vec3::NEG_INFINITY] {
                assert!(depth == 64 || grid.code(p) >> depth == 0, "{p} in {min} {max}");
            }
        }
    }
}
