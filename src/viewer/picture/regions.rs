//! Regions of the picture with additional samples.
//!
//! While a region is traced, nothing else is: the region has a camera with its crop window, another randomisation, and its own film, noise
//! filter and error observer. The film of the whole picture receives no samples meanwhile, so the picture outside the region stays
//! bit-identical, and the samples inside it are neither lost nor biased. Inside a region, the displayed, saved and analysed picture is the
//! weighted mean of both pictures, and of those of overlapping regions, with weights proportional to their paths per pixel: all are
//! estimates of the same picture, and the weights do not depend on sample values. Photon mapping is biased at first and begins a region
//! with a new photon map, hence with a larger bias than the picture around it. Particle tracing has no regions: its paths do not depend
//! on the camera.

use std::time::{Duration, Instant};

use glam::{DVec2, Mat3, Vec3};
use miette::{IntoDiagnostic, Result, miette};

use crate::accounting::accumulator::CheckpointPolicy;
use crate::accounting::observer::Observer;
use crate::client::film::VulkanFilm;
use crate::client::pacing::Pacer;
use crate::client::pass::compose::PictureLayer;
use crate::client::wavelet::out_of_memory;
use crate::client::{ClientError, Film, FilmData, FilmSpec, Settings, develop};
use crate::denoise::noise_filter::EpochView;
use crate::gpu::{Cmd, Gpu, Region};
use crate::image::Grid;
use crate::render::run_spec::RunSpec;
use crate::render::{method, observed};
use crate::tracer::Camera;
use crate::viewer::editor::SceneEditor;
use crate::viewer::picture::LivePicture;
use crate::viewer::session::RenderSession;
use crate::viewer::window_filter::WindowFilter;

/// Most regions of a picture, since each has images on the device.
const MOST_REGIONS: usize = 8;

/// Grid of region borders in pixels: the coarsest internal resolution of a repaint.
const GRAIN: u32 = 4;

/// Shortest side of a region, pixels.
const LEAST: u32 = 8;

/// Seeds of regions differ from that of the picture by multiples of this.
const REGION_SEED: u32 = 0x3c6e_f35f;

/// A region as it is drawn over the picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionDrawing {
    /// First pixel.
    pub origin: [u32; 2],
    /// Width and height.
    pub extent: [u32; 2],
    /// Whether the region is traced alone; otherwise it is being dragged.
    pub is_traced: bool,
    /// Paths per pixel of the region's samples.
    pub per_pixel: f64,
}

/// A region and its samples.
pub struct RegionRender {
    /// Rectangle in pixels of the picture.
    pub rectangle: Region,
    /// As the run of the whole picture, except for size, seed, and samples in order of arrival.
    run: RunSpec,
    film: VulkanFilm,
    /// Noise filter of the region.
    pub filter: WindowFilter,
    /// Estimates the error of the displayed picture in the region.
    observer: Option<Observer>,
    began: Instant,
}

/// The regions of a picture.
#[derive(Default)]
pub struct Regions {
    list: Vec<RegionRender>,
    /// Whether the last region is being traced.
    is_traced: bool,
}

/// Rectangle, in whole [`GRAIN`]s, spanned by two positions in pixels of a picture of this size.
pub fn rectangle_between(a: DVec2, b: DVec2, size: [u32; 2]) -> Region {
    let (low, high) = (a.min(b), a.max(b));
    let grain = f64::from(GRAIN);
    let axis = |i: usize| {
        let first = (low[i].clamp(0.0, f64::from(size[i])) / grain).floor() * grain;
        let end = ((high[i].clamp(0.0, f64::from(size[i])) / grain).ceil() * grain).min(f64::from(size[i]));
        [first as u32, (end - first).max(0.0) as u32]
    };
    let ([x, width], [y, height]) = (axis(0), axis(1));
    Region { origin: [x, y], extent: [width, height] }
}

impl RegionRender {
    /// The picture's camera with the region as its crop window.
    fn camera(&self, whole: Camera, size: [u32; 2]) -> Camera {
        let size = DVec2::from(size.map(f64::from));
        let [corner, part] =
            [self.rectangle.origin, self.rectangle.extent].map(|n| DVec2::from(n.map(f64::from)) / size);
        whole.cropped(corner, part)
    }

    /// Samples on the film.
    pub fn samples(&self) -> u64 {
        let counts = self.film.counts();
        counts.camera_samples + counts.light_samples
    }

