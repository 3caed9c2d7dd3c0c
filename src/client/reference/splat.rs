//! The reference of `splat_color`: draws one batch of samples as filter-shaped sprites, additively.
//!
//! The sum in every texel is the plain `f32` sum in sample order, as additive blending gives it. Rows are
//! cut into bands; a band draws its own samples in order, so the result does not depend on threads or bands.

use std::ops::Range;

use glam::Vec4;

use crate::client::filter::Taps;
use crate::client::settings::{FilmSpec, SplatFilter};
use crate::stream::Sample;

/// Rows of the padded target in one band: with the scratch images it fits a core's second-level cache.
pub const BAND_ROWS: usize = 32;

/// A sample in padded texels, with the sign of its stream removed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sprite {
    /// Position in padded texels, inside the target.
    pub p: [f32; 2],
    /// `[x, y, z, |w|]`.
    pub value: Vec4,
}

/// One batch of one stream, sorted by band; samples that straddle a border are in both bands.
#[derive(Debug, Default)]
pub struct Bins {
    sprites: Vec<Sprite>,
    starts: Vec<usize>,
}

impl Sprite {
    /// A sample on the padded target; `None` outside of it.
    pub fn place(spec: &FilmSpec, sample: &Sample) -> Option<Self> {
        let p = spec.texel_position(sample.uv);
        spec.holds(p).then(|| Sprite { p, value: sprite_value(sample) })
    }

    /// A [merged](crate::client::dense_cells) sample, whose position is in padded texels.
    pub fn merged(sample: &Sample) -> Self {
        Sprite { p: sample.uv, value: sprite_value(sample) }
    }
}

impl Bins {
    /// Sorts sprites by band, each band in their order.
    pub fn fill(&mut self, spec: &FilmSpec, sprites: impl Iterator<Item = Sprite> + Clone) {
        let bands = (spec.padded_extent()[1] as usize).div_ceil(BAND_ROWS);
        self.starts.clear();
        self.starts.resize(bands + 1, 0);
        for sprite in sprites.clone() {
            for band in bands_of(spec.filter, sprite.p[1], bands) {
                self.starts[band + 1] += 1;
            }
        }
        for band in 0..bands {
            self.starts[band + 1] += self.starts[band];
        }
        self.sprites.clear();
        self.sprites.resize(self.starts[bands], Sprite::default());
        let mut next = self.starts.clone();
        for sprite in sprites {
            for band in bands_of(spec.filter, sprite.p[1], bands) {
                self.sprites[next[band]] = sprite;
                next[band] += 1;
            }
        }
    }

    /// The sprites that touch rows `band · BAND_ROWS ..`, in sample order.
    pub fn band(&self, band: usize) -> &[Sprite] {
        &self.sprites[self.starts[band]..self.starts[band + 1]]
    }
}

/// `[x, y, z, |w|]` of a sample.
fn sprite_value(s: &Sample) -> Vec4 {
    Vec4::new(s.xyz.x, s.xyz.y, s.xyz.z, s.w.abs())
}

/// The bands that a sprite at row position `y` touches.
fn bands_of(filter: SplatFilter, y: f32, bands: usize) -> Range<usize> {
    let first = filter.taps(y).first;
    let last = first + filter.taps_per_axis() as i32 - 1;
    let band = |row: i32| row.max(0) as usize / BAND_ROWS;
    band(first)..(band(last) + 1).min(bands)
}

/// The rows of one band of a padded target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Band {
    /// First row in the padded target.
    pub first_row: usize,
    /// Rows.
    pub rows: usize,
    /// Texels in a row.
    pub width: usize,
}

/// Adds `f · [x, y, z, |w|]` of every sprite to the band's texels.
pub fn splat_color(filter: SplatFilter, band: Band, sprites: &[Sprite], texels: &mut [Vec4]) {
    draw(filter, band, sprites, |sprite, at, f| {
        for (texel, &f) in texels[at..][..f.len()].iter_mut().zip(f) {
            *texel += sprite.value * f;
        }
    });
}

/// Texels in a row that [`touched`] tests together.
const RUN: usize = 16;

/// Appends the ranges of a band's texels touched by these sprites, in order and rounded up to runs; the whole band if they are dense, so
/// that little time is spent on the search. `runs` is scratch memory.
pub fn touched(
    filter: SplatFilter,
    band: Band,
    sprites: &[Sprite],
    runs: &mut Vec<bool>,
    texels: &mut Vec<Range<usize>>,
) {
    let len = band.rows * band.width;
    let rows = sprites.len() * filter.taps_per_axis();
    if rows * RUN > len {
        texels.push(0..len);
        return;
    }
    runs.clear();
    runs.resize(len.div_ceil(RUN), false);
    draw(filter, band, sprites, |_, at, f| {
        if !f.is_empty() {
            runs[at / RUN..=(at + f.len() - 1) / RUN].fill(true);
        }
    });
    let mut first = 0;
    for same in runs.chunk_by(|a, b| a == b) {
        let next = first + same.len() * RUN;
        if same[0] {
            texels.push(first..next.min(len));
        }
        first = next;
    }
}

