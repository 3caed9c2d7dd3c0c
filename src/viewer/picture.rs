//! The picture in the window: screen with film, retained samples (to fill another film), frame pacing, and the observer of the error.

mod accounts;
mod backup;
mod feed;
mod frames;
pub mod output;
pub mod regions;

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::Result;

use crate::accounting::accumulator::CheckpointPolicy;
use crate::accounting::observer::Observer;
use crate::client::film::VulkanFilm;
use crate::client::light_meter::LightMeter;
use crate::client::pacing::Pacer;
use crate::client::pass::repaint::ShownTexels;
use crate::client::retained::{RETAINED_SAMPLES, RetainedSamples};
use crate::client::{ClientError, Film, FilmCounts, FilmSpec, Settings};
use crate::denoise::noise_filter::EpochView;
use crate::gpu::{FrameNumber, Gpu, Region};
use crate::image::stereo::Eye;
use crate::render::figures::human;
use crate::render::light_groups::{GroupFilms, GroupMemory};
use crate::render::observed;
use crate::render::run_spec::RunSpec;
use crate::scene::light_groups::LightGroup;
use crate::study::{ErrorQuantile, ErrorTarget};
use crate::viewer::editor::SceneEditor;
use crate::viewer::light_mix::LightMix;
use crate::viewer::picture::backup::SumsBackup;
use crate::viewer::picture::regions::Regions;
use crate::viewer::screen::Screen;
use crate::viewer::session::RenderSession;
use crate::viewer::window_filter::WindowFilter;

/// Frame length if neither the command line nor the display specifies one.
const DEFAULT_BUDGET: Duration = Duration::from_micros(16_667);

/// The last repaint of the picture.
struct LastRepaint {
    at: Instant,
    /// Samples on the film at that time.
    samples: u64,
    /// Internal resolution: picture pixels per reconstructed pixel and axis.
    detail: u32,
}

/// Settings, film and detail of a painted picture.
#[derive(Clone)]
pub struct Painted {
    pub settings: Settings,
    pub film: FilmSpec,
    /// Whether it had a right eye.
    pub has_right_eye: bool,
    /// Picture pixels per reconstructed pixel and axis.
    pub detail: u32,
}

impl Painted {
    /// Whether it was painted from such a film with these settings. The exposure, which auto-exposure changes, does not count.
    pub fn is_of(&self, film: &FilmSpec, settings: &Settings) -> bool {
        let exposure = self.settings.exposure;
        self.film == *film && self.settings == Settings { exposure, ..settings.clone() }
    }
}

/// A frame submitted to the device.
pub struct ShownFrame {
    pub number: FrameNumber,
    pub began: Instant,
    /// Samples on the film.
    pub samples: u64,
    /// Internal resolution of the repaint; `None` if the last picture was shown again.
    pub detail: Option<u32>,
    /// Whether it shows a denoised picture.
    pub filtered: bool,
}

/// The picture: film, screen, retained samples, pacing, observer.
pub struct LivePicture {
    /// The window with the film; `None` until the window is open.
    pub screen: Option<Screen>,
    /// Samples of the present epoch, to fill another film.
    kept: RetainedSamples,
    /// Copy in memory of the sums on the device, made once the film has more samples than are retained.
    backup: SumsBackup,
    /// Divides the time of a frame between its tasks.
    pub pacer: Pacer,
    /// Estimates the error, if the render is divided into replicates; of two eyes that of the left one's picture.
    pub observer: Option<Observer>,
    /// The same for the right one's.
    right_observer: Option<Observer>,
    /// Regions with samples in addition to those of the whole picture.
    pub regions: Regions,
    /// Light mix: films of light groups.
    pub mix: LightMix,
    /// Noise filter of the displayed picture.
    pub filter: WindowFilter,
    /// Light meter of auto-exposure, fed with the samples on the film.
    meter: LightMeter,
    /// Time spent filtering since it was last read.
    filter_time: Duration,
    last_edit: Instant,
    last_repaint: LastRepaint,
    /// No picture of the present epoch has been shown yet.
    unseen: bool,
    /// The picture must be repainted from the same samples.
    repaint: bool,
    /// The window must be redrawn, even with the same picture.
    show: bool,
    /// The window is known to be hidden: nothing is drawn until it is resized or shown.
    hidden: bool,
    /// Camera samples of the present epoch are weighted by their density.
    steered: bool,
    /// The render has not ended; once it has, all of its samples must be shown.
    running: bool,
    /// Samples added to films since the start; retained ones count again for every film they fill.
    pub rasterised: u64,
    /// Samples taken by the loop since this was last read, and the time that took, batches included.
    fed: (u64, Duration),
    /// The last picture at full detail; before the first of these, the last picture.
    pub painted: Option<Painted>,
    /// Errors since the last repaint that neither film nor settings caused.
    failures: u32,
    /// Samples on the film of the lost device.
    lost: u64,
    /// Message to the user about samples that were dropped.
    dropped: Option<String>,
}

