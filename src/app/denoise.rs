//! The noise filter of a headless picture (`--denoise`): keeps both halves of the samples apart, traces the features, and filters.

use miette::{IntoDiagnostic, Result};
use rayon::prelude::*;

use super::layers::Channel;
use crate::client::halves::Halves;
use crate::client::reference::ReferenceFilm;
use crate::client::wavelet::{PixelFeatures, filtered};
use crate::client::{ClientError, DisplayImage, FilmSpec, Settings};
use crate::color::Profile;
use crate::image::Grid;
use crate::math::random::Random;
use crate::spectrum::SampledWavelengths;
use crate::study::SmoothingKernel;
use crate::tracer::features::{Features, features};
use crate::tracer::{Camera, Scene};

/// Wavelengths at which reflectances are compared: blue, green and red are among them.
const WAVELENGTHS: f32 = 0.4;

/// A filtered picture, scene-linear XYZ.
pub struct FilteredPicture(Grid<glam::Vec3>);

impl FilteredPicture {
    /// Filters what the halves hold of a picture by `camera`. Rays for the features, two per pixel, depend on the picture alone.
    pub fn of(halves: &Halves, scene: &Scene, camera: &Camera, film: &FilmSpec) -> Result<Self> {
        let no_memory = || ClientError::Memory {
            what: "the noise filter",
            bytes: 400 * u64::from(film.width) * u64::from(film.height),
        };
        let [a, b] = halves.pictures().ok_or_else(no_memory).into_diagnostic()?;
        let first = |half| first_hits(scene, camera, film, half).ok_or_else(no_memory).into_diagnostic();
        let known = [first(0)?, first(1)?];
        let picture = filtered([&a, &b], Some(known.each_ref())).ok_or_else(no_memory).into_diagnostic()?;
        Ok(Self(as_on_film(&picture, film).ok_or_else(no_memory).into_diagnostic()?))
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

/// The picture of whole pixels as the film's filter would have made it.
fn as_on_film(picture: &Grid<glam::Vec3>, film: &FilmSpec) -> Option<Grid<glam::Vec3>> {
    let size = [picture.width(), picture.height()];
    let pixels: Vec<[f32; 4]> = picture.pixels().iter().map(|xyz| xyz.extend(1.0).to_array()).collect();
    let smooth = SmoothingKernel::of_energy(film.filter.energy()).apply(&pixels, size);
    Grid::from_rows(
        size[0],
        size[1],
        smooth.iter().map(|[x, y, z, w]| glam::Vec3::new(*x, *y, *z) / *w).collect(),
    )
}

/// What one ray per pixel meets first.
fn first_hits(scene: &Scene, camera: &Camera, film: &FilmSpec, half: u64) -> Option<Grid<PixelFeatures>> {
    let (width, height) = (film.width as usize, film.height as usize);
    let lambda = SampledWavelengths::sample(WAVELENGTHS);
    let mut grid = Grid::try_filled(width, height, PixelFeatures::default())?;
    grid.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
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
