//! The noise filter of the window: a thread that traces the feature buffers of an epoch after its first picture, denoises the accumulated
//! samples on request, and occasionally estimates the error of the denoised picture. The loop is never blocked. If only
//! the camera has moved, the last picture is reprojected ([`reprojection`](crate::denoise::reprojection)), the first samples are steered by it
//! ([`steering`](crate::denoise::steering)), and features are traced at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use clap::ValueEnum;
use miette::{IntoDiagnostic, Result};

use crate::accounting::accumulator::AccountReader;
use crate::client::oidn::OidnQuality;
use crate::client::wavelet::out_of_memory;
use crate::client::{ClientError, Denoise, FilmData, FilmSpec};
use crate::denoise::filtered_picture::{FilteredPicture, HalfMeans, filtered_error};
use crate::denoise::reprojection::{KnownView, MixedView, Prior, ViewSurfaces};
use crate::denoise::steering::{self, SteeringMap};
use crate::denoise::view_filter::{FeatureGrid, OidnOptions, ViewFilter, first_hits};
use crate::gpu::Gpu;
use crate::image::Grid;
use crate::stream::UvWindow;
use crate::study::{AccumulatedSamples, ErrorEstimate};
use crate::tracer::screen::ScreenDensity;
use crate::tracer::{Camera, Scene};

/// Samples per pixel from which on a picture is denoised; with fewer, the mip pyramid reconstructs more.
const FILTERED_FROM: f64 = 0.1;

/// Samples per pixel from which on the error of the denoised picture is estimated, and the factor of growth between estimates, each of
/// which takes a little longer than denoising two pictures.
const ERROR_FROM: f64 = 4.0;
const ERROR_RATIO: f64 = 1.5;

/// Primary rays for reprojection: few, because they delay the first picture after an edit.
const REPROJECTED: FeatureGrid = FeatureGrid { half: 0, step: 2 };

/// If reprojection takes no longer than this it precedes the display of the first samples; otherwise it follows, so that the first picture
/// is not delayed.
const AT_FIRST: Duration = Duration::from_millis(25);

/// Scene and camera of an epoch.
#[derive(Clone)]
pub struct EpochView {
    pub scene: Arc<Scene>,
    pub camera: Camera,
}

/// How the last picture is used in another view of the same scene: it is reprojected and displayed until there are enough samples.
#[derive(Clone, Copy, Debug)]
pub struct CarryOver {
    /// The filter that follows.
    pub kind: Denoise,
    /// The window of the screen whose first samples the reprojected picture steers; `None` if they are even.
    pub steered: Option<UvWindow>,
}

/// A message to the thread.
enum FilterMessage {
    /// Begins another epoch, or another film in the same one: discard all samples.
    Begin {
        film: FilmSpec,
        view: Box<EpochView>,
        /// Use of the last picture, if it shows the same scene.
        carry: Option<CarryOver>,
    },
    /// Trace the feature buffers for a filter of this kind; wavelets run on this device, if any. A reprojected picture begins with these
    /// samples.
    Prepare(Denoise, Option<Arc<Gpu>>, Receiver<AccumulatedSamples>),
    /// Denoise these samples with a filter of this kind: this many samples of the film, with its sums if sub-pixel detail is wanted.
    Filter(Denoise, u64, Option<FilmData>, Receiver<AccumulatedSamples>),
}

/// A message, and the number of the film that it refers to.
type NumberedMessage = (u64, FilterMessage);

/// An answer of the thread about the film of this number.
struct FilterAnswer {
    number: u64,
    kind: Denoise,
    content: AnswerContent,
}

enum AnswerContent {
    Picture(PictureAnswer),
    /// Density of the first samples.
    Steering(Arc<ScreenDensity>),
    /// Error of the last denoised picture; `None` if there are too few samples.
    Error(Option<ErrorEstimate>),
}

/// A denoised or reprojected picture.
struct PictureAnswer {
    /// It contains no samples of the present view.
    is_reprojection: bool,
    /// `None` if memory ran out, the filter failed, or too little of the view could be reprojected.
    frame: Option<FilteredFrame>,
    took: Duration,
}

/// The last picture of the present film.
pub struct FilteredFrame {
    /// Displayed picture.
    pub shown: FilteredPicture,
    /// Denoised picture without reprojected content; `None` before there are enough samples for the filter.
    pub filtered: Option<FilteredPicture>,
    /// The requested filter.
    pub kind: Denoise,
    /// Number of samples in it.
    pub samples: u64,
}

