//! The noise filter of a displayed picture (`--denoise`): traces the features, and filters both randomisations with them.

use std::sync::Arc;

use glam::Vec3Swizzles;
use miette::Result;
use rayon::prelude::*;

use crate::client::oidn::{self, OidnFilter, OidnQuality};
use crate::client::pass::wavelet::WaveletPass;
use crate::client::wavelet::{Filtered, HalfPicture, PixelFeatures, WaveletFilter, out_of_memory};
use crate::client::{ClientError, Denoise, FilmSpec, OptionNames};
use crate::gpu::Gpu;
use crate::image::Grid;
use crate::math::random::Random;
use crate::spectrum::SampledWavelengths;
use crate::tracer::accel::Ray;
use crate::tracer::features::{Features, features};
use crate::tracer::{Camera, Scene};

/// Where wavelengths begin: the first three of them are blue, green and red.
const WAVELENGTHS: f32 = 0.15;

/// The noise filter of pictures of one view, with the features of what they show.
pub struct ViewFilter {
    features: [Grid<PixelFeatures>; 2],
    oidn: OidnOptions,
    /// Where wavelets are computed, unless that is the processor.
    device: Option<Arc<Gpu>>,
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
    /// The same on a device.
    OnDevice(Box<WaveletPass>),
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
        Some(Self { features, oidn: OidnOptions::default(), device: None, last, filter: None })
    }

    /// The same, with Open Image Denoise working so where it is asked for.
    pub fn with_oidn(self, oidn: OidnOptions) -> Self {
        Self { oidn, ..self }
    }

    /// The same, with wavelets computed on this device as long as that works, or on the processor.
    pub fn on_device(self, device: Option<Arc<Gpu>>) -> Self {
        Self { device, ..self }
    }

    /// Does what the filter of this kind does once per view, if it was not done yet.
    pub fn prepare(&mut self, kind: Denoise) -> Result<(), ClientError> {
        let is_oidn = |filter: &KindFilter| matches!(filter, KindFilter::Oidn(_));
        let made = self.filter.take().filter(|made| is_oidn(made) == (kind == Denoise::Oidn));
        self.filter = Some(match made {
            Some(made) => made,
            None if kind == Denoise::Oidn => {
                let OidnOptions { threads, quality } = self.oidn;
                KindFilter::Oidn(OidnFilter::new(self.size(), self.features.each_ref(), threads, quality)?)
            }
            None => self.wavelets()?,
        });
        Ok(())
    }

    /// The wavelet filter, on the device if there is one that can hold it.
    fn wavelets(&mut self) -> Result<KindFilter, ClientError> {
        let last = self.last.take();
        if let Some(device) = &self.device {
            let last = match last {
                Some(KindFilter::OnDevice(last)) => Some(*last),
                _ => None,
            };
            match WaveletPass::after(last, device, self.features.each_ref()) {
                Ok(pass) => return Ok(KindFilter::OnDevice(Box::new(pass))),
                Err(error) => self.leave_device(&error),
            }
            return self.wavelets();
        }
        let last = match last {
            Some(KindFilter::Wavelet(last)) => Some(*last),
            _ => None,
        };
        let filter = WaveletFilter::after(last, self.size(), Some(self.features.each_ref()));
        Ok(KindFilter::Wavelet(Box::new(filter.ok_or_else(|| out_of_memory(self.size()))?)))
    }

    fn leave_device(&mut self, error: &ClientError) {
        tracing::warn!("pictures of this view are filtered on the processor: {error}");
        self.device = None;
    }

    fn size(&self) -> [usize; 2] {
        [self.features[0].width(), self.features[0].height()]
    }

    /// Filters a picture, given as its halves, by a filter of this kind.
    pub fn filtered(&mut self, halves: [&HalfPicture; 2], kind: Denoise) -> Result<Filtered, ClientError> {
        self.prepare(kind)?;
        let filtered = match &mut self.filter {
            Some(KindFilter::Wavelet(filter)) => filter.filtered(halves),
            Some(KindFilter::OnDevice(pass)) => match pass.filtered(halves) {
                Ok(filtered) => Some(filtered),
                Err(error) => {
                    self.leave_device(&error);
                    self.filter = None;
                    return self.filtered(halves, kind);
                }
            },
            Some(KindFilter::Oidn(filter)) => Some(filter.filtered(halves)?),
            None => None,
        };
        filtered.ok_or_else(|| out_of_memory(self.size()))
    }
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
