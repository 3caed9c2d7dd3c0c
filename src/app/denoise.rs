//! The noise filter of a displayed picture (`--denoise`): traces the features, and filters both randomisations with them.

use std::ops::Range;
use std::sync::Arc;

use glam::{Vec3, Vec3Swizzles, Vec4};
use miette::{IntoDiagnostic, Result};
use rayon::prelude::*;

use super::layers::Channel;
use crate::client::oidn::{self, OidnFilter, OidnQuality};
use crate::client::reference::ReferenceFilm;
use crate::client::wavelet::{Filtered, HalfPicture, PixelFeatures, WaveletFilter};
use crate::client::{ClientError, Denoise, DisplayImage, FilmData, FilmSpec, OptionNames, Settings};
use crate::color::Profile;
use crate::image::Grid;
use crate::math::random::Random;
use crate::spectrum::SampledWavelengths;
use crate::study::{Replicates, SmoothingKernel};
use crate::tracer::accel::Ray;
use crate::tracer::features::{Features, features};
use crate::tracer::{Camera, Scene};

/// Where wavelengths begin: the first three of them are blue, green and red.
const WAVELENGTHS: f32 = 0.15;

/// The noise filter of pictures of one view, with the features of what they show.
pub struct ViewFilter {
    features: [Grid<PixelFeatures>; 2],
    oidn: OidnOptions,
    /// That of the last view, if its memory may serve again.
    last: Option<KindFilter>,
    filter: Option<KindFilter>,
}

/// How Open Image Denoise works, where it is asked for.
#[derive(Clone, Copy, Debug)]
pub struct OidnOptions {
    pub threads: usize,
    pub quality: OidnQuality,
}

impl Default for OidnOptions {
    fn default() -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Self { threads, quality: OidnQuality::High }
    }
}

/// A filter of one kind.
enum KindFilter {
    Wavelet(Box<WaveletFilter>),
    Oidn(OidnFilter),
}

impl ViewFilter {
    /// Traces the features, two rays per pixel, which depend on the picture alone. `None` without memory, and where `stop` says so in between.
    pub fn new(
        scene: &Scene,
        camera: &Camera,
        film: &FilmSpec,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let map = |half| first_hits(scene, camera, film, FeatureGrid { half, step: 1 }, stop);
        Self::of([&map(0)?, &map(1)?], None)
    }

    /// The filter of a view with these [`first_hits`]; the memory of that of the `last` view serves again. `None` without memory.
    pub fn of(hits: [&Grid<Features>; 2], last: Option<Self>) -> Option<Self> {
        let pixel = |&Features { albedo, normal, distance, emits, .. }: &Features| PixelFeatures {
            albedo: albedo.zyx(),
            normal,
            distance,
            emits,
        };
        let map = |hits: &Grid<Features>| {
            Grid::from_rows(hits.width(), hits.height(), hits.pixels().iter().map(pixel).collect())
        };
        let last = last.and_then(|last| last.filter);
        let features = [map(hits[0])?, map(hits[1])?];
        Some(Self { features, oidn: OidnOptions::default(), last, filter: None })
    }

    /// The same, with Open Image Denoise working so where it is asked for.
    pub fn with_oidn(self, oidn: OidnOptions) -> Self {
        Self { oidn, ..self }
    }

    /// Does what the filter of this kind does once per view, if it was not done yet.
    pub fn prepare(&mut self, kind: Denoise) -> Result<(), ClientError> {
        let features = self.features.each_ref();
        let size = [features[0].width(), features[0].height()];
        let OidnOptions { threads, quality } = self.oidn;
        let filter = match (self.filter.take(), kind) {
            (Some(filter @ KindFilter::Oidn(_)), Denoise::Oidn) => filter,
            (_, Denoise::Oidn) => KindFilter::Oidn(OidnFilter::new(size, features, threads, quality)?),
            (Some(filter @ KindFilter::Wavelet(_)), _) => filter,
            _ => {
                let last = match self.last.take() {
                    Some(KindFilter::Wavelet(last)) => Some(*last),
                    _ => None,
                };
                let filter = WaveletFilter::after(last, size, Some(features));
                KindFilter::Wavelet(Box::new(filter.ok_or_else(|| out_of_memory(size))?))
            }
        };
        self.filter = Some(filter);
        Ok(())
    }

    /// Filters a picture, given as its halves, by a filter of this kind.
    fn filtered(&mut self, halves: [&HalfPicture; 2], kind: Denoise) -> Result<Filtered, ClientError> {
        self.prepare(kind)?;
        let filtered = match &mut self.filter {
            Some(KindFilter::Wavelet(filter)) => filter.filtered(halves),
            Some(KindFilter::Oidn(filter)) => Some(filter.filtered(halves)?),
            None => None,
        };
        filtered.ok_or_else(|| out_of_memory([halves[0].width(), halves[0].height()]))
    }
}

/// The error where there was no memory for a filter of pictures of this size.
pub fn out_of_memory(size: [usize; 2]) -> ClientError {
    let bytes = 400 * (size[0] * size[1]) as u64;
    ClientError::Memory { what: "the noise filter", bytes }
}

/// Makes sure that a filter of this kind can be had.
///
/// # Errors
///
/// When it is Open Image Denoise, and that is not there; the help says how to get it.
pub fn check(kind: Denoise) -> Result<()> {
    if kind != Denoise::Oidn {
        return Ok(());
    }
    let advice = format!("{}. Or take `--denoise wavelet`, which needs nothing", oidn::HOW_TO_GET);
    oidn::library().map(|_| ()).map_err(|error| miette::miette!(help = advice, "--denoise oidn: {error}"))
}