    /// Takes over a denoised picture; returns whether the next repaint shows the denoised picture.
    pub fn look_at_filter(&mut self, settings: &Settings, pacer: &mut Pacer, spent: &mut Duration) -> bool {
        self.filter.prepare_for(&self.run, settings);
        if let Some(time) = self.filter.poll() {
            pacer.filtered(time);
            *spent += time;
        }
        self.filter.is_ready(&self.run, settings, self.samples())
    }

    /// Number of samples in the denoised picture, if there is one.
    pub fn filtered(&self, settings: &Settings) -> Option<u64> {
        self.filter.shown(&self.run, settings).map(|frame| frame.samples)
    }

    /// Begins to denoise the samples so far, unless a filter run is in progress.
    pub fn filter_now(&mut self) {
        if self.filter.is_busy() {
            return;
        }
        let samples = self.samples();
        let data = Some(&mut self.film).filter(|film| film.is_summed_on_host()).map(Film::develop);
        self.filter.filter(samples, data.and_then(Result::ok).into_iter().collect());
    }

    /// Consumers of the region's samples: film and observer.
    pub fn feed(&mut self) -> (&mut VulkanFilm, Option<&Observer>) {
        (&mut self.film, self.observer.as_ref())
    }

    /// Error observer of the region.
    pub fn observer(&self) -> Option<&Observer> {
        self.observer.as_ref()
    }

    /// Mutable [`observer`](Self::observer).
    pub fn observer_mut(&mut self) -> Option<&mut Observer> {
        self.observer.as_mut()
    }

    /// Picture of the region's own samples alone, scene-linear XYZ before glare and tone curve.
    fn linear(&mut self, settings: &Settings) -> Result<Grid<Vec3>, ClientError> {
        if let Some(frame) = self.filter.shown(&self.run, settings) {
            return Ok(frame.shown.xyz().clone());
        }
        let xyz = self.film.reconstruct(&settings.before_glare(), 1)?;
        let [width, height] = self.rectangle.extent.map(|n| n as usize);
        let pixels = xyz.into_iter().map(Vec3::from).collect();
        Grid::from_rows(width, height, pixels).ok_or_else(|| out_of_memory([width, height]))
    }
}

/// Paths per pixel of a film, counting paths that start within the picture.
pub fn per_pixel(film: &VulkanFilm) -> f64 {
    let spec @ FilmSpec { width, height, .. } = *film.spec();
    film.counts().paths() as f64 * spec.coverage() / (f64::from(width) * f64::from(height))
}

/// A rectangle, and the weight of a region's samples in the picture displayed there, 0 to 1.
type Share = (Region, f32);

/// Splits a rectangle with `own` paths per pixel into parts of constant weight: `whole` paths per pixel cover everything, and each of
/// `others` covers a rectangle. Parts with weight 0 are left out.
fn shares(rectangle: Region, own: f64, whole: f64, others: &[(Region, f64)]) -> Vec<Share> {
    let end = |region: &Region, axis: usize| region.origin[axis] + region.extent[axis];
    let cuts = |axis: usize| {
        let (low, high) = (rectangle.origin[axis], end(&rectangle, axis));
        let edges = others.iter().flat_map(|(other, _)| [other.origin[axis], end(other, axis)]);
        let mut cuts: Vec<u32> = edges.filter(|edge| (low..high).contains(edge)).chain([low, high]).collect();
        cuts.sort_unstable();
        cuts.dedup();
        cuts
    };
    let (columns, rows) = (cuts(0), cuts(1));
    let mut parts = Vec::new();
    for y in rows.windows(2) {
        for x in columns.windows(2) {
            let origin = [x[0], y[0]];
            let holds = |other: &Region| {
                (0..2).all(|axis| (other.origin[axis]..end(other, axis)).contains(&origin[axis]))
            };
            let there: f64 = others.iter().filter(|(other, _)| holds(other)).map(|(_, n)| n).sum();
            let share = own / (own + there + whole).max(f64::MIN_POSITIVE);
            let part = Region { origin, extent: [x[1] - x[0], y[1] - y[0]] };
            parts.extend((share > 0.0).then_some((part, share as f32)));
        }
    }
    parts
}

impl Regions {
    /// The region that is being traced.
    pub fn traced(&self) -> Option<&RegionRender> {
        self.list.last().filter(|_| self.is_traced)
    }

    /// Mutable [`traced`](Self::traced).
    pub fn traced_mut(&mut self) -> Option<&mut RegionRender> {
        self.list.last_mut().filter(|_| self.is_traced)
    }

    /// Discards all regions for another view or film. A background thread waits for filters and sums still at work.
    pub fn clear(&mut self) {
        let busy: Vec<_> = self.list.drain(..).map(|region| (region.filter, region.observer)).collect();
        self.is_traced = false;
        if !busy.is_empty() {
            let spawned = std::thread::Builder::new().name("regions".into()).spawn(move || drop(busy));
            if let Err(error) = spawned {
                tracing::warn!("no thread for what ends: {error}");
            }
        }
    }