/// Most samples of a stream while sums are coarse. All of them must be retained, so this leaves room for both streams and those of the same
/// frame.
const MOST_COARSE: u64 = RETAINED_SAMPLES as u64 / 4;

/// Initial error target.
const TARGET: ErrorTarget = ErrorTarget { error: 0.01, at: ErrorQuantile::P95 };

/// Number of such errors after which the picture freezes; before that the frame is retried.
const FAILURES: u32 = 2;

impl LivePicture {
    /// A picture without a window, for this many tracer threads. Starts the observer if the render is divided into replicates.
    pub fn new(run: &RunSpec, budget: Option<Duration>, threads: usize) -> Result<Self> {
        let observe = || observed::observe(run, Some(TARGET), CheckpointPolicy::WhenIdle);
        let now = Instant::now();
        Ok(Self {
            screen: None,
            kept: RetainedSamples::default(),
            backup: SumsBackup::default(),
            pacer: Pacer::new(budget.unwrap_or(DEFAULT_BUDGET)),
            observer: run.replicated.then(observe).transpose()?,
            right_observer: None,
            regions: Regions::default(),
            mix: LightMix::default(),
            filter: WindowFilter::new(threads),
            meter: LightMeter::default(),
            filter_time: Duration::ZERO,
            last_edit: now,
            last_repaint: LastRepaint { at: now, samples: 0, detail: 1 },
            unseen: false,
            repaint: true,
            show: true,
            hidden: false,
            steered: false,
            running: true,
            rasterised: 0,
            fed: (0, Duration::ZERO),
            painted: None,
            failures: 0,
            lost: 0,
            dropped: None,
        })
    }

    /// The device.
    pub fn gpu(&self) -> Option<&Arc<Gpu>> {
        self.screen.as_ref().and_then(Screen::gpu)
    }

    fn film(&self) -> Option<&VulkanFilm> {
        self.screen.as_ref().and_then(Screen::film)
    }

    fn film_mut(&mut self) -> Option<&mut VulkanFilm> {
        self.screen.as_mut().and_then(Screen::film_mut)
    }

    /// Length of a frame.
    pub fn budget(&self) -> Duration {
        self.pacer.budget()
    }

    /// Samples and paths on the film.
    pub fn counts(&self) -> FilmCounts {
        self.film().map(VulkanFilm::counts).unwrap_or_default()
    }

    /// Samples on the film of the lost device, while there is no other; 0 otherwise.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Whether the film holds coarse sums.
    pub fn is_coarse(&self) -> bool {
        self.film().is_some_and(VulkanFilm::is_coarse)
    }

    /// Samples on the film.
    fn samples(&self) -> u64 {
        self.counts().samples()
    }

    /// Samples of the present render: of a region, or of the whole picture.
    fn traced_samples(&self) -> u64 {
        self.regions.traced().map_or_else(|| self.samples(), |region| region.samples())
    }

    /// Repaints for another subject of tracing and resets the rate at which samples grow.
    fn shown_anew(&mut self) {
        self.last_repaint.samples = 0;
        (self.repaint, self.show) = (true, true);
    }

    /// Internal resolution of the last repaint.
    pub fn detail(&self) -> u32 {
        self.last_repaint.detail
    }

    /// Notes an edit of scene or camera.
    pub fn edited(&mut self, now: Instant) {
        self.last_edit = now;
    }

    /// Time since the last edit.
    pub fn since_edit(&self) -> Duration {
        self.last_edit.elapsed()
    }

