//! Denoised pictures: from the samples of both randomisations through a noise filter to what the film would show without noise.

use std::ops::Range;
use std::sync::Arc;

use glam::{Vec2, Vec3, Vec4};
use miette::{IntoDiagnostic, Result};
use rayon::prelude::*;

use crate::client::reference::ReferenceFilm;
use crate::client::wavelet::{Filtered, HalfPicture, out_of_memory};
use crate::client::{ClientError, Denoise, DisplayImage, FilmData, FilmSpec, Settings};
use crate::color::Profile;
use crate::denoise::view_filter::{OidnOptions, ViewFilter};
use crate::image::Grid;
use crate::image::exr::Channel;
use crate::study::denoised::FilteredHalves;
use crate::study::{ErrorEstimate, Replicates, SamplesApart, SmoothingKernel};
use crate::tracer::{Camera, Scene};

/// Per pixel and randomisation: mean X, Y, Z of the samples, and their number.
pub struct HalfMeans(pub [HalfPicture; 2]);

impl HalfMeans {
    /// # Errors
    ///
    /// Without memory.
    pub fn of(replicates: &Replicates) -> Result<Self, ClientError> {
        let size @ [width, height] = replicates.size();
        let pixel = |pixel: [f32; 4]| Vec4::from(pixel);
        let half = |replicate| {
            let rows = by_bands(height, |rows| replicates.half(replicate, rows).into_iter().map(pixel));
            Grid::from_rows(width, height, rows).ok_or_else(|| out_of_memory(size))
        };
        Ok(Self([half(0)?, half(1)?]))
    }
}

/// View of a picture that is denoised once.
pub struct FilteredView<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub film: &'a FilmSpec,
}

impl FilteredView<'_> {
    /// Traces the feature buffers and denoises the picture of these sums. If some of the samples were kept `apart`, also estimates the
    /// error of the denoised picture.
    ///
    /// # Errors
    ///
    /// If memory runs out, and those of Open Image Denoise.
    pub fn filter(
        &self,
        replicates: &Replicates,
        apart: Option<&SamplesApart>,
        data: &FilmData,
        kind: Denoise,
        oidn: OidnOptions,
    ) -> Result<(FilteredPicture, Option<ErrorEstimate>), ClientError> {
        let filter = ViewFilter::new(self.scene, self.camera, self.film, &|| false);
        let mut filter = filter.ok_or_else(|| out_of_memory(replicates.size()))?.with_oidn(oidn);
        let picture =
            FilteredPicture::of(replicates, &HalfMeans::of(replicates)?, Some(data), &mut filter, kind)?;
        let error = match apart {
            Some(apart) => filtered_error(replicates, apart, &mut filter, kind, &|| false)?,
            None => None,
        };
        Ok((picture, error))
    }
}

/// Error of the denoised picture of these sums, estimated from the samples kept `apart`. `None` if there are too few, and when cancelled
/// because the render `is_over`.
///
/// # Errors
///
/// If memory runs out, and when Open Image Denoise fails.
pub fn filtered_error(
    replicates: &Replicates,
    apart: &SamplesApart,
    filter: &mut ViewFilter,
    kind: Denoise,
    is_over: &dyn Fn() -> bool,
) -> Result<Option<ErrorEstimate>, ClientError> {
    let mut filtered: [Vec<[f32; 3]>; 2] = Default::default();
    for (replicate, filtered) in filtered.iter_mut().enumerate() {
        let alone = apart.alone(replicates, replicate).filter(|_| !is_over());
        let Some(alone) = alone else { return Ok(None) };
        let picture = FilteredPicture::of(&alone, &HalfMeans::of(&alone)?, None, filter, kind)?;
        *filtered = picture.xyz().pixels().iter().map(|xyz| linear_rgb(*xyz)).collect();
    }
    let size @ [_, height] = replicates.size();
    if is_over() {
        return Ok(None);
    }
    let film = [0, 1].map(|half| {
        by_bands(height, |rows| {
            let pixels = replicates.half_on_film(half, rows);
            pixels.into_iter().map(|[x, y, z, _]| linear_rgb(Vec3::new(x, y, z)))
        })
    });
    let halves = FilteredHalves {
        film: film.each_ref().map(Vec::as_slice),
        filtered: filtered.each_ref().map(Vec::as_slice),
    };
    Ok(halves.error(size))
}