    /// Regions that are no longer traced.
    pub fn released_mut(&mut self) -> impl Iterator<Item = &mut RegionRender> {
        let count = self.list.len() - usize::from(self.is_traced);
        self.list[..count].iter_mut()
    }

    /// All regions.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut RegionRender> {
        self.list.iter_mut()
    }

    /// Whether the film of a region has lost samples to an error.
    pub fn are_damaged(&self) -> bool {
        self.list.iter().any(|region| region.film.is_damaged())
    }

    /// Weights of each region in the displayed picture; `whole`: paths per pixel of the whole picture.
    fn shares(&self, whole: f64, settings: &Settings) -> Vec<Vec<Share>> {
        let mut others = Vec::new();
        let mut of_all = Vec::new();
        for region in &self.list {
            let own = per_pixel(&region.film);
            let mut parts = shares(region.rectangle, own, whole, &others);
            if settings.view.is_error() {
                // Variances cannot be averaged: the picture with more samples is shown.
                parts.retain_mut(|(_, share)| std::mem::replace(share, 1.0) >= 0.5);
            }
            of_all.push(parts);
            others.push((region.rectangle, own));
        }
        of_all
    }

    /// Panel data of the traced region.
    pub fn drawing(&self) -> Option<RegionDrawing> {
        let region = self.traced()?;
        let Region { origin, extent } = region.rectangle;
        Some(RegionDrawing { origin, extent, is_traced: true, per_pixel: per_pixel(&region.film) })
    }

    /// Positions and sample counts of all regions, for file metadata.
    pub fn in_words(&self) -> String {
        let words = |region: &RegionRender| {
            let Region { origin: [x, y], extent: [width, height] } = region.rectangle;
            format!("{width}×{height} at {x},{y}: {:.1} more paths per pixel", per_pixel(&region.film))
        };
        self.list.iter().map(words).collect::<Vec<_>>().join("; ")
    }

    /// Whether there are no regions.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Sum of the weights of the regions' camera samples at a pixel of the picture.
    pub fn weight_at(&mut self, pixel: [u32; 2]) -> f32 {
        let within = |region: &RegionRender| {
            let Region { origin, extent } = region.rectangle;
            (0..2).all(|i| (origin[i]..origin[i] + extent[i]).contains(&pixel[i]))
        };
        let weight = |region: &mut RegionRender| {
            let origin = region.rectangle.origin;
            region.film.weight_at([pixel[0] - origin[0], pixel[1] - origin[1]]).unwrap_or(0.0)
        };
        self.list.iter_mut().filter(|region| within(region)).map(weight).sum()
    }

    /// Whether the device has rasterised all samples of the regions.
    pub fn are_drawn(&self, gpu: &Gpu) -> bool {
        self.list.iter().all(|region| gpu.has_completed(region.film.rasterised()))
    }

    /// Rasterises the waiting samples of all regions.
    pub fn flush(&mut self) -> Result<(), ClientError> {
        self.list.iter_mut().try_for_each(|region| region.film.flush())
    }

    /// Samples rasterised by the CPU since the last call, and the time that took.
    pub fn take_host_time(&mut self) -> (u64, Duration) {
        let times = self.list.iter_mut().map(|region| region.film.take_host_time());
        times.fold((0, Duration::ZERO), |(samples, time), (more, took)| (samples + more, time + took))
    }

    /// Records the reconstruction of all regions with samples, to be composed into a picture of `whole` paths per pixel.
    pub fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        settings: &Settings,
        detail: u32,
        whole: f64,
    ) -> Result<Vec<PictureLayer<'_>>, ClientError> {
        let mut images = Vec::new();
        for (shares, region) in self.shares(whole, settings).into_iter().zip(&mut self.list) {
            if !shares.is_empty() {
                region.filter.fresh = false;
                let filtered = region
                    .filter
                    .shown(&region.run, settings)
                    .map(|frame| frame.shown.xyz())
                    .filter(|_| detail == 1);
                let origin = region.rectangle.origin;
                let xyz = region.film.linear(cmd, filtered, settings, detail)?;
                images.push(PictureLayer { xyz, origin, matrix: Mat3::IDENTITY, shares });
            }
        }
        Ok(images)
    }

    /// Blends the regions into a picture of `whole` paths per pixel, scene-linear XYZ before glare and tone curve.
    pub fn mix_into(
        &mut self,
        picture: &mut Grid<Vec3>,
        whole: f64,
        settings: &Settings,
    ) -> Result<(), ClientError> {
        let shares = self.shares(whole, settings);
        for (shares, region) in shares.into_iter().zip(&mut self.list) {
            let own = region.linear(settings)?;
            let [x0, y0] = region.rectangle.origin.map(|n| n as usize);
            let width = picture.width();
            for (part, share) in shares {
                let [x, y, columns, rows] =
                    [part.origin[0], part.origin[1], part.extent[0], part.extent[1]].map(|n| n as usize);
                for y in y..y + rows {
                    let row = &mut picture.pixels_mut()[y * width + x..][..columns];
                    for (out, x) in row.iter_mut().zip(x..) {
                        *out = out.lerp(own.at(x - x0, y - y0), share);
                    }
                }
            }
        }
        Ok(())
    }

    /// Blends the regions' sums into those of a picture of `whole` paths per pixel.
    pub fn mix_into_sums(&mut self, data: &mut FilmData, whole: f64) -> Result<(), ClientError> {
        let shares = self.shares(whole, &Settings::default());
        for (shares, region) in shares.into_iter().zip(&mut self.list) {
            let own = region.film.develop()?;
            for (part, share) in shares {
                develop::mix_region(data, &own, region.rectangle.origin, part, share);
            }
        }
        Ok(())
    }
}