    /// Exposure metered from the samples; `None` while there are too few.
    pub fn metered(&self) -> Option<f32> {
        self.meter.exposure()
    }

    /// Requests a repaint with another exposure.
    pub fn expose(&mut self) {
        self.repaint = true;
    }

    /// Asks for the picture to be painted anew from the same samples.
    pub fn request_repaint(&mut self) {
        (self.repaint, self.failures) = (true, 0);
    }

    /// Reverts to the film of `run`, because the device cannot hold the requested one; returns whether the film has to be created again.
    pub fn go_back(&mut self, run: &RunSpec) -> Result<bool, ClientError> {
        self.failures = 0;
        self.refit(run)
    }

    /// Records an error that neither film nor settings caused. Returns whether the picture is frozen from now on.
    pub fn note_failure(&mut self) -> bool {
        self.failures += 1;
        self.repaint &= !self.is_frozen();
        self.is_frozen()
    }

    /// Whether the picture is frozen after repeated errors of the device, until something changes.
    pub fn is_frozen(&self) -> bool {
        self.failures >= FAILURES
    }

    /// Refills the film if it has lost samples to an error.
    pub fn mend(&mut self, run: &RunSpec) {
        let samples = self.samples();
        if let Some(film) = self.film_mut().filter(|film| film.is_damaged()) {
            film.clear();
            self.refill(run, "the film was filled anew after an error of the device", samples);
        }
    }

    /// Asks for the window to be drawn, even with the same picture.
    pub fn request_show(&mut self) {
        self.show = true;
    }

    /// Notes that the window is not visible.
    pub fn hide(&mut self) {
        self.hidden = true;
    }

    /// Whether a visible window waits for the first picture of the epoch.
    pub fn awaits_first_picture(&self) -> bool {
        self.unseen && !self.hidden
    }

    /// Whether the present epoch was shown.
    pub fn is_seen(&self) -> bool {
        !self.unseen
    }

    /// Whether the film has all kept samples and the window shows them.
    pub fn is_settled(&self) -> bool {
        let filtering = self.filter.is_busy() || self.filter.fresh;
        self.kept.caught_up() && !(self.unseen || self.repaint || self.show || filtering)
    }

    /// Whether there is a window whose device has completed all work that the next frame depends on.
    pub fn is_idle(&mut self) -> bool {
        let Self { screen: Some(screen), regions, mix, .. } = self else { return false };
        let are_drawn = |gpu: &Arc<Gpu>| regions.are_drawn(gpu) && mix.are_drawn(gpu);
        screen.is_idle() && (screen.leads() || screen.gpu().is_none_or(are_drawn))
    }

    /// Clears film and retained samples for another epoch with the view of each eye. The old picture stays on screen until the new one is ready.
    ///
    /// # Errors
    ///
    /// When the system gives no thread for the accounts of the right eye.
    pub fn begin_epoch(
        &mut self,
        session: &RenderSession,
        views: Vec<EpochView>,
        settings: &Settings,
    ) -> Result<()> {
        let run = session.run_spec();
        self.kept.begin(run.eyes());
        self.backup.clear();
        self.meter.clear();
        self.regions.clear();
        self.mix.begin_epoch();
        self.begin_accounts(run, &views)?;
        self.filter.begin_epoch(run, views, settings, session.steerable());
        (self.unseen, self.running, self.failures, self.steered) = (true, true, 0, false);
        // The message about samples of the previous film no longer matters.
        self.dropped = None;
        // Coarse sums are used while few samples are expected: all of them are retained, so that full sums can be made later. In index
        // order the sums must be those of whole batches, so none are coarse.
        let coarse = !run.deterministic && VulkanFilm::coarse_samples(&run.film) <= MOST_COARSE;
        if let Some(film) = self.film_mut()
            && (!coarse || film.begin_coarsely().is_err())
        {
            film.clear();
        }
        Ok(())
    }

