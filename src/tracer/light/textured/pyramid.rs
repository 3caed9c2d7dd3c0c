//! Mean luminances of an emission texture over ranges of texels, by a pyramid.

use std::ops::RangeInclusive;
use std::sync::Arc;

use glam::Vec2;

use crate::scene::desc::emission_texture::EmissionTexture;

/// Texels along either side of a range that are looked at, at most; larger ranges are looked at in a coarser level.
const LOOK: usize = 4;

/// Texels along either side of a patch, at most, where points in it tell more than the mean over all that count.
const FINE: usize = 8;

/// Share of the weight that is the mean over all texels that count in a patch; the rest is that of points.
const CERTAIN: f32 = 0.1;

/// A texture with means of 2 × 2, 4 × 4 … texels: a third of a number per texel.
#[derive(Debug)]
pub(in crate::tracer) struct LuminancePyramid {
    texture: Arc<EmissionTexture>,
    levels: Vec<PyramidLevel>,
}

#[derive(Debug)]
struct PyramidLevel {
    size: [usize; 2],
    means: Vec<f32>,
}

impl LuminancePyramid {
    pub(in crate::tracer) fn new(texture: Arc<EmissionTexture>) -> Self {
        let mut pyramid = Self { texture, levels: Vec::new() };
        let mut size = pyramid.texture.size();
        while size[0].max(size[1]) > LOOK {
            let finer = size;
            size = size.map(|n| n.div_ceil(2));
            let level = pyramid.levels.len();
            let mut means = Vec::with_capacity(size[0] * size[1]);
            for y in 0..size[1] {
                for x in 0..size[0] {
                    let range = |i: usize, n: usize| 2 * i..=(2 * i + 1).min(n - 1);
                    means.push(pyramid.mean_at(level, [range(x, finer[0]), range(y, finer[1])]));
                }
            }
            pyramid.levels.push(PyramidLevel { size, means });
        }
        pyramid
    }

    pub(in crate::tracer) fn texture(&self) -> &Arc<EmissionTexture> {
        &self.texture
    }

    #[inline]
    fn value(&self, level: usize, [x, y]: [usize; 2]) -> f32 {
        match level.checked_sub(1) {
            None => self.texture.luminance([x, y]),
            Some(i) => self.levels[i].means[y * self.levels[i].size[0] + x],
        }
    }

    fn mean_at(&self, level: usize, [columns, rows]: [RangeInclusive<usize>; 2]) -> f32 {
        let (mut sum, mut count) = (0.0, 0.0f64);
        for y in rows {
            for x in columns.clone() {
                (sum, count) = (sum + f64::from(self.value(level, [x, y])), count + 1.0);
            }
        }
        // A positive mean must not be rounded to 0.
        if sum > 0.0 { ((sum / count) as f32).max(f32::MIN_POSITIVE) } else { 0.0 }
    }

    /// The weight of a patch of the surface, whose corners have the texture coordinates `corners` and the points in it
    /// `inside`: about its mean luminance, and positive where anything in it shines.
    pub(in crate::tracer::light) fn weight(&self, corners: [Vec2; 4], inside: [Vec2; 4]) -> f32 {
        let [columns, rows] = self.texture.covered(corners);
        let (mut sum, mut texels, mut longest) = (0.0, 0.0, 0);
        for columns in columns.iter().flatten() {
            for rows in rows.iter().flatten() {
                let [width, height] = [columns, rows].map(|range| range.end() - range.start() + 1);
                let side = width.max(height);
                let level = (side.div_ceil(LOOK).next_power_of_two().ilog2() as usize).min(self.levels.len());
                let range = |r: &RangeInclusive<usize>| r.start() >> level..=r.end() >> level;
                let area = (width * height) as f64;
                sum += f64::from(self.mean_at(level, [range(columns), range(rows)])) * area;
                (texels, longest) = (texels + area, longest.max(side));
            }
        }
        let mean = if sum > 0.0 { ((sum / texels) as f32).max(f32::MIN_POSITIVE) } else { 0.0 };
        if longest > FINE {
            return mean;
        }
        let points: f32 = inside.into_iter().map(|uv| 0.25 * self.texture.luminance_at(uv)).sum();
        points * (1.0 - CERTAIN) + mean * CERTAIN
    }
}

#[cfg(test)]
mod tests {
    use glam::Affine2;

    use super::*;
    use crate::scene::desc::emission_texture::EmissionTexels;
    use crate::scene::desc::texture::WrapMode;
    use crate::spectrum::EmissionMap;

    /// Every level holds the means of two by two texels of the one before.
    #[test]
    fn levels_are_means_of_squares() {
        let (width, height) = (16, 8);
        let rgb: Vec<[f32; 3]> = (0..width * height).map(|i| [(i * i % 31) as f32; 3]).collect();
        let map = Arc::new(EmissionMap::new(width, &rgb).expect("radiance"));
        let pyramid = LuminancePyramid::new(Arc::new(EmissionTexture {
            texels: EmissionTexels::Picture(map),
            to_uv: Affine2::IDENTITY,
            wrap: WrapMode::Repeat,
            nearest: true,
        }));
        assert_eq!(pyramid.levels.len(), 2);
        for level in 1..=2 {
            for (y, x) in (0..height >> level).flat_map(|y| (0..width >> level).map(move |x| (y, x))) {
                let below = [[0, 0], [1, 0], [0, 1], [1, 1]];
                let sum: f32 =
                    below.map(|[i, j]| pyramid.value(level - 1, [2 * x + i, 2 * y + j])).iter().sum();
                let found = pyramid.value(level, [x, y]);
                assert!((found - 0.25 * sum).abs() <= 1e-5 * sum, "level {level}, {x}, {y}: {found}");
            }
        }
    }
}