/// Progress shared by loop and thread.
struct FilterProgress {
    /// Number of the present film; work for any other film is cancelled.
    number: AtomicU64,
    /// Number of the film whose features were traced last.
    prepared: AtomicU64,
    /// Number of the film that was last reprojected to.
    reprojected: AtomicU64,
}

/// Handle to the thread; dropping it ends the thread.
pub struct NoiseFilter {
    /// The accounts of the render whose pictures are denoised.
    account: AccountReader,
    /// `None` once the thread was told to end.
    messages: Option<Sender<NumberedMessage>>,
    answers: Receiver<FilterAnswer>,
    progress: Arc<FilterProgress>,
    thread: Option<JoinHandle<()>>,
    shown: Option<FilteredFrame>,
    /// Density for the first samples of the present film, not taken yet.
    steering: Option<Arc<ScreenDensity>>,
    /// Last error estimate of the present film, and the filter it applies to.
    error: Option<(Denoise, ErrorEstimate)>,
    /// Scene of the last denoised picture.
    known: Option<Arc<Scene>>,
    /// Scene of the present film.
    scene: Option<Arc<Scene>>,
    /// The last view may be reprojected to the present film.
    stands_in: bool,
    /// A reprojection was requested and has not been answered.
    reprojecting: bool,
    /// Duration of the last reprojection, and their number.
    reprojection: Duration,
    reprojections: u64,
    /// A request has not been answered.
    busy: bool,
    /// The features of the present film were requested.
    preparing: bool,
    /// Device for wavelets; `None` for the CPU.
    device: Option<Arc<Gpu>>,
    /// Filters that failed for the present film, or ran out of memory.
    failed: Vec<Denoise>,
}

impl NoiseFilter {
    /// Starts the thread, which reads its samples from these accounts. Filters with threads of their own use this many.
    pub fn start(threads: usize, account: AccountReader) -> Result<Self> {
        let (messages, inbox) = channel();
        let (outbox, answers) = channel();
        let progress = Arc::new(FilterProgress {
            number: AtomicU64::new(0),
            prepared: AtomicU64::new(u64::MAX),
            reprojected: AtomicU64::new(u64::MAX),
        });
        let own = progress.clone();
        let thread =
            Builder::new().name("noise filter".into()).spawn(move || work(&inbox, &outbox, &own, threads));
        Ok(Self {
            account,
            messages: Some(messages),
            answers,
            progress,
            thread: Some(thread.into_diagnostic()?),
            shown: None,
            steering: None,
            error: None,
            known: None,
            scene: None,
            stands_in: false,
            reprojecting: false,
            // Until the first reprojection its duration is unknown and counts as too long.
            reprojection: Duration::MAX,
            reprojections: 0,
            busy: false,
            preparing: false,
            device: None,
            failed: Vec::new(),
        })
    }

    /// Computes wavelets on this device from the next view on; on the CPU if `None`.
    pub fn set_device(&mut self, device: Option<Arc<Gpu>>) {
        self.device = device;
    }

    /// Begins a film of this epoch, whose account has begun, with the last picture in this use.
    pub fn begin(&mut self, film: FilmSpec, view: EpochView, carry: Option<CarryOver>) {
        self.progress.number.fetch_add(1, Ordering::Relaxed);
        (self.shown, self.busy, self.preparing) = (None, false, false);
        (self.error, self.steering) = (None, None);
        self.failed.clear();
        let is_known = self.known.as_ref().is_some_and(|scene| Arc::ptr_eq(scene, &view.scene));
        (self.stands_in, self.reprojecting) = (carry.is_some() && is_known, false);
        self.scene = Some(view.scene.clone());
        self.send(FilterMessage::Begin { film, view: Box::new(view), carry });
        if let Some(carry) = carry.filter(|_| self.stands_in && self.reprojection <= AT_FIRST) {
            self.prepare(carry.kind);
        }
    }

    /// Allows tracing of features once the first picture is shown, for a filter of this kind first.
    pub fn prepare(&mut self, kind: Denoise) {
        if !std::mem::replace(&mut self.preparing, true) {
            self.send(FilterMessage::Prepare(kind, self.device.clone(), self.account.ask()));
            self.reprojecting = self.stands_in;
        }
    }

    /// Whether a picture of this many samples can be made, denoised by a filter of this kind if there are enough.
    pub fn is_ready(&self, kind: Denoise, film: &FilmSpec, samples: u64) -> bool {
        let FilterProgress { number, prepared, reprojected } = &*self.progress;
        let is_present = |film: &AtomicU64| film.load(Ordering::Relaxed) == number.load(Ordering::Relaxed);
        !self.failed.contains(&kind)
            && (is_present(reprojected) || is_present(prepared) && is_enough(film, samples))
    }