/// Note to the user when the error of the denoised picture is unknown only because no samples were kept apart.
pub const UNKNOWN_FILTERED_ERROR: &str = "note: the error of the filtered picture is not stated: it is estimated from two parts of the samples (two states, or \
     before and after --resume), each with at least a fifth of them";

fn linear_rgb(xyz: Vec3) -> [f32; 3] {
    (Profile::srgb().from_xyz * xyz).to_array()
}

/// A denoised picture, scene-linear XYZ.
#[derive(Clone)]
pub struct FilteredPicture(Arc<Grid<Vec3>>);

impl FilteredPicture {
    /// Denoises a picture whose samples are given as per-pixel sums (`replicates`) and as means (`halves`). `data`: sums of the film of the
    /// same samples; if given, sub-pixel detail is taken from them.
    ///
    /// # Errors
    ///
    /// If memory runs out, and when Open Image Denoise fails.
    pub fn of(
        replicates: &Replicates,
        halves: &HalfMeans,
        data: Option<&FilmData>,
        filter: &mut ViewFilter,
        kind: Denoise,
    ) -> Result<Self, ClientError> {
        let filtered = filter.filtered(halves.0.each_ref(), kind)?;
        let told = (samples_per_pixel(replicates) / TOLD_FROM - 1.0).clamp(0.0, 1.0);
        let film = data.map(FilmPicture::of_film);
        let mut picture = as_on_film(&filtered, replicates, film.as_ref());
        if told > 0.0 {
            let film = film.or_else(|| FilmPicture::of_pixels(replicates));
            picture = picture
                .zip(film)
                .and_then(|(picture, film)| nearer_to_film(&picture, replicates, &film, told));
        }
        picture.map(Self::from).ok_or_else(|| out_of_memory(replicates.size()))
    }

    /// The picture, scene-linear XYZ.
    pub fn xyz(&self) -> &Grid<Vec3> {
        &self.0
    }

    /// The picture as a viewer shows it, in 8 bits.
    pub fn display(&self, settings: &Settings) -> Result<DisplayImage> {
        ReferenceFilm::show(&self.0, settings).into_diagnostic()
    }

    /// Channels of linear Rec.709 for an EXR file.
    pub fn channels(&self) -> Vec<Channel> {
        let from_xyz = Profile::srgb().from_xyz;
        let channel = |c: usize| self.0.pixels().iter().map(|xyz| (from_xyz * *xyz)[c]).collect();
        ["denoised.R", "denoised.G", "denoised.B"]
            .into_iter()
            .enumerate()
            .map(|(c, name)| (name.to_owned(), channel(c)))
            .collect()
    }
}

impl From<Grid<Vec3>> for FilteredPicture {
    fn from(xyz: Grid<Vec3>) -> Self {
        Self(Arc::new(xyz))
    }
}

/// The unfiltered picture.
enum FilmPicture<'a> {
    /// Sums of the film.
    Film { data: &'a FilmData, light_scale: f32 },
    /// If those are unknown: per-pixel sums convolved with the film's filter, `[X, Y, Z]` as means, and the weight.
    Pixels(Grid<Vec4>),
}

impl<'a> FilmPicture<'a> {
    fn of_film(data: &'a FilmData) -> Self {
        Self::Film { data, light_scale: data.counts.light_scale(data.width, data.height) }
    }

    /// `None` unless all pixels are present.
    fn of_pixels(replicates: &Replicates) -> Option<Self> {
        let [width, height] = replicates.size();
        let pixels = by_bands(height, |rows| replicates.whole(rows).into_iter().map(Vec4::from));
        Grid::from_rows(width, height, pixels).map(Self::Pixels)
    }

    /// X, Y, Z of pixel `i`; `None` if it has no samples.
    fn xyz(&self, i: usize) -> Option<Vec3> {
        let xyz = match self {
            Self::Film { data, light_scale } => {
                let seen = data.camera.get(i).map_or(Vec3::ZERO, |[x, y, z, w]| Vec3::new(*x, *y, *z) / *w);
                let [x, y, z, _] = data.light.get(i).copied().unwrap_or_default();
                seen + Vec3::new(x, y, z) * *light_scale
            }
            Self::Pixels(pixels) if pixels.pixels()[i].w > 0.0 => pixels.pixels()[i].truncate(),
            Self::Pixels(_) => return None,
        };
        Some(xyz).filter(|xyz| xyz.is_finite())
    }
}

