//! Regions of the picture that were given samples of their own.
//!
//! While a region is traced, the tracer sees nothing but it: a camera with that crop window, another randomisation, a film, a noise
//! filter and an observer of the error of its own. The film of the whole picture gets no sample meanwhile, so that what lies outside
//! stays as it is bit for bit, and what it has inside is neither lost nor biased. Shown, saved and stated is, inside, the mean of both
//! pictures, each with the share of its paths per pixel: both are estimates of the same picture, and shares depend on no sample's value.

use std::time::{Duration, Instant};

use glam::{DVec2, Mat3, Vec3};
use miette::{IntoDiagnostic, Result, miette};

use super::LivePicture;
use crate::app::noise_filter::EpochView;
use crate::app::observer::{Beside, Observer};
use crate::app::run_spec::RunSpec;
use crate::app::view::editor::SceneEditor;
use crate::app::view::light_mix::LightMix;
use crate::app::view::session::RenderSession;
use crate::app::view::window_filter::WindowFilter;
use crate::client::film::VulkanFilm;
use crate::client::pacing::Pacer;
use crate::client::pass::compose::PictureLayer;
use crate::client::reference::ReferenceFilm;
use crate::client::wavelet::out_of_memory;
use crate::client::window::panel::RegionDrawing;
use crate::client::{ClientError, DisplayImage, Film, FilmCounts, FilmData, FilmSpec, Settings, develop};
use crate::gpu::{Cmd, Gpu, Region};
use crate::image::Grid;
use crate::stream::{PathCounts, Sample};
use crate::study::ErrorTarget;
use crate::tracer::Camera;

/// Regions that a picture has at most: each has images on the device.
const MOST_REGIONS: usize = 8;

/// Regions begin and end at multiples of this, which is the coarsest internal resolution of a repaint.
const GRAIN: u32 = 4;

/// Pixels of the shorter side of a region at least.
const LEAST: u32 = 8;

/// Regions have seeds that differ from that of the picture by multiples of this.
const REGION_SEED: u32 = 0x3c6e_f35f;

/// A region, and the samples of its own.
pub struct RegionRender {
    /// Where it lies in the picture, pixels.
    pub rectangle: Region,
    /// How it is traced: as the whole picture, but for size and seed.
    run: RunSpec,
    film: VulkanFilm,
    filter: WindowFilter,
    /// States the error of what is shown of it.
    observer: Option<Observer>,
    began: Instant,
}

/// The regions of a picture.
#[derive(Default)]
pub struct Regions {
    list: Vec<RegionRender>,
    /// The last one is being traced.
    is_traced: bool,
}

/// The rectangle of a picture of this size, in whole [`GRAIN`]s, between two places in pixels.
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
    /// The part of the picture's camera that sees the region.
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

    /// Its part of what is shown, beside a picture of this number of paths per pixel.
    fn share(&self, whole: f64) -> f32 {
        let own = per_pixel(&self.film);
        if own > 0.0 { (own / (own + whole)) as f32 } else { 0.0 }
    }

    /// Takes over a picture that was filtered; returns whether the next one is to be shown through the filter.
    pub fn look_at_filter(&mut self, settings: &Settings, pacer: &mut Pacer, spent: &mut Duration) -> bool {
        self.filter.choose(settings);
        if let Some(time) = self.filter.poll() {
            pacer.filtered(time);
            *spent += time;
        }
        self.filter.is_ready(&self.run, settings, self.samples())
    }

    /// The number of samples in the filtered picture, if there is one.
    pub fn filtered(&self, settings: &Settings) -> Option<u64> {
        self.filter.shown(&self.run, settings).map(|frame| frame.samples)
    }

    /// The filter of its picture.
    pub fn filter(&mut self) -> &mut WindowFilter {
        &mut self.filter
    }

    /// Begins to filter the samples so far, unless it is filtering.
    pub fn filter_now(&mut self) {
        if self.filter.is_busy() {
            return;
        }
        let samples = self.samples();
        let data = Some(&mut self.film).filter(|film| film.is_summed_on_host()).map(Film::develop);
        self.filter.filter(samples, data.and_then(Result::ok));
    }

    /// The film, the observer and the filter that its samples go to.
    pub fn feed(&mut self) -> (&mut VulkanFilm, Option<&Observer>, &WindowFilter) {
        (&mut self.film, self.observer.as_ref(), &self.filter)
    }

    /// States its error.
    pub fn observer(&self) -> Option<&Observer> {
        self.observer.as_ref()
    }

    /// The picture of its own samples alone, scene-linear XYZ before glare and tone curve, as these settings show it.
    fn linear(&mut self, settings: &Settings) -> Result<Grid<Vec3>, ClientError> {
        if let Some(frame) = self.filter.shown(&self.run, settings) {
            return Ok(frame.shown.xyz().clone());
        }
        let settings = Settings { glare: None, ..settings.clone() };
        let xyz = self.film.reconstruct(&settings, 1)?;
        let [width, height] = self.rectangle.extent.map(|n| n as usize);
        let pixels = xyz.into_iter().map(Vec3::from).collect();
        Grid::from_rows(width, height, pixels).ok_or_else(|| out_of_memory([width, height]))
    }
}

