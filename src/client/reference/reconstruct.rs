//! The reference of `reconstruct`: blurs both streams as far as their sample counts require, and adds them (paper §4.2, §4.3).

use glam::{Vec3, Vec4, Vec4Swizzles};
use rayon::prelude::*;

use crate::client::filter::RECONSTRUCTION_THRESHOLD;
use crate::client::lod::{LocalStatistics, MIN_LOD, StreamLod};
use crate::client::reference::kernel::{gaussian, windowed_gaussian};
use crate::client::reference::mips::{bilinear_at, trilinear};
use crate::client::settings::{FilmSpec, Reconstruction, ReconstructionKernel};
use crate::image::Grid;

/// Catmull–Rom weight sums below this part of the bilinear one fall back to bilinear: negative lobes
/// beside an empty region would otherwise divide by nearly nothing.
pub const CATMULL_ROM_MIN_WEIGHT: f32 = 0.05;

/// One stream as the reconstruction reads it.
pub struct StreamView<'a> {
    /// Levels of `[X, Y, Z, W]` sums.
    pub color: &'a [Grid<Vec4>],
    /// Levels of the variance sums; `None` when noise masking is off.
    pub variance: Option<&'a [Grid<f32>]>,
    /// The stream's level of detail.
    pub lod: StreamLod,
    /// True for the light stream: its sums are shown, not their mean.
    pub summed: bool,
    /// Whether level 0, without overscan, is what is shown: the sums were [filtered](crate::client::reference::adaptive_filter).
    pub filtered: bool,
}

impl StreamView<'_> {
    /// At `uv` over the padded film: the colour at the level where variance and mean are read, and the relative variance of
    /// the mean after a blur of level `base`. `None` without variance.
    pub fn relative_variance(
        &self,
        p: &ReconstructParameters,
        uv: [f32; 2],
        base: f32,
    ) -> Option<(Vec4, f32)> {
        let color = trilinear(self.color, uv, self.lod.variance);
        let variance = trilinear(self.variance?, uv, self.lod.variance);
        let lod = StreamLod { base, ..self.lod };
        let at = LocalStatistics { luminance: color.y, weight: color.w, variance, summed: self.summed };
        Some((color, lod.relative_variance(&at, p.luminance_scale, p.spec.filter.energy())))
    }
}

/// The parameters of the reconstruction.
#[derive(Clone, Copy, Debug)]
pub struct ReconstructParameters {
    /// Size, padding, filter.
    pub spec: FilmSpec,
    /// The reconstruction method.
    pub method: Reconstruction,
    /// The support of its Gaussian.
    pub kernel: ReconstructionKernel,
    /// Noise masking strength; 0 is off.
    pub vm: f32,
    /// The film's luminance scale, a power of two.
    pub luminance_scale: f32,
    /// `width · height / light paths`, 0 without light paths.
    pub light_scale: f32,
    /// Picture pixels per pixel drawn, along each axis.
    pub detail: u32,
}

/// A place of the picture in padded texels, the texel that it lies in, and the screen position over the padded film.
#[derive(Clone, Copy)]
struct PixelPosition {
    place: [f32; 2],
    texel: [usize; 2],
    uv: [f32; 2],
}

/// The picture in XYZ, `[⌈height / detail⌉][⌈width / detail⌉]`: camera stream plus light stream.
///
/// Where a stream is absent it is not read. Values may be negative with Catmull–Rom.
pub fn reconstruct(
    p: &ReconstructParameters,
    camera: Option<&StreamView<'_>>,
    light: Option<&StreamView<'_>>,
) -> Option<Grid<Vec3>> {
    let [width, height] = [p.spec.width, p.spec.height].map(|n| n.div_ceil(p.detail) as usize);
    let (detail, pad) = (p.detail as f32, p.spec.pad() as f32);
    let extent = p.spec.padded_extent();
    let mut picture = Grid::try_filled(width, height, Vec3::ZERO)?;
    picture.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            let place = [x, y].map(|i| (i as f32 + 0.5) * detail + pad);
            let uv = [0, 1].map(|i| place[i] / extent[i] as f32);
            let at = PixelPosition { place, texel: place.map(|p| p as usize), uv };
            let mut xyz = Vec3::ZERO;
            if let Some(stream) = camera {
                let sum = read(p, stream, at);
                if sum.w > 0.0 {
                    xyz = sum.xyz() / sum.w;
                }
            }
            if let Some(stream) = light {
                xyz += read(p, stream, at).xyz() * p.light_scale;
            }
            *out = xyz;
        }
    });
    Some(picture)
}