    /// Whether a reprojection was requested and is not finished.
    pub fn is_reprojecting(&self) -> bool {
        self.reprojecting
    }

    /// Number of views that began with a reprojection since the start.
    pub fn reprojections(&self) -> u64 {
        self.reprojections
    }

    /// Whether a picture of this many samples can be denoised with this filter now, or once the requested features are traced.
    pub fn will_be_ready(&self, kind: Denoise, film: &FilmSpec, samples: u64) -> bool {
        self.preparing && !self.failed.contains(&kind) && is_enough(film, samples)
    }

    /// Whether the filter is running.
    pub fn is_busy(&self) -> bool {
        self.busy
    }

    /// Begins to denoise the samples accumulated so far: `samples` samples of a film with these sums.
    pub fn filter(&mut self, kind: Denoise, samples: u64, data: Option<FilmData>) {
        self.busy = true;
        self.send(FilterMessage::Filter(kind, samples, data, self.account.ask()));
    }

    /// The last picture.
    pub fn shown(&self) -> Option<&FilteredFrame> {
        self.shown.as_ref()
    }

    /// Takes the density for the first samples of the present film, once, if they are to be steered.
    pub fn take_steering(&mut self) -> Option<Arc<ScreenDensity>> {
        self.steering.take()
    }

    /// Last error estimate of the present film's picture denoised with a filter of this kind.
    pub fn error(&self, kind: Denoise) -> Option<&ErrorEstimate> {
        self.error.as_ref().filter(|(of, _)| *of == kind).map(|(_, error)| error)
    }

    /// Takes the last picture.
    pub fn take_shown(&mut self) -> Option<FilteredFrame> {
        self.shown.take()
    }

    /// Takes over the requested picture, if finished; returns how long it took.
    pub fn poll(&mut self) -> Option<Duration> {
        loop {
            match self.answers.try_recv() {
                Ok(answer) => {
                    if let Some(took) = self.take(answer) {
                        return Some(took);
                    }
                }
                Err(TryRecvError::Empty) => return None,
                Err(TryRecvError::Disconnected) => {
                    self.is_gone();
                    return None;
                }
            }
        }
    }

    /// Blocks until the requested picture is finished.
    pub fn wait(&mut self) {
        while self.busy {
            match self.answers.recv() {
                Ok(answer) => _ = self.take(answer),
                Err(_) => self.is_gone(),
            }
        }
    }

    /// Records that the thread has ended; the picture is shown without it.
    fn is_gone(&mut self) {
        (self.busy, self.preparing, self.reprojecting) = (false, false, false);
        self.failed.extend(Denoise::value_variants());
    }

    /// Takes over an answer; returns how long its picture took, if it contains one.
    fn take(&mut self, FilterAnswer { number, kind, content }: FilterAnswer) -> Option<Duration> {
        if number != self.progress.number.load(Ordering::Relaxed) {
            return None;
        }
        let answer = match content {
            AnswerContent::Picture(answer) => answer,
            AnswerContent::Steering(density) => {
                self.steering = Some(density);
                return None;
            }
            AnswerContent::Error(error) => {
                self.error = error.map(|error| (kind, error));
                return None;
            }
        };
        self.reprojecting = false;
        if answer.is_reprojection {
            self.reprojection = answer.took;
            answer.frame.as_ref()?;
            self.reprojections += 1;
        }
        self.busy = false;
        if answer.frame.is_none() {
            self.failed.push(kind);
        }
        if answer.frame.as_ref().is_some_and(|frame| frame.filtered.is_some()) {
            self.known.clone_from(&self.scene);
        }
        self.shown = answer.frame;
        Some(answer.took)
    }

    fn send(&self, message: FilterMessage) {
        let number = self.progress.number.load(Ordering::Relaxed);
        if let Some(messages) = &self.messages {
            // If the send fails the thread has ended and has reported why.
            let _ = messages.send((number, message));
        }
    }
}