fn samples_per_pixel(replicates: &Replicates) -> f32 {
    let [width, height] = replicates.size();
    replicates.paths() as f32 / (width * height) as f32
}

/// Width of the border, in pixels, into which samples from outside the picture reach.
const BORDER: usize = 3;

/// Samples per pixel from which on samples outside the border outweigh their absence.
const ENOUGH_BEYOND: f32 = 1.0;

/// Convolves the denoised per-pixel picture with the film's filter. Sub-pixel detail of the film is added in proportion to the correlation
/// of both halves, so that a picture without noise equals that of the film. Along the border the film includes samples from outside the
/// picture and the halves do not: there the film's weight grows with the number of samples.
fn as_on_film(
    filtered: &Filtered,
    replicates: &Replicates,
    film: Option<&FilmPicture<'_>>,
) -> Option<Grid<Vec3>> {
    let [width, height] = replicates.size();
    let per_pixel = samples_per_pixel(replicates);
    let share_beyond = per_pixel / (per_pixel + ENOUGH_BEYOND);
    let band = |rows: Range<usize>| {
        let near = SmoothingKernel::near(&rows, height);
        let sharp = &filtered.picture.pixels()[near.start * width..near.end * width];
        let sharp: Vec<_> = sharp.iter().map(|xyz| xyz.extend(1.0).to_array()).collect();
        let inside = rows.start - near.start..rows.end - near.start;
        // Outside the picture there are no samples: normalising by the weight inside keeps the edge from darkening.
        let smooth = replicates.kernel().rows(&sharp, [width, near.len()], inside);
        let whole = film.map(|_| replicates.whole(rows.clone()));
        let pixel = move |(place, [x, y, z, w]): (usize, [f32; 4])| {
            let smooth = Vec3::new(x, y, z) / w;
            let i = rows.start * width + place;
            let on_film = film.and_then(|film| film.xyz(i));
            let (Some(on_film), Some(whole)) = (on_film, &whole) else { return smooth };
            let detail = on_film - Vec4::from(whole[place]).truncate();
            let [x, y] = [i % width, i / width];
            let to_border = x.min(y).min(width - 1 - x).min(height - 1 - y);
            let beyond = if to_border < BORDER { share_beyond } else { 0.0 };
            let sharp = smooth + detail * filtered.finest.pixels()[i].max(beyond);
            // With few samples, film and per-pixel picture may differ by more than the value itself.
            if sharp.y < 0.0 { smooth } else { sharp }
        };
        smooth.into_iter().enumerate().map(pixel)
    };
    Grid::from_rows(width, height, by_bands(height, band))
}

/// Samples per pixel from which on the noise of a block is estimated; from twice as many on, the estimate has full weight.
const TOLD_FROM: f32 = 0.5;

/// Side of a block, pixels.
const BLOCK: usize = 8;

/// Relative differences use at least this fraction of the picture's mean luminance.
const DARK: f32 = 0.1;

/// Samples per pixel at which half of the noise variance is discounted: a filter keeps some of the noise, so it removes less than there is.
const HALF_KEPT: f32 = 64.0;