    /// Replaces the film if its size or filter differs from the present; returns whether it did. The new film is filled from the retained
    /// samples, whose positions are resolution-independent. Without a device, the next one gets the film.
    ///
    /// # Errors
    ///
    /// Those of a film, and [`GpuError::Memory`](crate::gpu::GpuError::Memory) if the device is known to have no room for it; the old film
    /// stays then.
    pub fn refit(&mut self, run: &RunSpec) -> Result<bool, ClientError> {
        let both_eyes = run.stereo.is_some();
        let is_right = |film: &VulkanFilm| *film.spec() == run.film && film.has_right_eye() == both_eyes;
        if self.gpu().is_none() || self.film().is_some_and(is_right) {
            return Ok(false);
        }
        let samples = self.samples();
        let settings = self.painted.as_ref().map(|painted| painted.settings.clone()).unwrap_or_default();
        let Some(screen) = &mut self.screen else { return Ok(false) };
        screen.check_room(&run.film, both_eyes, &settings)?;
        screen.replace_film(run.film, both_eyes)?;
        self.rewind(run);
        self.tell_what_is_kept("the film is made anew", samples, self.kept.len() as u64);
        self.remake_groups(run)?;
        Ok(true)
    }

    /// Notes a message if fewer than `samples` of a picture were carried over.
    fn tell_what_is_kept(&mut self, why: &str, samples: u64, kept: u64) {
        if kept < samples {
            let (samples, kept) = (human(samples as f64), human(kept as f64));
            self.dropped = Some(format!("{why}, with {kept} of its {samples} samples: no more were kept"));
        }
    }

    /// Takes the messages to the user since the last call. If the picture is about to begin anew, how many samples were carried over is
    /// left out.
    pub fn take_news(&mut self, begins_anew: bool) -> Vec<String> {
        let mut news = self.screen.as_mut().map(Screen::take_news).unwrap_or_default();
        news.extend(self.dropped.take().filter(|_| !begins_anew));
        news
    }

    /// Fills the empty film from the last copy of its sums, if that has more samples than are retained, or else from the retained samples.
    /// `samples`: number before the film was emptied.
    fn refill(&mut self, run: &RunSpec, why: &str, samples: u64) {
        let film = self.screen.as_mut().and_then(Screen::film_mut);
        let restored = match film.zip(self.backup.take(self.kept.len())) {
            Some((film, copy)) => film.restore(&copy).is_ok(),
            None => false,
        };
        match restored {
            true => self.kept.skip(),
            false => self.rewind(run),
        }
        let kept = if restored { self.samples() } else { self.kept.len() as u64 };
        self.tell_what_is_kept(why, samples, kept);
    }

    /// Discards regions, which are tied to the film.
    fn drop_regions(&mut self) {
        if !self.regions.is_empty() {
            self.regions.clear();
            self.dropped =
                Some("the regions are gone: the film that they were parts of is another one".to_owned());
        }
    }

    /// Releases the lost device; samples are retained until another one opens.
    ///
    /// # Errors
    ///
    /// The same error if devices are lost repeatedly.
    pub fn lose_device(&mut self, error: ClientError) -> Result<(), ClientError> {
        self.drop_regions();
        self.lost = self.samples();
        self.screen.as_mut().map_or(Ok(()), |screen| screen.lose_device(error))
    }

    /// Opens a device if there is none and the next attempt is due. Its film gets the sums from memory or their last copy, or else is
    /// filled from the retained samples. Returns whether there is a new device.
    pub fn reopen(&mut self, run: &RunSpec) -> Result<bool, ClientError> {
        let Some(screen) = &mut self.screen else { return Ok(false) };
        if !screen.reopen(run.film)? {
            return Ok(false);
        }
        (self.repaint, self.show) = (true, true);
        let samples = std::mem::take(&mut self.lost);
        if self.samples() == 0 {
            self.refill(run, "the picture goes on after the loss of its device", samples);
        }
        Ok(true)
    }

    /// Keeps a copy of the sums in memory.
    pub fn back_up(&mut self, now: Instant) -> Result<(), ClientError> {
        let film = self.screen.as_mut().and_then(Screen::film_mut).filter(|_| self.kept.caught_up());
        film.map_or(Ok(()), |film| self.backup.update(film, self.kept.len(), now))
    }

    /// Replaces the films of the light groups by empty ones of the present size; their samples are not retained.
    pub fn remake_groups(&mut self, run: &RunSpec) -> Result<(), ClientError> {
        match self.mix.is_on() && self.gpu().is_some() {
            true => self.mix_groups(self.mix.groups().to_vec(), run),
            false => Ok(()),
        }
    }