impl LivePicture {
    /// The region that is being traced.
    pub fn region(&self) -> Option<Region> {
        self.regions.traced().map(|region| region.rectangle)
    }

    /// Excludes a pause of this length from the times of the observers.
    pub fn stood_still(&mut self, time: Duration) {
        if let Some(region) = self.regions.traced_mut() {
            region.began += time;
            region.observer.iter_mut().for_each(|observer| observer.stood_still(time));
        }
        let of_eyes = self.observer.iter_mut().chain(&mut self.right_observer);
        of_eyes.for_each(|observer| observer.stood_still(time));
    }

    /// Restricts tracing to this rectangle of the picture.
    ///
    /// # Errors
    ///
    /// If the rectangle is too small, device memory does not suffice, or the method cannot trace regions.
    pub fn begin_region(
        &mut self,
        rectangle: Region,
        session: &mut RenderSession,
        view: EpochView,
        editor: &SceneEditor,
        settings: &Settings,
    ) -> Result<()> {
        let method = session.run_spec().integrator;
        if let [false, _] = method.streams() {
            return Err(miette!(
                "{} cannot be kept to a region: its paths begin at the lights; choose another method on the tab Render",
                method.traits().title
            ));
        }
        self.sharpen().into_diagnostic()?;
        if rectangle.extent.iter().any(|side| *side < LEAST) {
            return Err(miette!(
                "a region has {LEAST} pixels or more along each side: drag a larger rectangle"
            ));
        }
        if self.mix.is_on() {
            return Err(miette!(
                "a region has no pictures of groups of lights: end the light mix first (Ctrl+L)"
            ));
        }
        if self.regions.list.len() == MOST_REGIONS {
            return Err(miette!(
                "{MOST_REGIONS} regions of this view have samples of their own already: move the camera or change something to begin anew"
            ));
        }
        let last = self.regions.is_traced;
        self.end_region(session, editor)?;
        let Some(screen) = &self.screen else { return Err(miette!("there is no window yet")) };
        let whole = session.run_spec();
        let number = self.regions.list.len() as u32 + 1;
        let film = FilmSpec { width: rectangle.extent[0], height: rectangle.extent[1], ..whole.film };
        let run = RunSpec {
            film,
            seed: whole.seed ^ REGION_SEED.wrapping_mul(number) & 0x7fff_ffff,
            deterministic: false,
            ..whole.clone()
        };
        let observe = || observed::observe(&run, Some(self.target()), CheckpointPolicy::WhenIdle);
        let mut region = RegionRender {
            rectangle,
            film: screen.new_film(film).into_diagnostic()?,
            filter: WindowFilter::new(session.tracers.threads()),
            observer: run.replicated.then(observe).transpose()?,
            run,
            began: Instant::now(),
        };
        let camera = region.camera(view.camera, session.size());
        let device = self.gpu().filter(|_| !region.film.is_summed_on_host()).cloned();
        let witnesses = method::witnesses(&region.run, &view.scene, &camera);
        if let Some((observer, witnesses)) = region.observer.as_ref().zip(witnesses) {
            observer.call(witnesses);
        }
        let view = EpochView { camera: camera.clone(), ..view };
        let account = region.observer.as_ref().map(Observer::account);
        region.filter.start_anew(&region.run, account, view, settings, device.as_ref());
        session.trace_region(editor, &region.run, camera)?;
        if let Some((whole, own)) = self.observer.as_ref().zip(region.observer.as_ref()) {
            let [origin, extent] = [rectangle.origin, rectangle.extent].map(|pair| pair.map(|n| n as usize));
            // The samples of the last region are accounted for first.
            match self.regions.list.last().and_then(|last| last.observer.as_ref()).filter(|_| last) {
                Some(last) => last.ask_for(origin, extent, whole, own),
                None => whole.share_shown(origin, extent, own),
            }
        }
        self.regions.list.push(region);
        (self.regions.is_traced, self.running) = (true, true);
        self.shown_anew();
        Ok(())
    }