/// Restores in each block what the filter removed beyond noise. With D the mean squared difference of film and denoised picture, and V the
/// variance of the film estimated from both halves (discounted as the number of samples grows), the film gets the weight max(0, 1 − V/D)
/// (James and Stein 1961). Hence a picture without noise equals that of the film. `told`: confidence in the noise estimate of a block, 0 to
/// 1.
fn nearer_to_film(
    filtered: &Grid<Vec3>,
    replicates: &Replicates,
    film: &FilmPicture<'_>,
    told: f32,
) -> Option<Grid<Vec3>> {
    let [width, height] = replicates.size();
    let mean =
        filtered.pixels().iter().map(|xyz| xyz.y.max(0.0)).sum::<f32>() / filtered.pixels().len() as f32;
    let counts = HALF_KEPT / (HALF_KEPT + samples_per_pixel(replicates));
    let columns = width.div_ceil(BLOCK);
    let block_row = |row: usize| {
        let rows = row * BLOCK..((row + 1) * BLOCK).min(height);
        let [a, b] = [0, 1].map(|half| replicates.half_on_film(half, rows.clone()));
        let mut sums = vec![Vec2::ZERO; columns];
        for (place, (a, b)) in a.iter().zip(&b).enumerate() {
            let i = rows.start * width + place;
            let Some(on_film) = film.xyz(i).filter(|_| a[3] > 0.0 && b[3] > 0.0) else { continue };
            let y = filtered.pixels()[i].y;
            let scale = 1.0 / (y * y + (DARK * mean).powi(2)).max(f32::MIN_POSITIVE);
            let difference = (on_film.y - y).powi(2);
            let variance = 0.25 * (a[1] - b[1]).powi(2);
            sums[place % width / BLOCK] += scale * Vec2::new(difference, variance);
        }
        sums
    };
    let blocks: Vec<Vec2> = (0..height.div_ceil(BLOCK)).into_par_iter().flat_map_iter(block_row).collect();
    let blocks = Grid::from_rows(columns, height.div_ceil(BLOCK), blocks)?;
    // Between blocks, D and V are interpolated rather than the weight: next to a block that the filter harms the weight would be large.
    let share = |pixel| match between(&blocks, pixel) {
        Vec2 { x: difference, y: variance } if difference > 0.0 => {
            told * (1.0 - counts * variance / difference).max(0.0)
        }
        _ => 0.0,
    };
    let mut nearer = Grid::try_filled(width, height, Vec3::ZERO)?;
    nearer.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, out) in row.iter_mut().enumerate() {
            let own = filtered.at(x, y);
            *out = film.xyz(y * width + x).map_or(own, |on_film| own.lerp(on_film, share([x, y])));
        }
    });
    Some(nearer)
}

/// Bilinear interpolation at a pixel between block centres.
fn between(blocks: &Grid<Vec2>, pixel: [usize; 2]) -> Vec2 {
    let size = [blocks.width(), blocks.height()];
    let [columns, rows] = [0, 1].map(|axis| {
        let at = ((pixel[axis] as f32 + 0.5) / BLOCK as f32 - 0.5).clamp(0.0, (size[axis] - 1) as f32);
        let first = at as usize;
        [(first, 1.0 - at.fract()), ((first + 1).min(size[axis] - 1), at.fract())]
    });
    let row = |y: usize| columns.map(|(x, weight)| blocks.at(x, y) * weight).into_iter().sum::<Vec2>();
    rows.map(|(y, weight)| row(y) * weight).into_iter().sum()
}