impl Drop for NoiseFilter {
    fn drop(&mut self) {
        // Cancels work in progress.
        self.progress.number.fetch_add(1, Ordering::Relaxed);
        self.messages = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Whether this many samples of a film are enough for the filter.
fn is_enough(film: &FilmSpec, samples: u64) -> bool {
    samples as f64 >= FILTERED_FROM * f64::from(film.width) * f64::from(film.height)
}

/// State of one film in the thread.
struct FilteredFilm {
    film: FilmSpec,
    view: EpochView,
    /// Filter of the last error estimate, and number of paths at that time.
    estimated: Option<(Denoise, f64)>,
    /// Reproject the last picture of another view of the scene.
    reproject: bool,
    surfaces: Option<Arc<ViewSurfaces>>,
    filter: Option<ViewFilter>,
    /// Filter of the last view, kept to reuse its memory.
    spare: Option<ViewFilter>,
    prior: Option<Prior>,
    /// Where the first samples are traced, if the last picture steers them.
    steering: Option<SteeringMap>,
}

/// The thread.
fn work(
    inbox: &Receiver<NumberedMessage>,
    outbox: &Sender<FilterAnswer>,
    progress: &FilterProgress,
    threads: usize,
) {
    let mut state: Option<FilteredFilm> = None;
    let mut known: Option<(Arc<Scene>, KnownView)> = None;
    while let Ok((number, message)) = inbox.recv() {
        let is_over = || progress.number.load(Ordering::Relaxed) != number;
        if is_over() {
            continue;
        }
        let start = Instant::now();
        let answer = |kind, content| {
            let _ = outbox.send(FilterAnswer { number, kind, content });
        };
        let picture = |is_reprojection, frame| {
            AnswerContent::Picture(PictureAnswer { is_reprojection, frame, took: start.elapsed() })
        };
        match (message, &mut state) {
            (FilterMessage::Begin { film, view, carry }, state) => {
                known = known.filter(|(scene, _)| Arc::ptr_eq(scene, &view.scene));
                let spare = state.take().and_then(|last| last.filter.or(last.spare));
                let state = state.insert(FilteredFilm {
                    film,
                    view: *view,
                    estimated: None,
                    reproject: carry.is_some(),
                    surfaces: None,
                    filter: None,
                    spare,
                    prior: None,
                    steering: None,
                });
                if let Some(((_, known), CarryOver { kind, steered: Some(window) })) =
                    known.as_ref().zip(carry)
                    && let Some(density) = state.steer(known, &window, &is_over)
                {
                    answer(kind, AnswerContent::Steering(density));
                }
            }
            (FilterMessage::Prepare(kind, device, accumulated), Some(state)) => {
                if let Some((_, known)) = known.as_ref().filter(|_| state.reproject) {
                    let accumulated = accumulated.recv().ok();
                    let shown = accumulated.and_then(|samples| state.look(known, &samples, &is_over));
                    let frame = shown.map(|shown| FilteredFrame { shown, filtered: None, kind, samples: 0 });
                    let is_shown = frame.is_some();
                    answer(kind, picture(true, frame));
                    if is_shown {
                        progress.reprojected.store(number, Ordering::Relaxed);
                    }
                }
                let oidn = OidnOptions { threads, quality: OidnQuality::Balanced };
                if state.prepare(kind, oidn, device, &is_over).is_some() {
                    progress.prepared.store(number, Ordering::Relaxed);
                }
            }
            (FilterMessage::Filter(kind, samples, data, accumulated), Some(state)) => {
                let Ok(accumulated) = accumulated.recv() else {
                    // Another film has begun, or the samples are lost.
                    answer(kind, picture(false, None));
                    continue;
                };
                let made = state.picture(kind, samples, data.as_ref(), &accumulated);
                let made = made.inspect_err(|error| {
                    tracing::warn!("the picture is shown without noise filter: {error}");
                });
                let frame = made.ok().map(|(frame, now_known)| {
                    if let Some(now_known) = now_known {
                        known = Some((state.view.scene.clone(), now_known));
                    }
                    frame
                });
                let is_made = frame.is_some();
                answer(kind, picture(false, frame));
                if let Some(error) = is_made.then(|| state.error(kind, &accumulated, &is_over)).flatten() {
                    answer(kind, AnswerContent::Error(error));
                }
            }
            (_, None) => {}
        }
    }
}

impl FilteredFilm {
    /// Surfaces hit by the primary rays of this grid. `None` if memory runs out, or the film `is_over`.
    fn surfaces(&self, rays: FeatureGrid, is_over: &(dyn Fn() -> bool + Sync)) -> Option<ViewSurfaces> {
        let EpochView { scene, camera } = &self.view;
        let size = [self.film.width, self.film.height].map(|n| n as usize);
        let hits = first_hits(scene, camera, &self.film, rays, is_over)?;
        ViewSurfaces::new(camera, size, rays, hits)
    }

    /// Reprojects a known view. `None` if it shows too little, memory runs out, or the film `is_over`.
    fn look(
        &mut self,
        known: &KnownView,
        accumulated: &AccumulatedSamples,
        is_over: &(dyn Fn() -> bool + Sync),
    ) -> Option<FilteredPicture> {
        let coarse = self.surfaces(REPROJECTED, is_over)?;
        let prior = self.prior.insert(Prior::new(known, &coarse)?);
        if prior.is_enough() { prior.filled(&accumulated.replicates()) } else { None }
    }

    /// Density of the first samples over this window, by what a known view shows. `None` where they stay even: if it shows too little, or about
    /// as much everywhere, memory runs out, or the film `is_over`.
    fn steer(
        &mut self,
        known: &KnownView,
        window: &UvWindow,
        is_over: &(dyn Fn() -> bool + Sync),
    ) -> Option<Arc<ScreenDensity>> {
        let size = [self.film.width, self.film.height].map(|n| n as usize);
        let surfaces = self.surfaces(steering::probes(size), is_over)?;
        self.steering = SteeringMap::new(known, &surfaces, window);
        self.steering.as_ref()?.density().cloned()
    }

    /// Prepares the filter. `None` if memory runs out, or the film `is_over`.
    fn prepare(
        &mut self,
        kind: Denoise,
        oidn: OidnOptions,
        device: Option<Arc<Gpu>>,
        is_over: &(dyn Fn() -> bool + Sync),
    ) -> Option<()> {
        let surfaces = Arc::new(self.surfaces(FeatureGrid { half: 0, step: 1 }, is_over)?);
        let EpochView { scene, camera } = &self.view;
        let other = first_hits(scene, camera, &self.film, FeatureGrid { half: 1, step: 1 }, is_over)?;
        let filter = ViewFilter::of([surfaces.hits(), &other], self.spare.take())?;
        let filter = self.filter.insert(filter.with_oidn(oidn).on_device(device));
        self.surfaces = Some(surfaces);
        // If this fails, so will the first picture, which reports it.
        let _ = filter.prepare(kind);
        Some(())
    }

    /// Denoised picture of these samples, and the view that later ones may reproject.
    ///
    /// # Errors
    ///
    /// If memory runs out or the filter fails.
    fn picture(
        &mut self,
        kind: Denoise,
        samples: u64,
        data: Option<&FilmData>,
        accumulated: &AccumulatedSamples,
    ) -> Result<(FilteredFrame, Option<KnownView>), ClientError> {
        let Self { film, surfaces, filter, prior, steering, .. } = self;
        let replicates = &accumulated.replicates();
        let size @ [width, height] = replicates.size();
        let no_memory = || out_of_memory(size);
        let per_pixel = replicates.paths() as f32 / (width * height) as f32;
        *prior = prior.take().filter(|_| !Prior::is_gone(per_pixel));
        let Some(filter) = filter.as_mut().filter(|_| is_enough(film, samples)) else {
            let shown = prior.as_ref().and_then(|prior| prior.filled(replicates)).ok_or_else(no_memory)?;
            return Ok((FilteredFrame { shown, filtered: None, kind, samples }, None));
        };
        let halves = HalfMeans::of(replicates)?;
        let filtered = FilteredPicture::of(replicates, &halves, data, filter, kind)?;
        let mixed = match prior {
            Some(prior) => prior.mixed(&halves, &filtered, per_pixel, steering.as_ref()),
            None => Grid::try_filled(width, height, per_pixel).map(|worth| MixedView {
                picture: filtered.clone(),
                worth,
                moves: None,
            }),
        };
        let MixedView { picture: shown, worth, moves } = mixed.ok_or_else(no_memory)?;
        let known = surfaces.clone();
        let known = known.map(|surfaces| KnownView { surfaces, picture: shown.clone(), worth, moves });
        Ok((FilteredFrame { shown, filtered: Some(filtered), kind, samples }, known))
    }

    /// Error of the denoised picture of these samples, if some were held out, when an estimate is due: `Some(None)` if there are too few.
    /// Pictures with reprojected content have no estimate.
    fn error(
        &mut self,
        kind: Denoise,
        accumulated: &AccumulatedSamples,
        is_over: &dyn Fn() -> bool,
    ) -> Option<Option<ErrorEstimate>> {
        let Self { film, filter, prior, estimated, .. } = self;
        let paths = accumulated.paths() as f64;
        let before = estimated.filter(|(of, _)| *of == kind).map(|(_, paths)| ERROR_RATIO * paths);
        let due = before.unwrap_or(ERROR_FROM * f64::from(film.width) * f64::from(film.height));
        let (filter, apart) = filter.as_mut().zip(accumulated.apart())?;
        if paths < due || prior.is_some() {
            return None;
        }
        *estimated = Some((kind, paths));
        let error =
            filtered_error(&accumulated.replicates(), apart, filter, kind, is_over).inspect_err(|error| {
                tracing::warn!("the error of the filtered picture is not known: {error}");
            });
        (!is_over()).then(|| error.unwrap_or_default())
    }
}

#[cfg(test)]
mod tests;
