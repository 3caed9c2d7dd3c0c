//! The noise filter of a displayed picture (`--denoise`): traces the features, and filters both randomisations with them.

use std::ops::Range;

use glam::{Vec3, Vec4};
use miette::{IntoDiagnostic, Result};
use rayon::prelude::*;

use super::layers::Channel;
use crate::client::reference::ReferenceFilm;
use crate::client::wavelet::{Filtered, PixelFeatures, WaveletFilter};
use crate::client::{ClientError, DisplayImage, FilmData, FilmSpec, Settings};
use crate::color::Profile;
use crate::image::Grid;
use crate::math::random::Random;
use crate::spectrum::SampledWavelengths;
use crate::study::{Replicates, SmoothingKernel};
use crate::tracer::features::{Features, features};
use crate::tracer::{Camera, Scene};

/// Wavelengths at which reflectances are compared: blue, green and red are among them.
const WAVELENGTHS: f32 = 0.4;

/// The noise filter of pictures of one view, with the features of what they show.
pub struct ViewFilter(WaveletFilter);

impl ViewFilter {
    /// Traces the features, two rays per pixel, which depend on the picture alone. `None` without memory, and where `stop` says so in between.
    pub fn new(
        scene: &Scene,
        camera: &Camera,
        film: &FilmSpec,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let map = |half| first_hits(scene, camera, film, half, stop);
        let (a, b) = (map(0)?, map(1)?);
        if stop() {
            return None;
        }
        WaveletFilter::new([film.width, film.height].map(|n| n as usize), Some([&a, &b])).map(Self)
    }
}

/// A filtered picture, scene-linear XYZ.
pub struct FilteredPicture(Grid<Vec3>);

impl FilteredPicture {
    /// Filters a picture whose samples `replicates` holds pixel by pixel. `data` is what the film holds of the same samples: where it is given,
    /// details within pixels are those of the film. `None` without memory.
    pub fn of(replicates: &Replicates, data: Option<&FilmData>, filter: &mut ViewFilter) -> Option<Self> {
        let [width, height] = replicates.size();
        let half = |replicate| {
            let pixel = |pixel: [f32; 4]| Vec4::from(pixel);
            Grid::from_rows(
                width,
                height,
                by_bands(height, |rows| replicates.half(replicate, rows).into_iter().map(pixel)),
            )
        };
        let filtered = filter.0.filtered([&half(0)?, &half(1)?])?;
        Some(Self(as_on_film(&filtered, replicates, data)?))
    }

    /// The error where there was no memory for it.
    pub fn out_of_memory(film: &FilmSpec) -> ClientError {
        let bytes = 400 * u64::from(film.width) * u64::from(film.height);
        ClientError::Memory { what: "the noise filter", bytes }
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

/// What one ray per pixel meets first; the rest is empty once it is told to stop.
fn first_hits(
    scene: &Scene,
    camera: &Camera,
    film: &FilmSpec,
    half: u64,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Grid<PixelFeatures>> {
    let (width, height) = (film.width as usize, film.height as usize);
    let lambda = SampledWavelengths::sample(WAVELENGTHS);
    let mut grid = Grid::try_filled(width, height, PixelFeatures::default())?;
    grid.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        if stop() {
            return;
        }
        for (x, out) in row.iter_mut().enumerate() {
            let mut random = Random(half << 62 | (y as u64) << 31 | x as u64);
            let uv = [(x as f64 + random.f64()) / width as f64, (y as f64 + random.f64()) / height as f64];
            let ray = camera.ray(uv, [random.f32(), random.f32()]);
            let Features { albedo, normal, distance } = features(scene, ray, &lambda);
            *out = PixelFeatures { albedo, normal, distance };
        }
    });
    Some(grid)
}
