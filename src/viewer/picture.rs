//! The picture in the window: the screen with the film on it, the samples that are kept to fill another film, the pacing of
//! frames, and the observer of the error.

mod backup;
mod feed;
mod frames;
pub mod output;
pub mod regions;

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::Result;

use crate::client::film::VulkanFilm;
use crate::client::light_meter::LightMeter;
use crate::client::pacing::Pacer;
use crate::client::pass::repaint::ShownTexels;
use crate::client::retained::{RETAINED_SAMPLES, RetainedSamples};
use crate::client::{ClientError, Film, FilmCounts, FilmSpec, Settings};
use crate::denoise::noise_filter::{EpochView, FilteredFrame};
use crate::gpu::{FrameNumber, Gpu, Region};
use crate::render::figures::human;
use crate::render::light_groups::{GroupFilms, GroupMemory};
use crate::render::method;
use crate::render::observer::{Backpressure, Observer};
use crate::render::run_spec::RunSpec;
use crate::scene::light_groups::LightGroup;
use crate::study::{ErrorEstimate, ErrorTarget};
use crate::viewer::editor::SceneEditor;
use crate::viewer::light_mix::LightMix;
use crate::viewer::picture::backup::SumsBackup;
use crate::viewer::picture::regions::{RegionRender, Regions};
use crate::viewer::screen::Screen;
use crate::viewer::session::RenderSession;
use crate::viewer::window_filter::WindowFilter;

/// Frame length where neither the command line nor the display says.
const DEFAULT_BUDGET: Duration = Duration::from_micros(16_667);

/// The last repaint of the picture.
struct LastRepaint {
    at: Instant,
    /// Samples on the film then.
    samples: u64,
    /// Internal resolution: picture pixels per reconstructed pixel and axis.
    detail: u32,
}

/// What a picture was painted with.
#[derive(Clone)]
pub struct Painted {
    pub settings: Settings,
    pub film: FilmSpec,
}

/// A frame that was handed to the device.
pub struct ShownFrame {
    pub number: FrameNumber,
    pub began: Instant,
    /// Samples on the film.
    pub samples: u64,
    /// Internal resolution of its repaint; `None` where the last picture was shown again.
    pub detail: Option<u32>,
    /// It shows a filtered picture.
    pub filtered: bool,
}

/// The picture: film, screen, kept samples, pacing, observer.
pub struct LivePicture {
    /// The window with the film; `None` until the window is open.
    pub screen: Option<Screen>,
    /// The samples of the present epoch, for films to come.
    kept: RetainedSamples,
    /// The sums of the present epoch in memory, where they are on a device and have more samples than are kept.
    backup: SumsBackup,
    /// Shares out the time of a frame.
    pub pacer: Pacer,
    /// Watches the error, where the render is divided into replicates.
    pub observer: Option<Observer>,
    /// Rectangles that have samples of their own beside those of the whole picture.
    pub regions: Regions,
    /// The pictures of groups of lights, where these are mixed.
    pub mix: LightMix,
    /// Filters what is shown.
    filter: WindowFilter,
    /// Measures the light of the samples on the film.
    meter: LightMeter,
    /// For how long it has filtered since this was asked for.
    filter_time: Duration,
    last_edit: Instant,
    last_repaint: LastRepaint,
    /// No picture of the present epoch was shown yet.
    unseen: bool,
    /// The picture must be painted anew from the same samples.
    repaint: bool,
    /// The window must be drawn, even with the same picture.
    show: bool,
    /// The window is not visible, as far as is known: nothing is drawn until it is resized or shown.
    hidden: bool,
    /// The render goes on; when it ends, all of its samples must be shown once.
    running: bool,
    /// Samples that films were given since the start, kept ones again by a film of another size.
    pub rasterised: u64,
    /// Samples that the loop has taken since it was asked last, and how long that and their batches took.
    fed: (u64, Duration),
    /// With what the last picture was painted.
    pub painted: Option<Painted>,
    /// Errors that were no fault of film or settings since the last repaint.
    failures: u32,
    /// Samples of the film whose device was lost.
    lost: u64,
    /// What the user is to be told of samples that are gone.
    dropped: Option<String>,
}

/// Samples of a stream that coarse sums take at most: the store has room for those of both, and for what comes in the same frame.
const MOST_COARSE: u64 = RETAINED_SAMPLES as u64 / 4;

/// Errors from which on a picture that no change explains stays as it is; before that it is tried again.
const FAILURES: u32 = 2;