/// The filter of this kind in words, with its version where it is not ours.
pub fn name(kind: Denoise) -> String {
    let library = if kind == Denoise::Oidn { oidn::library().ok() } else { None };
    let version = library.map(|library| format!(" {}", library.version()));
    kind.name() + &version.unwrap_or_default()
}

/// Means X, Y, Z of the samples in each pixel, with their number, of both randomisations.
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

    /// The sum of all samples in a pixel, and their number.
    pub fn sum(&self, x: usize, y: usize) -> Vec4 {
        let seen = self.0.each_ref().map(|half| half.at(x, y)).into_iter().filter(|half| half.w > 0.0);
        seen.map(|half| (half.truncate() * half.w).extend(half.w)).sum()
    }
}

/// A filtered picture, scene-linear XYZ.
#[derive(Clone)]
pub struct FilteredPicture(Arc<Grid<Vec3>>);

impl FilteredPicture {
    /// Filters a picture whose samples `replicates` holds pixel by pixel, and `halves` as means. `data` is what the film holds of the same
    /// samples: where it is given, details within pixels are those of the film.
    ///
    /// # Errors
    ///
    /// Without memory, and when Open Image Denoise fails.
    pub fn of(
        replicates: &Replicates,
        halves: &HalfMeans,
        data: Option<&FilmData>,
        filter: &mut ViewFilter,
        kind: Denoise,
    ) -> Result<Self, ClientError> {
        let filtered = filter.filtered(halves.0.each_ref(), kind)?;
        let picture = as_on_film(&filtered, replicates, data).map(Self::from);
        picture.ok_or_else(|| out_of_memory(replicates.size()))
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

/// The filtered picture of whole pixels as the film's filter would have made it. What the film knows beyond whole pixels counts as much
/// as the halves agree on what differs from pixel to pixel, so that a picture without noise is that of the film.
fn as_on_film(filtered: &Filtered, replicates: &Replicates, data: Option<&FilmData>) -> Option<Grid<Vec3>> {
    let [width, height] = replicates.size();
    let light_scale = data.map_or(0.0, |data| data.counts.light_scale(data.width, data.height));
    let on_film = |data: &FilmData, i: usize| {
        let seen = data.camera.get(i).map_or(Vec3::ZERO, |[x, y, z, w]| Vec3::new(*x, *y, *z) / *w);
        seen + data.light.get(i).map_or(Vec3::ZERO, |[x, y, z, _]| Vec3::new(*x, *y, *z) * light_scale)
    };
    let band = |rows: Range<usize>| {
        let near = SmoothingKernel::near(&rows, height);
        let sharp = &filtered.picture.pixels()[near.start * width..near.end * width];
        let sharp: Vec<_> = sharp.iter().map(|xyz| xyz.extend(1.0).to_array()).collect();
        let inside = rows.start - near.start..rows.end - near.start;
        // Beyond the picture there is nothing: divided by the weight that lies within, the edge is no darker.
        let smooth = replicates.kernel().rows(&sharp, [width, near.len()], inside);
        let whole = data.map(|_| replicates.whole(rows.clone()));
        let pixel = move |(place, [x, y, z, w]): (usize, [f32; 4])| {
            let smooth = Vec3::new(x, y, z) / w;
            let (Some(data), Some(whole)) = (data, &whole) else { return smooth };
            let i = rows.start * width + place;
            let detail = on_film(data, i) - Vec4::from(whole[place]).truncate();
            let detail = if detail.is_finite() { detail } else { Vec3::ZERO };
            let sharp = smooth + detail * filtered.finest.pixels()[i];
            // Where samples are few, film and whole pixels may differ by more than there is.
            if sharp.y < 0.0 { smooth } else { sharp }
        };
        smooth.into_iter().enumerate().map(pixel)
    };
    Grid::from_rows(width, height, by_bands(height, band))
}

/// What is made of all rows, band by band on all threads.
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

/// Rays for features over a picture.
#[derive(Clone, Copy, Debug)]
pub struct FeatureGrid {
    /// One of two sets of independent rays.
    pub half: u64,
    /// Pixels from one ray to the next, per axis.
    pub step: usize,
}

impl FeatureGrid {
    /// The ray at column `x` and row `y` of the grid over a picture of this size.
    pub fn ray(self, camera: &Camera, [x, y]: [usize; 2], size: [usize; 2]) -> Ray {
        let mut random = Random(self.half << 62 | (y as u64) << 31 | x as u64);
        let mut along = |at: usize, size: usize| (at as f64 + random.f64()) * self.step as f64 / size as f64;
        let uv = [along(x, size[0]), along(y, size[1])];
        camera.ray(uv, [random.f32(), random.f32()])
    }
}

/// What the rays of a grid meet first; `None` without memory, and where `stop` says so in between.
pub fn first_hits(
    scene: &Scene,
    camera: &Camera,
    film: &FilmSpec,
    rays: FeatureGrid,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Grid<Features>> {
    let size = [film.width as usize, film.height as usize];
    let [width, height] = size.map(|n| n.div_ceil(rays.step));
    let lambda = SampledWavelengths::sample(WAVELENGTHS);
    let mut grid = Grid::try_filled(width, height, Features::default())?;
    grid.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        if stop() {
            return;
        }
        for (x, out) in row.iter_mut().enumerate() {
            *out = features(scene, rays.ray(camera, [x, y], size), &lambda);
        }
    });
    (!stop()).then_some(grid)
}