/// Paths per pixel of a film.
pub fn per_pixel(film: &VulkanFilm) -> f64 {
    let FilmSpec { width, height, .. } = *film.spec();
    film.counts().paths() as f64 / (f64::from(width) * f64::from(height))
}

impl Regions {
    /// The region that is being traced.
    pub fn traced(&self) -> Option<&RegionRender> {
        self.list.last().filter(|_| self.is_traced)
    }

    /// As [`traced`](Self::traced), to be changed.
    pub fn traced_mut(&mut self) -> Option<&mut RegionRender> {
        self.list.last_mut().filter(|_| self.is_traced)
    }

    /// Forgets all of them: another view, or another film.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// What the panel shows of the one that is being traced.
    pub fn drawing(&self) -> Option<RegionDrawing> {
        let region = self.traced()?;
        let Region { origin, extent } = region.rectangle;
        Some(RegionDrawing { origin, extent, is_traced: true, per_pixel: per_pixel(&region.film) })
    }

    /// Where they lie, and how many samples of their own they have.
    pub fn in_words(&self) -> String {
        let words = |region: &RegionRender| {
            let Region { origin: [x, y], extent: [width, height] } = region.rectangle;
            format!("{width}×{height} at {x},{y}: {:.1} more paths per pixel", per_pixel(&region.film))
        };
        self.list.iter().map(words).collect::<Vec<_>>().join("; ")
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The sum of the weights of their camera samples at a pixel of the picture.
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

    /// Whether the device has drawn all of their samples.
    pub fn are_drawn(&self, gpu: &Gpu) -> bool {
        self.list.iter().all(|region| gpu.has_completed(region.film.rasterised()))
    }

    /// Rasterises what waits.
    pub fn flush(&mut self) -> Result<(), ClientError> {
        self.list.iter_mut().try_for_each(|region| region.film.flush())
    }

    /// Samples that the processor has drawn since the last call, and how long that took.
    pub fn take_host_time(&mut self) -> (u64, Duration) {
        let times = self.list.iter_mut().map(|region| region.film.take_host_time());
        times.fold((0, Duration::ZERO), |(samples, time), (more, took)| (samples + more, time + took))
    }

    /// Records the pictures of those that have samples, to be drawn into a picture of `whole` paths per pixel.
    pub fn record(
        &mut self,
        cmd: &mut Cmd<'_>,
        settings: &Settings,
        detail: u32,
        whole: f64,
    ) -> Result<Vec<PictureLayer<'_>>, ClientError> {
        let mut images = Vec::new();
        for region in &mut self.list {
            let share = shown_share(region.share(whole), settings);
            if share > 0.0 {
                region.filter.is_seen();
                let filtered = region
                    .filter
                    .shown(&region.run, settings)
                    .map(|frame| frame.shown.xyz())
                    .filter(|_| detail == 1);
                let origin = region.rectangle.origin;
                let xyz = region.film.linear(cmd, filtered, settings, detail)?;
                images.push(PictureLayer { xyz, origin, matrix: Mat3::IDENTITY, share });
            }
        }
        Ok(images)
    }
}

/// The share with which a region is drawn: where variance is shown there is no mean, and the one counts that has more samples.
fn shown_share(share: f32, settings: &Settings) -> f32 {
    if settings.view.is_error() { share.round() } else { share }
}

/// The film of a picture together with its regions, or with the mix of its lights, for what is saved.
pub struct ComposedFilm<'a> {
    pub film: &'a mut VulkanFilm,
    pub regions: &'a mut Regions,
    pub mix: &'a mut LightMix,
}