impl LivePicture {
    /// A picture without a window, of this many tracer threads. Starts the observer, where the render is divided into replicates.
    pub fn new(run: &RunSpec, budget: Option<Duration>, target: ErrorTarget, threads: usize) -> Result<Self> {
        let observe = || Observer::start(run, Some(target), Backpressure::LeaveOut);
        let now = Instant::now();
        Ok(Self {
            screen: None,
            kept: RetainedSamples::default(),
            backup: SumsBackup::default(),
            pacer: Pacer::new(budget.unwrap_or(DEFAULT_BUDGET)),
            observer: run.replicated.then(observe).transpose()?,
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

    /// Tells the observer which error is wanted.
    pub fn aim(&mut self, target: ErrorTarget) {
        let of_regions = self.regions.iter_mut().filter_map(RegionRender::observer_mut);
        for observer in self.observer.iter_mut().chain(of_regions) {
            observer.set_target(Some(target));
        }
    }

    /// Samples and paths on the film.
    pub fn counts(&self) -> FilmCounts {
        self.film().map(VulkanFilm::counts).unwrap_or_default()
    }

    /// Samples of the film whose device was lost, while there is no other; 0 otherwise.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Whether the sums are coarse.
    pub fn is_coarse(&self) -> bool {
        self.film().is_some_and(VulkanFilm::is_coarse)
    }

    /// Samples on the film.
    fn samples(&self) -> u64 {
        self.counts().samples()
    }

    /// Samples of what is traced: of a region, or of the whole picture.
    fn traced_samples(&self) -> u64 {
        self.regions.traced().map_or_else(|| self.samples(), |region| region.samples())
    }

    /// Something else is traced now: what is there is shown anew, and how fast it grows is not known.
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

    /// Views that began with the last picture of another one.
    pub fn reprojections(&self) -> u64 {
        self.filter.reprojections()
    }

    /// The exposure that the light of the samples asks for; `None` while there are too few.
    pub fn metered(&self) -> Option<f32> {
        self.meter.exposure()
    }

    /// The picture is to be painted with another exposure.
    pub fn expose(&mut self) {
        self.repaint = true;
    }

    /// Asks for the picture to be painted anew from the same samples.
    pub fn request_repaint(&mut self) {
        (self.repaint, self.failures) = (true, 0);
    }

    /// Goes back to the film of `run`, because the device cannot hold another one that was asked for; returns whether that has to be made.
    pub fn go_back(&mut self, run: &RunSpec) -> Result<bool, ClientError> {
        self.failures = 0;
        self.refit(run)
    }

    /// Notes an error that film and settings do not explain. Returns whether the picture stays as it is from now on.
    pub fn note_failure(&mut self) -> bool {
        self.failures += 1;
        self.repaint &= !self.is_frozen();
        self.is_frozen()
    }

    /// Whether the picture stays as it is, because the device refuses to go on with it, until something is changed.
    pub fn is_frozen(&self) -> bool {
        self.failures >= FAILURES
    }

    /// Fills the film anew where it has lost samples to an error.
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
        let filtering = self.filter.is_busy() || self.filter.is_fresh();
        self.kept.caught_up() && !(self.unseen || self.repaint || self.show || filtering)
    }

    /// Whether there is a window whose device has done what must be done before the next frame.
    pub fn is_idle(&mut self) -> bool {
        let Self { screen: Some(screen), regions, mix, .. } = self else { return false };
        let are_drawn = |gpu: &Arc<Gpu>| regions.are_drawn(gpu) && mix.are_drawn(gpu);
        screen.is_idle() && (screen.leads() || screen.gpu().is_none_or(are_drawn))
    }

    /// Begins with the samples of another epoch. The old picture stays until the new one is there.
    pub fn begin_epoch(&mut self, run: &RunSpec, view: EpochView, settings: &Settings) {
        self.kept.clear();
        self.backup.clear();
        self.meter.clear();
        self.regions.clear();
        self.mix.begin_epoch();
        if let Some(observer) = &mut self.observer {
            observer.begin(run, method::witnesses(run, &view.scene, &view.camera));
        }
        self.filter.begin_epoch(run, view, settings);
        (self.unseen, self.running, self.failures) = (true, true, 0);
        // What the film before has kept matters no more.
        self.dropped = None;
        // Its samples are kept as long as coarse sums suffice. In order of index the sums are those of whole batches.
        let coarse = !run.deterministic && VulkanFilm::coarse_samples(&run.film) <= MOST_COARSE;
        let Some(film) = self.film_mut() else { return };
        if !coarse || film.begin_coarsely().is_err() {
            film.clear();
        }
    }

    /// Replaces the film where it has not the present size and filter; returns whether it did. The new film is filled from the
    /// kept samples, which know no resolution. Without a device the next one gets it.
    ///
    /// # Errors
    ///
    /// Those of a film, and [`GpuError::Memory`](crate::gpu::GpuError::Memory) where the device is known to have no room for it; then the
    /// old one stays.
    pub fn refit(&mut self, run: &RunSpec) -> Result<bool, ClientError> {
        if self.gpu().is_none() || self.film().is_some_and(|film| *film.spec() == run.film) {
            return Ok(false);
        }
        let samples = self.samples();
        let settings = self.painted.as_ref().map(|painted| painted.settings.clone()).unwrap_or_default();
        let Some(screen) = &mut self.screen else { return Ok(false) };
        screen.check_room(&run.film, &settings)?;
        screen.replace_film(run.film)?;
        self.rewind(run);
        self.tell_what_is_kept("the film is made anew", samples, self.kept.len() as u64);
        self.remake_groups(run)?;
        Ok(true)
    }

    /// Tells the user where not all `samples` of a picture are in the next one.
    fn tell_what_is_kept(&mut self, why: &str, samples: u64, kept: u64) {
        if kept < samples {
            let (samples, kept) = (human(samples as f64), human(kept as f64));
            self.dropped = Some(format!("{why}, with {kept} of its {samples} samples: no more were kept"));
        }
    }

    /// What the user is to be told since the last call. Of a picture that is about to begin anew nobody need know what it has kept.
    pub fn take_news(&mut self, begins_anew: bool) -> Vec<String> {
        let mut news = self.screen.as_mut().map(Screen::take_news).unwrap_or_default();
        news.extend(self.dropped.take().filter(|_| !begins_anew));
        news
    }

    /// Gives the empty film the last copy of its sums, if that has more samples than are kept, or else the kept samples. It had this many
    /// `samples` before.
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

    /// The regions go with the film that they were parts of.
    fn drop_regions(&mut self) {
        if !self.regions.is_empty() {
            self.regions.clear();
            self.dropped =
                Some("the regions are gone: the film that they were parts of is another one".to_owned());
        }
    }

    /// Gives up the device, which was lost: samples are kept until there is another one.
    ///
    /// # Errors
    ///
    /// The same error where that goes on and on.
    pub fn lose_device(&mut self, error: ClientError) -> Result<(), ClientError> {
        self.drop_regions();
        self.lost = self.samples();
        self.screen.as_mut().map_or(Ok(()), |screen| screen.lose_device(error))
    }

    /// Opens a device where there is none, once it is time to try. The film on it has the sums that were in memory, or their last copy;
    /// otherwise it is filled from the kept samples. Returns whether there is a new one.
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

    /// Replaces the films of the groups of lights by empty ones of the present size: their samples are not kept.
    pub fn remake_groups(&mut self, run: &RunSpec) -> Result<(), ClientError> {
        match self.mix.is_on() && self.gpu().is_some() {
            true => self.mix_groups(self.mix.groups().to_vec(), run),
            false => Ok(()),
        }
    }

    /// Tells what a mix of the scene's lights would be of and take.
    pub fn offer_mix(&mut self, session: &RenderSession, editor: &SceneEditor) {
        let memory = self.group_memory();
        self.mix.offer(editor.desc(), &editor.scene(), session.run_spec(), memory);
    }

    /// Where the films of groups of lights have their sums.
    pub fn group_memory(&self) -> GroupMemory {
        let on_host = self.film().is_some_and(VulkanFilm::is_summed_on_host);
        if on_host { GroupMemory::WindowOnProcessor } else { GroupMemory::Window }
    }

    /// Makes empty films for these groups of lights.
    pub fn mix_groups(&mut self, groups: Vec<LightGroup>, run: &RunSpec) -> Result<(), ClientError> {
        let Some(screen) = &self.screen else { return Ok(()) };
        let make = |spec| screen.new_film(spec).map(|film| Box::new(film) as Box<dyn Film>);
        self.mix.begin(GroupFilms::with(groups, run, make)?);
        Ok(())
    }

    /// The film is empty: it and its error are made anew from the kept samples, which carry their index and so their
    /// replicate. Samples for which the store had no room are missing from both, and so are those of regions.
    fn rewind(&mut self, run: &RunSpec) {
        self.drop_regions();
        self.backup.clear();
        self.kept.rewind();
        self.meter.clear();
        if let Some(observer) = &mut self.observer {
            observer.begin_again(run);
        }
        self.filter.begin(run);
        if !self.unseen {
            self.filter.prepare();
        }
        self.repaint = true;
    }

    /// Takes over a picture that was filtered; returns whether the next one is to be shown through the filter.
    fn look_at_filter(&mut self, run: &RunSpec, settings: &Settings) -> bool {
        self.filter.choose(settings);
        // Devices that are the processor have no time to spare for it.
        let device =
            self.gpu().filter(|_| self.film().is_some_and(|film| !film.is_summed_on_host())).cloned();
        match self.filter.is_wanting(run, settings) {
            true => self.filter.start(run, &self.kept, !self.unseen, device),
            false => self.filter.set_device(device),
        }
        if let Some(time) = self.filter.poll() {
            self.pacer.filtered(time);
            self.filter_time += time;
        }
        self.filter.is_ready(run, settings, self.samples()) && !self.mix.is_mixing()
    }

    /// The last filtered picture, if it is what these settings show. A mix of lights is not filtered: the filter knows all lights as they are.
    fn filtered_frame(&self, run: &RunSpec, settings: &Settings) -> Option<&FilteredFrame> {
        self.filter.shown(run, settings).filter(|_| !self.mix.is_mixing())
    }

    /// What is known of the error of the picture through the noise filter, if these settings show that: nothing where regions have other samples.
    pub fn filtered_error(&self, run: &RunSpec, settings: &Settings) -> Option<Option<&ErrorEstimate>> {
        self.filtered_frame(run, settings)?;
        Some(self.filter.error(settings).filter(|_| self.regions.is_empty()))
    }

    /// Whether a filtered picture has come that was not shown yet.
    pub fn is_freshly_filtered(&self) -> bool {
        self.filter.is_fresh()
    }

    /// Begins to filter the samples so far.
    fn filter_now(&mut self) {
        let samples = self.samples();
        // Where the sums are not at hand, pictures have no detail within pixels.
        let film = self.film_mut().filter(|film| film.is_summed_on_host() && !film.is_coarse());
        let data = film.map(Film::develop);
        self.filter.filter(samples, data.and_then(Result::ok));
    }

    /// Rasterises the batch although it is not full.
    pub fn flush(&mut self) -> Result<(), ClientError> {
        self.rasterise(VulkanFilm::flush)
    }

    /// Rasterises samples of the picture, and all those of its parts.
    fn rasterise(
        &mut self,
        film: impl FnOnce(&mut VulkanFilm) -> Result<(), ClientError>,
    ) -> Result<(), ClientError> {
        let begin = Instant::now();
        let outcome = self.film_mut().map_or(Ok(()), film);
        let outcome = outcome.and_then(|()| self.mix.flush()).and_then(|()| self.regions.flush());
        // The last samples are waited for.
        self.fed.1 += begin.elapsed();
        outcome
    }

    /// Learns how long the processor took to draw samples, where the device does not; returns for how long it has drawn and filtered
    /// since the last call.
    pub fn learn_host_time(&mut self) -> Duration {
        let (samples, time) = self.film_mut().map(VulkanFilm::take_host_time).unwrap_or_default();
        let parts = [self.regions.take_host_time(), self.mix.take_host_time()];
        let [(a, b), (c, d)] = parts;
        let (samples, time) = (samples + a + c, time + b + d);
        self.pacer.samples(samples, time, self.is_coarse());
        let (fed, taken) = std::mem::take(&mut self.fed);
        // Where the processor draws, batches are drawn meanwhile.
        self.pacer.fed(fed, taken.saturating_sub(time));
        time + std::mem::take(&mut self.filter_time)
    }

    /// The samples that are kept.
    pub fn kept(&self) -> &RetainedSamples {
        &self.kept
    }

    /// What the window shows within a rectangle of the picture; `None` before there is a picture.
    pub fn shown(&mut self, region: Region) -> Result<Option<ShownTexels>, ClientError> {
        let Some(film) = self.film_mut() else { return Ok(None) };
        let size = [film.spec().width, film.spec().height];
        // The film may still be one of another size.
        let fits = (0..2).all(|i| region.origin[i] + region.extent[i] <= size[i]);
        if fits { film.shown(region) } else { Ok(None) }
    }

    /// The sum of the weights of the camera samples at a pixel; 0 where it is not known.
    pub fn weight_at(&mut self, pixel: [u32; 2]) -> f32 {
        let whole = self.film_mut().and_then(|film| film.weight_at(pixel).ok()).unwrap_or(0.0);
        whole + self.regions.weight_at(pixel)
    }
}