    /// Releases the traced region: its samples stay in the picture, and the render continues with the whole picture. Returns whether a
    /// region was traced.
    pub fn end_region(&mut self, session: &mut RenderSession, editor: &SceneEditor) -> Result<bool> {
        let Some(region) = self.regions.traced() else { return Ok(false) };
        let lasted = region.began.elapsed();
        if let Some((whole, own)) = self.observer.as_mut().zip(region.observer.as_ref()) {
            whole.stood_still(lasted);
            own.share_own(whole, region.rectangle.origin.map(i64::from));
        }
        self.regions.is_traced = false;
        session.resume(editor, lasted)?;
        self.running = true;
        self.shown_anew();
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn region(x: u32, y: u32, width: u32, height: u32) -> Region {
        Region { origin: [x, y], extent: [width, height] }
    }

    /// Overlapping regions are weighted by their paths in the mean of all, composed one after the other.
    #[test]
    fn overlapping_regions_have_the_shares_of_their_paths() {
        let regions =
            [(region(8, 8, 24, 16), 2000.0), (region(16, 0, 24, 16), 50.0), (region(8, 8, 24, 16), 10.0)];
        let whole = 16.0;
        let mut weights = vec![[0.0f64; 4]; 48 * 32];
        weights.iter_mut().for_each(|weight| weight[0] = 1.0);
        for (i, (rectangle, own)) in regions.iter().enumerate() {
            let mut drawn = [0; 48 * 32];
            for (part, share) in shares(*rectangle, *own, whole, &regions[..i]) {
                for y in part.origin[1]..part.origin[1] + part.extent[1] {
                    for x in part.origin[0]..part.origin[0] + part.extent[0] {
                        let place = (y * 48 + x) as usize;
                        drawn[place] += 1;
                        weights[place].iter_mut().for_each(|weight| *weight *= 1.0 - f64::from(share));
                        weights[place][i + 1] += f64::from(share);
                    }
                }
            }
            let holds = |place: usize| {
                let at = [place as u32 % 48, place as u32 / 48];
                (0..2).all(|a| {
                    (rectangle.origin[a]..rectangle.origin[a] + rectangle.extent[a]).contains(&at[a])
                })
            };
            assert!((0..48 * 32).all(|place| drawn[place] == i32::from(holds(place))), "region {i}");
        }
        for (place, weights) in weights.iter().enumerate() {
            let at = [place as u32 % 48, place as u32 / 48];
            let there = |(rectangle, own): &(Region, f64)| {
                let inside = (0..2).all(|a| {
                    (rectangle.origin[a]..rectangle.origin[a] + rectangle.extent[a]).contains(&at[a])
                });
                if inside { *own } else { 0.0 }
            };
            let paths: Vec<f64> = std::iter::once(whole).chain(regions.iter().map(there)).collect();
            let sum: f64 = paths.iter().sum();
            for (weight, paths) in weights.iter().zip(&paths) {
                assert!((weight - paths / sum).abs() < 1e-6, "{at:?}: {weights:?} of {paths:?}");
            }
        }
        assert!(shares(region(0, 0, 8, 8), 0.0, whole, &[]).is_empty());
        assert_eq!(shares(region(0, 0, 8, 8), 1.0, 0.0, &[]), [(region(0, 0, 8, 8), 1.0)]);
    }

    #[test]
    fn rectangles_lie_on_the_grain_and_in_the_picture() {
        let between = |a: [f64; 2], b: [f64; 2]| rectangle_between(a.into(), b.into(), [101, 67]);
        assert_eq!(between([13.2, 9.9], [30.1, 20.0]), region(12, 8, 20, 12));
        assert_eq!(between([30.1, 20.0], [13.2, 9.9]), region(12, 8, 20, 12));
        assert_eq!(between([-50.0, 60.0], [500.0, 400.0]), region(0, 60, 101, 7));
        assert_eq!(between([200.0, 200.0], [300.0, 300.0]).extent, [1, 3]);
    }
}
