//! Texture addressing: which texels are interpolated at a point, and how coordinates outside the unit square wrap.

use std::ops::RangeInclusive;

use glam::{Affine2, Vec2};

/// How a texture continues outside [0, 1]².
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WrapMode {
    /// The texture repeats.
    Repeat,
    /// The texture repeats, every other copy mirrored.
    Mirror,
    /// The texels of the edge continue.
    Clamp,
}

impl WrapMode {
    /// The columns or rows, of `size` in all, that unwrapped indices from `first` to `last` fall on: at most two ranges.
    pub(super) fn ranges(self, first: i64, last: i64, size: usize) -> [Option<RangeInclusive<usize>>; 2] {
        let n = size as i64;
        let (a, b) = (self.index(first, size), self.index(last, size));
        match self {
            Self::Clamp => [Some(a..=b), None],
            _ if last.saturating_sub(first) >= n => [Some(0..=size - 1), None],
            Self::Repeat if a <= b => [Some(a..=b), None],
            Self::Repeat => [Some(a..=size - 1), Some(0..=b)],
            Self::Mirror => match (first.div_euclid(n) == last.div_euclid(n), last.div_euclid(n) % 2 == 0) {
                (true, _) => [Some(a.min(b)..=a.max(b)), None],
                // The first or the last texel stands on both sides of the edge between two pictures.
                (false, true) => [Some(0..=a.max(b)), None],
                (false, false) => [Some(a.min(b)..=size - 1), None],
            },
        }
    }

    /// The column or row, of `size` in all, that the unwrapped index `i` falls on. Indices saturate for huge coordinates.
    #[inline(always)]
    pub(super) fn index(self, i: i64, size: usize) -> usize {
        // Most indices are inside already, and a division would take as long as the rest.
        if (i as u64) < size as u64 { i as usize } else { self.index_beyond(i, size) }
    }

    #[inline(never)]
    fn index_beyond(self, i: i64, size: usize) -> usize {
        let size = size as i64;
        let inside = match self {
            Self::Repeat => i.rem_euclid(size),
            Self::Mirror => {
                let i = i.rem_euclid(2 * size);
                i.min(2 * size - 1 - i)
            }
            Self::Clamp => i.clamp(0, size - 1),
        };
        inside as usize
    }
}

/// Unwrapped column and row of the first of the four texels to interpolate at `uv`, and the interpolation weights in [0, 1]². With
/// `nearest`, those of the texel that contains `uv`.
#[inline]
pub(super) fn cell(to_uv: &Affine2, size: [usize; 2], nearest: bool, uv: Vec2) -> ([i64; 2], Vec2) {
    let at = to_uv.transform_point2(uv) * Vec2::new(size[0] as f32, size[1] as f32);
    // NaN and coordinates beyond the range of integers become 0.
    let at = if at.abs().cmplt(Vec2::splat(1e18)).all() { at } else { Vec2::ZERO };
    let at = if nearest { at } else { at - 0.5 };
    // Rounded down in integers: without SSE 4.1, `floor` is a call.
    let cell = at.to_array().map(|v| {
        let whole = v as i64;
        whole - i64::from(whole as f32 > v)
    });
    (cell, at - Vec2::from(cell.map(|i| i as f32)))
}