impl ComposedFilm<'_> {
    /// Mixes the regions into a picture, scene-linear XYZ before glare and tone curve.
    pub fn mix_into(&mut self, picture: &mut Grid<Vec3>, settings: &Settings) -> Result<(), ClientError> {
        let whole = per_pixel(self.film);
        for region in &mut self.regions.list {
            let share = shown_share(region.share(whole), settings);
            if share == 0.0 {
                continue;
            }
            let own = region.linear(settings)?;
            let [x0, y0] = region.rectangle.origin.map(|n| n as usize);
            let width = picture.width();
            for (y, row) in own.pixels().chunks_exact(own.width()).enumerate() {
                let start = (y0 + y) * width + x0;
                for (out, xyz) in picture.pixels_mut()[start..].iter_mut().zip(row) {
                    *out = out.lerp(*xyz, share);
                }
            }
        }
        Ok(())
    }
}

impl Film for ComposedFilm<'_> {
    fn add(&mut self, samples: &[Sample]) -> Result<(), ClientError> {
        self.film.add(samples)
    }

    fn count_paths(&mut self, paths: PathCounts) {
        self.film.count_paths(paths);
    }

    fn flush(&mut self) -> Result<(), ClientError> {
        self.film.flush()?;
        self.regions.flush()
    }

    fn clear(&mut self) {
        self.film.clear();
        self.regions.clear();
    }

    fn keep_batch(&mut self, keep: bool) {
        self.film.keep_batch(keep);
    }

    fn counts(&self) -> FilmCounts {
        self.film.counts()
    }

    fn display(&mut self, settings: &Settings) -> Result<DisplayImage, ClientError> {
        let is_composed = !self.regions.is_empty() || self.mix.is_mixing();
        if settings.view.is_error() || !is_composed {
            return self.film.display(settings);
        }
        let FilmSpec { width, height, .. } = *self.film.spec();
        if self.mix.is_mixing() {
            return ReferenceFilm::show(&self.mix.linear(settings, [width, height])?, settings);
        }
        let linear = self.film.reconstruct(&Settings { glare: None, ..settings.clone() }, 1)?;
        let pixels = linear.into_iter().map(Vec3::from).collect();
        let size = [width as usize, height as usize];
        let picture = Grid::from_rows(size[0], size[1], pixels);
        let mut picture = picture.ok_or_else(|| out_of_memory(size))?;
        self.mix_into(&mut picture, settings)?;
        ReferenceFilm::show(&picture, settings)
    }

    fn develop(&mut self) -> Result<FilmData, ClientError> {
        let mut data = self.film.develop()?;
        let whole = per_pixel(self.film);
        for region in &mut self.regions.list {
            let share = region.share(whole);
            if share > 0.0 {
                develop::mix_region(&mut data, &region.film.develop()?, region.rectangle.origin, share);
            }
        }
        Ok(data)
    }
}

impl LivePicture {
    /// The region that is being traced.
    pub fn region(&self) -> Option<Region> {
        self.regions.traced().map(|region| region.rectangle)
    }

    /// States the error of what is being traced: a region, or the whole picture.
    pub fn present_observer(&self) -> Option<&Observer> {
        match self.regions.traced() {
            Some(region) => region.observer(),
            None => self.observer.as_ref(),
        }
    }

    /// Traces this rectangle of the picture and nothing else.
    ///
    /// # Errors
    ///
    /// Where it is too small, has no room on the device, or cannot be traced.
    pub fn begin_region(
        &mut self,
        rectangle: Region,
        session: &mut RenderSession,
        view: EpochView,
        editor: &SceneEditor,
        settings: &Settings,
        target: ErrorTarget,
    ) -> Result<()> {
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
        let observe = || Observer::start(&run, Some(target), Beside::Window);
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
        let view = EpochView { camera: camera.clone(), ..view };
        region.filter.start_anew(&region.run, view, settings, device);
        session.trace_region(editor, &region.run, camera)?;
        if let Some((whole, own)) = self.observer.as_ref().zip(region.observer.as_ref()) {
            whole.lend_shown(rectangle, own);
        }
        self.regions.list.push(region);
        self.regions.is_traced = true;
        self.shown_anew();
        Ok(())
    }

    /// Releases the region that is traced: what was found of it stays in the picture, and the render goes on with the whole of it. Returns
    /// whether there was one.
    pub fn end_region(&mut self, session: &mut RenderSession, editor: &SceneEditor) -> Result<bool> {
        let Some(region) = self.regions.traced() else { return Ok(false) };
        let lasted = region.began.elapsed();
        if let Some((whole, own)) = self.observer.as_mut().zip(region.observer.as_ref()) {
            whole.stood_still(lasted);
            own.lend_own(whole, region.rectangle.origin.map(i64::from));
        }
        self.regions.is_traced = false;
        session.resume(editor, lasted)?;
        self.running = true;
        self.shown_anew();
        Ok(true)
    }
}