/// Computes all rows in bands, on all threads.
fn by_bands<T: Send, I: Iterator<Item = T>>(
    height: usize,
    make: impl Fn(Range<usize>) -> I + Sync,
) -> Vec<T> {
    const ROWS: usize = 32;
    let starts: Vec<usize> = (0..height).step_by(ROWS).collect();
    let bands =
        starts.into_par_iter().map(|start| make(start..(start + ROWS).min(height)).collect::<Vec<T>>());
    bands.collect::<Vec<_>>().into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "in a test a panic is the message")]

    use super::*;
    use crate::color::Xyz;
    use crate::math::random::Random;
    use crate::stream::replicate::CHUNK;
    use crate::stream::{BLOCK_SAMPLES, PathCounts, Sample};
    use crate::tracer::features::Features;

    const SIDE: u32 = 32;

    /// Noisy samples of a bright left and a dark right half, for both replicates. `w` is 1 for camera samples and 0 for light samples.
    fn replicates(per_pixel: u64, w: f32) -> Replicates {
        let mut replicates = Replicates::new([SIDE; 2], 1.0);
        let mut random = Random(7);
        let blocks = per_pixel * u64::from(SIDE * SIDE) / BLOCK_SAMPLES as u64;
        for block in 0..blocks {
            let samples: Vec<Sample> = (0..BLOCK_SAMPLES)
                .map(|_| {
                    let uv = [random.f32(), random.f32()];
                    let y = truth(uv[0]) * 2.0 * random.f32();
                    Sample { uv, xyz: Xyz::new(y, y, y), w }
                })
                .collect();
            let [camera, light] = if w > 0.0 { [BLOCK_SAMPLES as u64, 0] } else { [0, BLOCK_SAMPLES as u64] };
            let paths = PathCounts { camera, light };
            replicates.add(block * CHUNK, paths, &samples);
        }
        replicates
    }

    fn truth(u: f32) -> f32 {
        if u < 0.5 { 2.0 } else { 0.5 }
    }

    /// Root mean square error of the restored picture, relative to the truth.
    fn error_of(picture: &Grid<Vec3>, replicates: &Replicates) -> f32 {
        let film = FilmPicture::of_pixels(replicates).unwrap();
        let nearer = nearer_to_film(picture, replicates, &film, 1.0).unwrap();
        let relative = |(i, xyz): (usize, &Vec3)| {
            let truth = truth((i as u32 % SIDE) as f32 / SIDE as f32);
            (xyz.y / truth - 1.0).powi(2)
        };
        let squares: f32 = nearer.pixels().iter().enumerate().map(relative).sum();
        (squares / (SIDE * SIDE) as f32).sqrt()
    }

    /// Without the film's sums, as when they are on a device.
    #[test]
    fn what_a_filter_has_spoilt_comes_back_and_what_it_has_cleaned_stays() {
        let grid = |of: &dyn Fn(usize) -> f32| {
            let pixels = (0..(SIDE * SIDE) as usize).map(|i| Vec3::splat(of(i % SIDE as usize)));
            Grid::from_rows(SIDE as usize, SIDE as usize, pixels.collect()).unwrap()
        };
        let clean = grid(&|x| truth(x as f32 / SIDE as f32));
        let flat = grid(&|_| 1.0);
        // The standard deviation of a sample is 0.58 of its mean.
        let noise = |per_pixel: f32| 0.58 / per_pixel.sqrt();
        let few = replicates(16, 1.0);
        assert!(error_of(&clean, &few) < 0.5 * noise(16.0), "{}", error_of(&clean, &few));
        assert!(error_of(&flat, &few) < 1.3 * noise(16.0), "{}", error_of(&flat, &few));
        let many = replicates(1024, 1.0);
        assert!(error_of(&flat, &many) < 1.05 * noise(1024.0), "{}", error_of(&flat, &many));
    }

    /// With light paths alone, pixels that none has reached are black, with or without the film's sums.
    #[test]
    fn light_paths_alone_are_a_picture() {
        for per_pixel in [1, 16, 256] {
            let replicates = replicates(per_pixel, 0.0);
            let hits = Grid::try_filled(SIDE as usize, SIDE as usize, Features::default()).unwrap();
            let mut filter = ViewFilter::of([&hits; 2], None).unwrap();
            let halves = HalfMeans::of(&replicates).unwrap();
            let picture =
                FilteredPicture::of(&replicates, &halves, None, &mut filter, Denoise::Wavelet).unwrap();
            let mean = picture.xyz().pixels().iter().map(|xyz| xyz.y).sum::<f32>() / (SIDE * SIDE) as f32;
            // A sample has mean 1.25 and standard deviation 1.68.
            let deviation = 1.68 / ((per_pixel * u64::from(SIDE * SIDE)) as f32).sqrt();
            assert!((mean - 1.25).abs() < 5.0 * deviation, "{per_pixel} per pixel: {mean} ± {deviation}");
        }
    }

    /// Per-pixel means equal those of the whole pictures of both halves.
    #[test]
    fn a_pixel_is_that_of_the_halves() {
        for w in [0.0, 1.0] {
            let replicates = replicates(2, w);
            let halves = HalfMeans::of(&replicates).unwrap().0;
            for i in 0..SIDE as usize * SIDE as usize {
                let [x, y] = [i % SIDE as usize, i / SIDE as usize];
                let sum: Vec4 = halves
                    .each_ref()
                    .map(|half| half.at(x, y))
                    .iter()
                    .map(|mean| mean * Vec4::new(mean.w, mean.w, mean.w, 1.0))
                    .sum();
                assert!(
                    sum.distance(replicates.pixel(x, y).into()) <= 1e-5 * (1.0 + sum.length()),
                    "{x}, {y}"
                );
            }
        }
    }
}