    /// Updates the description of the groups and the memory that a light mix would have.
    pub fn offer_mix(&mut self, session: &RenderSession, editor: &SceneEditor) {
        let memory = self.group_memory();
        self.mix.offer(editor.desc(), &editor.scene(), session.run_spec(), memory);
    }

    /// Memory in which the films of light groups hold their sums.
    pub fn group_memory(&self) -> GroupMemory {
        let on_host = self.film().is_some_and(VulkanFilm::is_summed_on_host);
        if on_host { GroupMemory::WindowOnProcessor } else { GroupMemory::Window }
    }

    /// Creates empty films for these light groups.
    pub fn mix_groups(&mut self, groups: Vec<LightGroup>, run: &RunSpec) -> Result<(), ClientError> {
        let Some(screen) = &self.screen else { return Ok(()) };
        let make = |spec| screen.new_film(spec).map(|film| Box::new(film) as Box<dyn Film>);
        self.mix.begin(GroupFilms::with(groups, run, make)?);
        Ok(())
    }

    /// Restarts film and error from the retained samples, which carry their index and hence their replicate. Samples that the store had no
    /// room for are missing from both, and so are those of regions.
    fn rewind(&mut self, run: &RunSpec) {
        self.drop_regions();
        self.backup.clear();
        self.kept.rewind();
        self.meter.clear();
        self.begin_accounts_again(run);
        if self.steered {
            self.note_steering();
        }
        self.filter.begin(run);
        if !self.unseen {
            self.filter.prepare();
        }
        self.repaint = true;
    }

    /// Rasterises the batch even if it is not full.
    pub fn flush(&mut self) -> Result<(), ClientError> {
        self.rasterise(VulkanFilm::flush)
    }

    /// Rasterises samples of the picture with `film`, and all those of its regions and light groups.
    fn rasterise(
        &mut self,
        film: impl FnOnce(&mut VulkanFilm) -> Result<(), ClientError>,
    ) -> Result<(), ClientError> {
        let begin = Instant::now();
        let outcome = self.film_mut().map_or(Ok(()), film);
        let outcome = outcome.and_then(|()| self.mix.flush()).and_then(|()| self.regions.flush());
        // The time includes waiting until the last samples are sorted.
        self.fed.1 += begin.elapsed();
        outcome
    }

    /// Feeds CPU rasterisation times to the pacer; returns the time spent rasterising and denoising since the last call.
    pub fn learn_host_time(&mut self) -> Duration {
        let (samples, time) = self.film_mut().map(VulkanFilm::take_host_time).unwrap_or_default();
        let parts = [self.regions.take_host_time(), self.mix.take_host_time()];
        let [(a, b), (c, d)] = parts;
        let (samples, time) = (samples + a + c, time + b + d);
        self.pacer.samples(samples, time, self.is_coarse());
        let (fed, taken) = std::mem::take(&mut self.fed);
        // If the CPU rasterises, that happens within the time of taking samples; it is subtracted.
        self.pacer.fed(fed, taken.saturating_sub(time));
        time + std::mem::take(&mut self.filter_time)
    }

    /// Retained samples.
    pub fn kept(&self) -> &RetainedSamples {
        &self.kept
    }

    /// Displayed texels within a rectangle of the picture; `None` before there is a picture.
    pub fn shown(&mut self, region: Region) -> Result<Option<ShownTexels>, ClientError> {
        let Some(film) = self.film_mut() else { return Ok(None) };
        let size = [film.spec().width, film.spec().height];
        // The film may still have another size.
        let fits = (0..2).all(|i| region.origin[i] + region.extent[i] <= size[i]);
        if fits { film.shown(Eye::Left, region) } else { Ok(None) }
    }

    /// Sum of the weights of the camera samples at a pixel; 0 if unknown.
    pub fn weight_at(&mut self, pixel: [u32; 2]) -> f32 {
        let whole = self.film_mut().and_then(|film| film.weight_at(pixel).ok()).unwrap_or(0.0);
        whole + self.regions.weight_at(pixel)
    }
}