/// Calls `draw_row(sprite, index, f)` for every row of every sprite, clipped to the band: texels
/// `index ..` of the band get the weights `f`. In sample order.
#[inline]
pub(super) fn draw(
    filter: SplatFilter,
    band: Band,
    sprites: &[Sprite],
    draw_row: impl FnMut(&Sprite, usize, &[f32]),
) {
    match filter {
        SplatFilter::Gaussian | SplatFilter::Scaled(_) => draw_taps::<6>(filter, band, sprites, draw_row),
        SplatFilter::Tent => draw_taps::<2>(filter, band, sprites, draw_row),
        SplatFilter::Box => draw_taps::<1>(filter, band, sprites, draw_row),
    }
}

#[inline]
fn draw_taps<const N: usize>(
    filter: SplatFilter,
    band: Band,
    sprites: &[Sprite],
    mut draw_row: impl FnMut(&Sprite, usize, &[f32]),
) {
    for sprite in sprites {
        let (x, y) = (filter.taps(sprite.p[0]), filter.taps(sprite.p[1]));
        let (column, kx) = clip::<N>(&x, 0, band.width);
        let (row, ky) = clip::<N>(&y, band.first_row, band.rows);
        for (row, &fy) in (row..).zip(&y.weights[ky]) {
            let f: [f32; N] = std::array::from_fn(|k| x.weights[k] * fy);
            let at = row * band.width + column;
            // Two calls, so that the common case is compiled for a constant count.
            if kx.len() == N {
                draw_row(sprite, at, &f);
            } else {
                draw_row(sprite, at, &f[kx.clone()]);
            }
        }
    }
}

/// Clips the taps to `len` texels from `origin` on; returns the index of the first texel and the range of taps.
#[inline]
fn clip<const N: usize>(taps: &Taps, origin: usize, len: usize) -> (usize, Range<usize>) {
    let first = i64::from(taps.first) - origin as i64;
    let skip = (-first).clamp(0, N as i64) as usize;
    let keep = (len as i64 - first).clamp(skip as i64, N as i64) as usize;
    ((first + skip as i64).max(0) as usize, skip..keep)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Xyz;
    use crate::math::random::Random;

    fn spec(width: u32, height: u32, filter: SplatFilter) -> FilmSpec {
        FilmSpec { width, height, filter, variance: Some(Default::default()), sums: Default::default() }
    }

    /// Every texel of a band equals the plain loop over all samples, bit for bit.
    #[test]
    fn bands_equal_the_plain_loop() {
        for filter in [SplatFilter::Gaussian, SplatFilter::Tent, SplatFilter::Box] {
            let spec = spec(37, 71, filter);
            let [w, h] = spec.padded_extent().map(|n| n as usize);
            let mut random = Random(1);
            let mut next = || random.f32();
            let samples: Vec<Sample> = (0..3000)
                .map(|_| Sample {
                    uv: [next() * 1.3 - 0.15, next() * 1.3 - 0.15],
                    xyz: Xyz::new(next(), next(), next()),
                    w: 1.0,
                })
                .collect();
            let mut bins = Bins::default();
            bins.fill(&spec, samples.iter().filter_map(|s| Sprite::place(&spec, s)));
            for band in 0..h.div_ceil(BAND_ROWS) {
                let first_row = band * BAND_ROWS;
                let band_ = Band { first_row, rows: BAND_ROWS.min(h - first_row), width: w };
                let mut texels = vec![Vec4::ZERO; band_.rows * w];
                splat_color(filter, band_, bins.band(band), &mut texels);
                for (i, texel) in texels.iter().enumerate() {
                    let (x, y) = ((i % w) as i32, (first_row + i / w) as i32);
                    let mut sum = Vec4::ZERO;
                    for s in &samples {
                        let p = spec.texel_position(s.uv);
                        if !spec.holds(p) {
                            continue;
                        }
                        let (tx, ty) = (filter.taps(p[0]), filter.taps(p[1]));
                        let n = filter.taps_per_axis() as i32;
                        let (kx, ky) = (x - tx.first, y - ty.first);
                        if (0..n).contains(&kx) && (0..n).contains(&ky) {
                            let f = tx.weights[kx as usize] * ty.weights[ky as usize];
                            sum += sprite_value(s) * f;
                        }
                    }
                    assert_eq!(*texel, sum, "{filter:?} texel {x},{y}");
                }
            }
        }
    }
}
