//! The picture in the window: the screen with the film on it, the samples that are kept to fill another film, the pacing of
//! frames, and the observer of the error.

mod feed;
pub mod regions;

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::Result;

use crate::app::filtered_picture::FilteredPicture;
use crate::app::light_groups::{GroupFilms, GroupMemory};
use crate::app::noise_filter::{EpochView, FilteredFrame};
use crate::app::observer::{Beside, Observer};
use crate::app::outputs::FilmSnapshot;
use crate::app::run_spec::RunSpec;
use crate::app::tev::TevLink;
use crate::app::view::editor::SceneEditor;
use crate::app::view::light_mix::LightMix;
use crate::app::view::picture::regions::{ComposedFilm, Regions};
use crate::app::view::screen::{PictureParts, PictureSource, Screen};
use crate::app::view::session::RenderSession;
use crate::app::view::window_filter::WindowFilter;
use crate::client::film::VulkanFilm;
use crate::client::light_meter::LightMeter;
use crate::client::lod::level_of_detail;
use crate::client::pacing::{FramePlan, Pacer, Situation};
use crate::client::pass::repaint::ShownTexels;
use crate::client::retained::RetainedSamples;
use crate::client::window::host::PanelDrawing;
use crate::client::window::viewport::Viewport;
use crate::client::{BATCH_CAPACITY, ClientError, Denoise, Film, FilmCounts, FilmSpec, Settings};
use crate::gpu::{FrameNumber, Gpu, Readiness, Region};
use crate::scene::light_groups::LightGroup;
use crate::stream::BLOCK_SAMPLES;
use crate::study::ErrorTarget;

/// The picture of another view is waited for until so long after an edit, before one of the first samples is shown.
const FIRST_WAIT: Duration = Duration::from_millis(40);

/// The same, before the picture after that.
const NEXT_WAIT: Duration = Duration::from_millis(150);

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
    /// Samples that films were given since the start, kept ones again after a resize.
    pub rasterised: u64,
    /// With what the last picture was painted.
    pub painted: Option<Painted>,
    /// The film that the device could not hold, until another one is asked for.
    refused: Option<FilmSpec>,
    /// Errors that were no fault of film or settings since the last repaint.
    failures: u32,
}

/// Paths without any sample after which the picture is shown black.
const BLACK_PATHS: u64 = 4096;

/// Errors from which on a picture that no change explains stays as it is; before that it is tried again.
const FAILURES: u32 = 2;

impl LivePicture {
    /// A picture without a window, of this many tracer threads. Starts the observer, where the render is divided into replicates.
    pub fn new(run: &RunSpec, budget: Option<Duration>, target: ErrorTarget, threads: usize) -> Result<Self> {
        let observe = || Observer::start(run, Some(target), Beside::Window);
        let now = Instant::now();
        Ok(Self {
            screen: None,
            kept: RetainedSamples::default(),
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
            painted: None,
            refused: None,
            failures: 0,
        })
    }

    /// The window is open, on a display that wants frames of this length, if it says so.
    pub fn open(&mut self, screen: Screen, budget: Option<Duration>) {
        self.screen = Some(screen);
        if let Some(budget) = budget {
            self.pacer = Pacer::new(budget);
        }
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
        if let Some(observer) = &mut self.observer {
            observer.set_target(Some(target));
        }
    }

    /// Samples and paths on the film.
    pub fn counts(&self) -> FilmCounts {
        self.film().map(VulkanFilm::counts).unwrap_or_default()
    }

