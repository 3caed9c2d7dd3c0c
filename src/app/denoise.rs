//! The noise filter of a headless picture (`--denoise`): takes both randomisations from the observer of the error, traces the features, and filters.

use glam::{Vec3, Vec4};
use miette::{IntoDiagnostic, Result};
use rayon::prelude::*;

use super::layers::Channel;
use crate::client::reference::ReferenceFilm;
use crate::client::wavelet::{Filtered, PixelFeatures, filtered};
use crate::client::{ClientError, DisplayImage, FilmData, FilmSpec, Settings};
use crate::color::Profile;
use crate::image::Grid;
use crate::math::random::Random;
use crate::spectrum::SampledWavelengths;
use crate::study::Replicates;
use crate::tracer::features::{Features, features};
use crate::tracer::{Camera, Scene};

/// Wavelengths at which reflectances are compared: blue, green and red are among them.
const WAVELENGTHS: f32 = 0.4;

/// A filtered picture, scene-linear XYZ.
pub struct FilteredPicture(Grid<Vec3>);

impl FilteredPicture {
    /// Filters a picture by `camera`, whose film holds `data` and whose samples `replicates` holds pixel by pixel. Rays for the features, two per
    /// pixel, depend on the picture alone.
    pub fn of(
        replicates: &Replicates,
        data: &FilmData,
        scene: &Scene,
        camera: &Camera,
        film: &FilmSpec,
    ) -> Result<Self> {
        let no_memory = || ClientError::Memory {
            what: "the noise filter",
            bytes: 400 * u64::from(film.width) * u64::from(film.height),
        };
        let grid = |half: Vec<[f32; 4]>| {
            let pixels = half.into_iter().map(Vec4::from).collect();
            Grid::from_rows(film.width as usize, film.height as usize, pixels)
        };
        let [a, b] = replicates.halves().map(grid);
        let (a, b) = a.zip(b).ok_or_else(no_memory).into_diagnostic()?;
        let first = |half| first_hits(scene, camera, film, half).ok_or_else(no_memory).into_diagnostic();
        let known = [first(0)?, first(1)?];
        let filtered = filtered([&a, &b], Some(known.each_ref())).ok_or_else(no_memory).into_diagnostic()?;
        Ok(Self(as_on_film(&filtered, replicates, data, film).ok_or_else(no_memory).into_diagnostic()?))
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
fn as_on_film(
    filtered: &Filtered,
    replicates: &Replicates,
    data: &FilmData,
    film: &FilmSpec,
) -> Option<Grid<Vec3>> {
    let size = [film.width, film.height].map(|n| n as usize);
    let one = |xyz: &Vec3| xyz.extend(1.0).to_array();
    let smooth =
        replicates.kernel().apply(&filtered.picture.pixels().iter().map(one).collect::<Vec<_>>(), size);
    let light_scale = data.counts.light_scale(film.width, film.height);
    let whole = replicates.whole();
    let on_film = |i: usize| {
        let seen = data.camera.get(i).map_or(Vec3::ZERO, |[x, y, z, w]| Vec3::new(*x, *y, *z) / *w);
        seen + data.light.get(i).map_or(Vec3::ZERO, |[x, y, z, _]| Vec3::new(*x, *y, *z) * light_scale)
    };
    let pixel = |i: usize| {
        let [x, y, z, w] = smooth[i];
        let detail = on_film(i) - Vec4::from(whole[i]).truncate();
        let detail = if detail.is_finite() { detail } else { Vec3::ZERO };
        Vec3::new(x, y, z) / w + detail * filtered.finest.pixels()[i]
    };
    Grid::from_rows(size[0], size[1], (0..size[0] * size[1]).map(pixel).collect())
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