/// The blurred `[X, Y, Z, W]` of one stream at one pixel.
#[inline]
fn read(p: &ReconstructParameters, stream: &StreamView<'_>, at: PixelPosition) -> Vec4 {
    if stream.filtered {
        // A texel as it is, where pixels have its size.
        return bilinear_at(&stream.color[0], at.place.map(|place| place - p.spec.pad() as f32));
    }
    let lod = level_of_detail(p, stream, at.uv);
    match p.method {
        Reconstruction::Gaussian => blur(p.kernel, stream.color, at, lod),
        Reconstruction::CatmullRom => spline(stream.color, at, lod),
        Reconstruction::Mipmap => trilinear(stream.color, at.uv, lod),
        Reconstruction::None => stream.color[0].at(at.texel[0], at.texel[1]),
    }
}

/// `LoD'` of one stream at `uv` over the padded film.
pub fn level_of_detail(p: &ReconstructParameters, stream: &StreamView<'_>, uv: [f32; 2]) -> f32 {
    let known = stream.relative_variance(p, uv, stream.lod.base);
    known.map_or(stream.lod.base, |(_, r)| stream.lod.masked(r, p.vm))
}

/// The paper's rule "while σ < t: σ ← 4σ, next level" ends with t ≤ σ < 4t on one level; the other of the two levels is the
/// finer one, with a quarter of that σ. Wide kernels on both are what keeps texels from showing. At LoD 0 the kernel spans
/// a texel (σ = t); below, it narrows to the texel alone at LoD −1.
fn blur(kernel: ReconstructionKernel, levels: &[Grid<Vec4>], at: PixelPosition, lod: f32) -> Vec4 {
    if lod <= MIN_LOD {
        return levels[0].at(at.texel[0], at.texel[1]);
    }
    let four_to = |x: f32| RECONSTRUCTION_THRESHOLD * (2.0 * x).exp2();
    let mean = |level: usize, sigma: f32| {
        let (image, p) = (&levels[level], position(levels, at, level));
        if kernel == ReconstructionKernel::default() {
            gaussian(image, p, sigma)
        } else {
            windowed_gaussian(kernel, image, p, sigma)
        }
    };
    if lod < 0.0 {
        return mean(0, four_to(-2.0 * lod));
    }
    let level = (lod as usize).min(levels.len() - 1);
    let f = lod - level as f32;
    let near = mean(level, four_to(-f));
    if f > 0.0 && level + 1 < levels.len() { near.lerp(mean(level + 1, four_to(1.0 - f)), f) } else { near }
}

/// Catmull–Rom on two levels, interpolated; trilinear where the weight all but cancels.
fn spline(levels: &[Grid<Vec4>], at: PixelPosition, lod: f32) -> Vec4 {
    let lod = lod.max(0.0);
    let level = (lod as usize).min(levels.len() - 1);
    let f = lod - level as f32;
    let near = catmull_rom(&levels[level], position(levels, at, level));
    let sum = if f > 0.0 && level + 1 < levels.len() {
        near.lerp(catmull_rom(&levels[level + 1], position(levels, at, level + 1)), f)
    } else {
        near
    };
    let linear = trilinear(levels, at.uv, lod);
    if sum.w > CATMULL_ROM_MIN_WEIGHT * linear.w { sum } else { linear }
}

/// Position in texels of a level; exact on level 0.
fn position(levels: &[Grid<Vec4>], at: PixelPosition, level: usize) -> [f32; 2] {
    let size = [levels[level].width(), levels[level].height()];
    let full = [levels[0].width(), levels[0].height()];
    [0, 1].map(|i| at.place[i] * (size[i] as f32 / full[i] as f32))
}

/// 4×4 Catmull–Rom at `p` in texels of the level, clamped to the edge; weights sum to 1.
pub fn catmull_rom(level: &Grid<Vec4>, p: [f32; 2]) -> Vec4 {
    let axis = |p: f32, size: usize| {
        let q = p - 0.5;
        let base = q.floor();
        let t = q - base;
        let index: [usize; 4] =
            std::array::from_fn(|k| (base as i64 + k as i64 - 1).clamp(0, size as i64 - 1) as usize);
        let weights = [
            t * (-0.5 + t * (1.0 - 0.5 * t)),
            1.0 + t * t * (-2.5 + 1.5 * t),
            t * (0.5 + t * (2.0 - 1.5 * t)),
            t * t * (-0.5 + 0.5 * t),
        ];
        (index, weights)
    };
    let ((ix, wx), (iy, wy)) = (axis(p[0], level.width()), axis(p[1], level.height()));
    let mut sum = Vec4::ZERO;
    for j in 0..4 {
        let row = level.row(iy[j]);
        for i in 0..4 {
            sum += row[ix[i]] * (wx[i] * wy[j]);
        }
    }
    sum
}