    /// Samples on the film.
    fn samples(&self) -> u64 {
        let counts = self.counts();
        counts.camera_samples + counts.light_samples
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

    /// Notes that the device cannot hold this film, and goes back to the one of `run`.
    pub fn refuse(&mut self, film: FilmSpec, run: &RunSpec) -> Result<(), ClientError> {
        self.refused = Some(film);
        self.failures = 0;
        self.refit(run).map(|_| ())
    }

    /// Whether the device could not hold this film when it was asked for last.
    pub fn is_refused(&mut self, film: &FilmSpec) -> bool {
        self.refused = self.refused.filter(|refused| refused == film);
        self.refused.is_some()
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

    /// Fills the film anew from the kept samples where it has lost some to an error.
    pub fn mend(&mut self, run: &RunSpec) {
        if let Some(film) = self.film_mut().filter(|film| film.is_damaged()) {
            film.clear();
            self.rewind(run);
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

    /// Whether there is a window whose device has done everything it was given.
    pub fn is_idle(&mut self) -> bool {
        let Self { screen, regions, mix, .. } = self;
        let are_drawn = |gpu: &Arc<Gpu>| regions.are_drawn(gpu) && mix.are_drawn(gpu);
        screen.as_ref().is_some_and(|screen| screen.is_idle() && screen.gpu().is_none_or(are_drawn))
    }

    /// Begins with the samples of another epoch. The old picture stays until the new one is there.
    pub fn begin_epoch(&mut self, run: &RunSpec, view: EpochView, settings: &Settings) {
        self.kept.clear();
        self.meter.clear();
        self.regions.clear();
        self.mix.begin_epoch();
        self.filter.begin_epoch(run, view, settings);
        if let Some(observer) = &mut self.observer {
            observer.begin(run);
        }
        (self.unseen, self.running, self.failures) = (true, true, 0);
        if let Some(film) = self.film_mut() {
            film.clear();
        }
    }

    /// Replaces the film where it has not the present size and filter; returns whether it did. The new film is filled from the
    /// kept samples, which know no resolution.
    pub fn refit(&mut self, run: &RunSpec) -> Result<bool, ClientError> {
        let fits = self.film().is_some_and(|film| *film.spec() == run.film);
        let Some(screen) = self.screen.as_mut().filter(|_| !fits) else { return Ok(false) };
        screen.replace_film(run.film)?;
        self.rewind(run);
        self.remake_groups(run)?;
        Ok(true)
    }

    /// Replaces the device that was lost; the film on the new one is filled from the kept samples. On an
    /// error there is no film afterwards.
    pub fn replace_device(&mut self, run: &RunSpec) -> Result<(), ClientError> {
        self.regions.clear();
        let Some(screen) = &mut self.screen else { return Ok(()) };
        screen.replace_device(run.film)?;
        self.rewind(run);
        self.remake_groups(run)?;
        self.show = true;
        Ok(())
    }

    /// Replaces the films of the groups of lights by empty ones of the present size: their samples are not kept.
    fn remake_groups(&mut self, run: &RunSpec) -> Result<(), ClientError> {
        match self.mix.is_on() {
            true => self.mix_groups(self.mix.groups().to_vec(), run),
            false => Ok(()),
        }
    }

    /// Tells what a mix of the scene's lights would be of and take.
    pub fn offer_mix(&mut self, session: &RenderSession, editor: &SceneEditor) {
        let on_host = self.film().is_some_and(VulkanFilm::is_summed_on_host);
        let memory = if on_host { GroupMemory::Both } else { GroupMemory::Device };
        self.mix.offer(session.epoch(), editor.desc(), &editor.scene(), session.run_spec(), memory);
    }

    /// What the picture is composed of beside the samples of all of it, for its files.
    pub fn composition(&self) -> Vec<(&'static str, String)> {
        let mix = Some(self.mix.options()).filter(|options| !options.is_empty());
        let regions = Some(self.regions.in_words()).filter(|words| !words.is_empty());
        let notes = [("displayedMix", mix), ("regions", regions)];
        notes.into_iter().filter_map(|(name, note)| Some((name, note?))).collect()
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
        self.regions.clear();
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

    /// Whether a filtered picture has come that was not shown yet.
    pub fn is_freshly_filtered(&self) -> bool {
        self.filter.is_fresh()
    }

    /// Begins to filter the samples so far.
    fn filter_now(&mut self) {
        let samples = self.samples();
        // Where the sums are not at hand, pictures have no detail within pixels.
        let data = self.film_mut().filter(|film| film.is_summed_on_host()).map(Film::develop);
        self.filter.filter(samples, data.and_then(Result::ok));
    }

    /// The picture of all samples so far through the filter, if these settings show it so; waits for it.
    pub fn filtered(&mut self, run: &RunSpec, settings: &Settings) -> Option<FilteredPicture> {
        if self.mix.is_mixing() || !self.filter.will_be_ready(run, settings, self.samples()) {
            return None;
        }
        self.filter.choose(settings);
        self.filter.wait();
        self.filter_now();
        self.filter.wait();
        let picture = self.filter.take()?;
        Some(self.composed(picture, settings))
    }

    /// A filtered picture with the regions in it.
    fn composed(&mut self, picture: FilteredPicture, settings: &Settings) -> FilteredPicture {
        let film = self.screen.as_mut().and_then(Screen::film_mut).filter(|_| !self.regions.is_empty());
        let Some(film) = film else { return picture };
        let mut xyz = picture.xyz().clone();
        match (ComposedFilm { film, regions: &mut self.regions, mix: &mut self.mix })
            .mix_into(&mut xyz, settings)
        {
            Ok(()) => xyz.into(),
            Err(_) => picture,
        }
    }

    /// The filter through which the picture is shown.
    pub fn filter_shown(&self, run: &RunSpec, settings: &Settings) -> Denoise {
        let filtered = self.filtered_frame(run, settings).and_then(|frame| frame.filtered.as_ref());
        filtered.map_or(Denoise::Off, |_| settings.denoise)
    }

    /// Decides what this frame does.
    pub fn plan(&mut self, session: &RenderSession, settings: &Settings, now: Instant) -> FramePlan {
        let run = session.run_spec();
        let mut filter = self.look_at_filter(run, settings);
        // Until the first filtered picture the others go on.
        let mut filtered = self.filtered_frame(run, settings).map(|frame| frame.samples);
        let mut is_fresh = self.filter.is_fresh();
        if let Some(region) = self.regions.traced_mut() {
            filter = region.look_at_filter(settings, &mut self.pacer, &mut self.filter_time);
            filtered = region.filtered(settings);
            is_fresh |= region.filter().is_fresh();
        }
        if self.film().is_some_and(VulkanFilm::is_background_ready) {
            self.repaint = true;
        }
        let longest_wait = if self.unseen { FIRST_WAIT } else { NEXT_WAIT };
        let waits = self.filter.is_reprojecting() && session.elapsed() < longest_wait;
        let (last, samples) = (&self.last_repaint, self.traced_samples());
        let growth = match last.samples {
            last if last == samples => 1.0,
            0 => f64::INFINITY,
            last => samples as f64 / last as f64,
        };
        let situation = Situation {
            since_edit: now - self.last_edit,
            since_repaint: now - last.at,
            lod: level_of_detail(&run.film, self.samples()),
            growth,
            shown_detail: last.detail,
            due: !waits && self.unseen || self.repaint || is_fresh,
            waiting: session.fill().0 * BLOCK_SAMPLES,
            // In order of index only full batches are rasterised.
            batched: if run.deterministic { 0 } else { self.film().map_or(0, VulkanFilm::waiting) },
            filter: filter && filtered.is_some(),
        };
        let mut plan = self.pacer.plan(&situation);
        if filter && !situation.due {
            // The picture comes when it is filtered; the first and the last one as soon as they can.
            let soon = filtered.is_none() || !self.running && filtered != Some(samples);
            let due = filtered.is_some() && std::mem::take(&mut plan.repaint);
            match self.regions.traced_mut() {
                Some(region) if due || soon => region.filter_now(),
                None if (due || soon) && !self.filter.is_busy() => self.filter_now(),
                _ => {}
            }
        }
        plan.repaint &= situation.due || !waits;
        if run.deterministic {
            plan.samples = plan.samples.max(BATCH_CAPACITY);
        }
        plan
    }

    /// Whether a frame with this plan shows something.
    pub fn wants_show(&self, plan: &FramePlan, panel_is_due: bool) -> bool {
        self.show || (!self.hidden && (plan.repaint || panel_is_due))
    }

    /// Acquires an image of the window to draw into; returns its extent, or `None` where there is nothing to draw into now.
    pub fn acquire(&mut self) -> Result<Option<[u32; 2]>, ClientError> {
        let Some(screen) = &mut self.screen else { return Ok(None) };
        let (readiness, extent) = screen.acquire()?;
        self.hidden = matches!(readiness, Readiness::Hidden);
        match readiness {
            Readiness::Ready => return Ok(extent),
            Readiness::Busy | Readiness::Hidden => {}
            Readiness::SurfaceLost => {
                screen.replace_surface()?;
                tracing::info!("the surface was lost and replaced");
            }
        }
        Ok(None)
    }

    /// Rasterises the batch although it is not full.
    pub fn flush(&mut self) -> Result<(), ClientError> {
        self.film_mut().map_or(Ok(()), VulkanFilm::flush)?;
        self.mix.flush()?;
        self.regions.flush()
    }

    /// Learns how long the processor took to draw samples, where the device does not; returns for how long it has drawn and filtered
    /// since the last call.
    pub fn learn_host_time(&mut self) -> Duration {
        let (samples, time) = self.film_mut().map(VulkanFilm::take_host_time).unwrap_or_default();
        let parts = [self.regions.take_host_time(), self.mix.take_host_time()];
        let [(a, b), (c, d)] = parts;
        let (samples, time) = (samples + a + c, time + b + d);
        self.pacer.samples(samples, time);
        time + std::mem::take(&mut self.filter_time)
    }

    /// Asks for a last repaint once the render has ended and the film has all of its samples.
    pub fn hear_end(&mut self, session: &RenderSession) {
        if session.is_through() && self.kept.caught_up() && std::mem::take(&mut self.running) {
            self.repaint = true;
            tracing::info!("the render has ended");
        }
    }

    /// Whether there is something to show: a picture of the present epoch, or the last one of the one before.
    pub fn has_picture(&mut self) -> bool {
        self.film_mut().is_some_and(|film| film.painted().is_some()) || self.is_known()
    }

    /// Whether the film shows the present epoch: it has samples, or enough paths have found none that it is black.
    fn is_known(&self) -> bool {
        self.samples() > 0 || self.counts().paths() >= BLACK_PATHS
    }

    /// Repaints the picture if the plan says so or it was asked for, draws the panel over it and swaps. The frame `began` with
    /// the run of the panel.
    pub fn show(
        &mut self,
        session: &RenderSession,
        plan: &FramePlan,
        settings: &Settings,
        viewport: &Viewport,
        panel: Option<&mut PanelDrawing>,
        began: Instant,
    ) -> Result<ShownFrame, ClientError> {
        let samples = self.samples();
        // In order of index only whole batches are rasterised, so that the sums are those of a headless render.
        let partial = !session.run_spec().deterministic || session.is_complete();
        let ready = if partial { self.is_known() } else { samples >= BATCH_CAPACITY as u64 };
        let repaint = plan.repaint || self.repaint;
        let is_filtered = repaint && self.filtered_frame(session.run_spec(), settings).is_some();
        if partial && ready && repaint && !is_filtered {
            self.flush()?;
        }
        let filtered = self.filter.shown(session.run_spec(), settings).filter(|_| is_filtered);
        let detail = match filtered {
            Some(_) => Some(1),
            None => (ready && repaint).then_some(plan.detail),
        };
        let samples = match (self.regions.traced(), filtered) {
            (Some(region), _) => region.samples(),
            (None, Some(frame)) => frame.samples,
            (None, None) => samples,
        };
        let source = match filtered {
            Some(frame) => Some(PictureSource::Filtered(frame.shown.xyz())),
            None if self.mix.is_mixing() && !settings.view.is_error() => detail.map(PictureSource::Mix),
            None => detail.map(PictureSource::Film),
        };
        let number = match &mut self.screen {
            Some(screen) => {
                let parts = PictureParts { regions: &mut self.regions, mix: &mut self.mix };
                screen.show(settings, source, parts, viewport, panel)?
            }
            None => FrameNumber::default(),
        };
        self.show = false;
        if let Some(detail) = detail {
            let film = session.run_spec().film;
            if self.painted.as_ref().is_none_or(|p| p.film != film || p.settings != *settings) {
                self.painted = Some(Painted { settings: settings.clone(), film });
            }
            self.failures = 0;
            if std::mem::take(&mut self.unseen) {
                self.filter.prepare();
            }
            self.repaint = false;
            self.filter.is_seen();
            self.last_repaint = LastRepaint { at: began, samples, detail };
        }
        Ok(ShownFrame { number, began, samples, detail, filtered: is_filtered })
    }

    /// Takes the picture as it is now, to be written by another thread.
    pub fn snapshot(
        &mut self,
        path: &Path,
        session: &RenderSession,
        settings: &Settings,
    ) -> Result<FilmSnapshot> {
        let filtered = self.filtered_frame(session.run_spec(), settings);
        let filtered = filtered.and_then(|frame| frame.filtered.as_ref());
        let filtered = filtered.cloned().map(|picture| self.composed(picture, settings).display(settings));
        let filtered = filtered.transpose()?;
        let Some(film) = self.screen.as_mut().and_then(Screen::film_mut) else {
            return Err(miette::miette!("there is no picture to save"));
        };
        if film.is_damaged() {
            return Err(miette::miette!(
                "samples were lost to an error of the device: change something, then save"
            ));
        }
        // In order of index the sums must stay those of whole batches until the last one.
        film.keep_batch(session.run_spec().deterministic && !session.is_complete());
        let mut film = ComposedFilm { film, regions: &mut self.regions, mix: &mut self.mix };
        let snapshot = FilmSnapshot::take(path, &mut film, settings, filtered);
        film.keep_batch(false);
        let snapshot = match (snapshot, self.mix.films()) {
            (Ok(FilmSnapshot::Exr(data, mut layers)), Some(films)) => {
                layers.extend(films.channels()?);
                Ok(FilmSnapshot::Exr(data, layers))
            }
            (snapshot, _) => snapshot,
        };
        // The window's own picture may have another encoding.
        self.repaint = true;
        snapshot
    }

    /// The samples that are kept.
    pub fn kept(&self) -> &RetainedSamples {
        &self.kept
    }

    /// What the window shows within a rectangle of the picture; `None` before there is a picture.
    pub fn shown(&mut self, region: Region) -> Result<Option<ShownTexels>, ClientError> {
        self.film_mut().map_or(Ok(None), |film| film.shown(region))
    }

    /// The sum of the weights of the camera samples at a pixel; 0 where it is not known.
    pub fn weight_at(&mut self, pixel: [u32; 2]) -> f32 {
        let whole = self.film_mut().and_then(|film| film.weight_at(pixel).ok()).unwrap_or(0.0);
        whole + self.regions.weight_at(pixel)
    }

    /// Shows the film in tev, unless it is empty.
    pub fn send_to_tev(
        &mut self,
        tev: &mut TevLink,
        name: &str,
        session: &RenderSession,
    ) -> Result<(), ClientError> {
        let film = self.screen.as_mut().and_then(Screen::film_mut);
        let Some(film) = film.filter(|film| film.counts().paths() > 0) else { return Ok(()) };
        let film = &mut ComposedFilm { film, regions: &mut self.regions, mix: &mut self.mix };
        film.keep_batch(session.run_spec().deterministic && !session.is_complete());
        let sent = tev.send(name, film);
        film.keep_batch(false);
        sent
    }

    /// Takes the film out of the window, for the files written at the end.
    pub fn take_film(&mut self) -> Option<VulkanFilm> {
        self.screen.as_mut().and_then(Screen::take_film)
    }
}
