//! The noise filter of one view (`--denoise`): traces the feature buffers, and denoises both randomisations with them.

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
use crate::stream::UvWindow;
use crate::tracer::accel::Ray;
use crate::tracer::features::{Features, features};
use crate::tracer::medium::CameraMedium;
use crate::tracer::{Camera, Scene};

/// Offset of the wavelength sample: with it, the first three wavelengths are blue, green and red.
const WAVELENGTHS: f32 = 0.15;

/// Noise filter of pictures of one view, with its feature buffers.
pub struct ViewFilter {
    features: [Grid<PixelFeatures>; 2],
    oidn: OidnOptions,
    /// Device for wavelets; `None` for the CPU.
    device: Option<Arc<Gpu>>,
    /// Filter of the last view, if its memory may be reused.
    last: Option<KindFilter>,
    filter: Option<KindFilter>,
}

/// Options of Open Image Denoise.
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
    /// Wavelets on a device.
    OnDevice(Box<WaveletPass>),
    Oidn(OidnFilter),
}

impl ViewFilter {
    /// Traces the features, two rays per pixel, which do not depend on samples. `None` if memory runs out, and when cancelled by `stop`.
    pub fn new(
        scene: &Scene,
        camera: &Camera,
        film: &FilmSpec,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Self> {
        let map = |half| first_hits(scene, camera, film, FeatureGrid { half, step: 1 }, stop);
        Self::of([&map(0)?, &map(1)?], None)
    }

    /// Filter of a view with these [`first_hits`], reusing the memory of the `last` view's. `None` if memory runs out.
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

    /// As `self`, with these options for Open Image Denoise.
    pub fn with_oidn(self, oidn: OidnOptions) -> Self {
        Self { oidn, ..self }
    }

    /// As `self`, with wavelets on this device as long as that works; on the CPU if `None`.
    pub fn on_device(self, device: Option<Arc<Gpu>>) -> Self {
        Self { device, ..self }
    }

    /// Does the per-view work of a filter of this kind, once.
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

    /// The wavelet filter, on the device if there is one with enough memory.
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

    /// Denoises a picture, given as its halves, with a filter of this kind.
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

/// Checks that a filter of this kind is available.
///
/// # Errors
///
/// When Open Image Denoise is not installed; the help says how to get it.
pub fn check(kind: Denoise) -> Result<()> {
    if kind != Denoise::Oidn {
        return Ok(());
    }
    let advice = format!("{}. Or take `--denoise wavelet`, which needs nothing", oidn::HOW_TO_GET);
    oidn::library().map(|_| ()).map_err(|error| miette::miette!(help = advice, "--denoise oidn: {error}"))
}

/// Name of the filter for the user, with the version of a foreign library.
pub fn name(kind: Denoise) -> String {
    let library = if kind == Denoise::Oidn { oidn::library().ok() } else { None };
    let version = library.map(|library| format!(" {}", library.version()));
    kind.name() + &version.unwrap_or_default()
}

/// A grid of primary rays for feature buffers.
#[derive(Clone, Copy, Debug)]
pub struct FeatureGrid {
    /// Which of two independent sets of rays, 0 or 1.
    pub half: u64,
    /// Pixels between neighbouring rays, per axis.
    pub step: usize,
}

impl FeatureGrid {
    /// The ray in column `x` and row `y` of the grid over a picture of this size; `None` where the lens shows nothing.
    pub fn ray(self, camera: &Camera, [x, y]: [usize; 2], size: [usize; 2]) -> Option<Ray> {
        let mut random = Random(self.half << 62 | (y as u64) << 31 | x as u64);
        let mut along = |at: usize, size: usize| (at as f64 + random.f64()) * self.step as f64 / size as f64;
        let uv = [along(x, size[0]), along(y, size[1])];
        camera.ray(uv, [random.f32(), random.f32()])
    }
}

/// First hits of the rays of a grid, and the media before them; `None` if memory runs out, and when cancelled by `stop`.
pub fn first_hits(
    scene: &Scene,
    camera: &Camera,
    film: &FilmSpec,
    rays: FeatureGrid,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Grid<Features>> {
    let size = [film.width as usize, film.height as usize];
    let [width, height] = size.map(|n| n.div_ceil(rays.step));
    let (lambda, medium) =
        (SampledWavelengths::sample(WAVELENGTHS), CameraMedium::of(scene, camera, &UvWindow::PICTURE));
    let mut grid = Grid::try_filled(width, height, Features::default())?;
    grid.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        if stop() {
            return;
        }
        for (x, out) in row.iter_mut().enumerate() {
            let Some(ray) = rays.ray(camera, [x, y], size) else { continue };
            *out = features(scene, ray, medium.along(scene, &ray), &lambda);
        }
    });
    (!stop()).then_some(grid)
}
