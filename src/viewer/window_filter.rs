//! Schedules denoising of the picture in the window: the filter thread, and the last denoised picture. Of two eyes each has a thread of its
//! own, which sees that eye alone, and both pictures are shown together.

use std::sync::Arc;
use std::time::Duration;

use crate::accounting::accumulator::AccountReader;
use crate::client::{Denoise, FilmData, Settings};
use crate::denoise::filtered_picture::FilteredPicture;
use crate::denoise::noise_filter::{CarryOver, EpochView, FilteredFrame, NoiseFilter};
use crate::gpu::Gpu;
use crate::image::stereo::Eye;
use crate::job::Job;
use crate::render::run_spec::RunSpec;
use crate::stream::UvWindow;
use crate::study::ErrorEstimate;
use crate::tracer::screen::ScreenDensity;

/// Noise filter of the window. Its threads start with the first request and stay.
pub struct WindowFilter {
    /// The filter thread of each eye, the left one's first, once they run.
    threads_of_eyes: Vec<NoiseFilter>,
    /// Number of threads for filters that bring their own.
    threads: usize,
    /// The selected filter.
    kind: Denoise,
    /// Whether a thread could not be started.
    refused: bool,
    /// Views of the eyes in the present epoch; none before the first.
    views: Vec<EpochView>,
    /// Longest time that one of the pictures took which have arrived while that of the other eye was still being denoised.
    arrived: Option<Duration>,
    /// Whether there is a denoised picture that has not been shown.
    pub fresh: bool,
}

impl WindowFilter {
    /// A filter without a thread yet; filters with threads of their own use this many.
    pub fn new(threads: usize) -> Self {
        Self {
            threads_of_eyes: Vec::new(),
            threads,
            kind: Denoise::default(),
            refused: false,
            views: Vec::new(),
            arrived: None,
            fresh: false,
        }
    }

    /// Selects the filter of the settings.
    pub fn choose(&mut self, settings: &Settings) {
        self.kind = settings.denoise;
    }

    /// Computes wavelets on this device from the next view on; on the CPU if `None`.
    pub fn set_device(&mut self, device: Option<&Arc<Gpu>>) {
        self.threads_of_eyes.iter_mut().for_each(|thread| thread.set_device(device.cloned()));
    }

    /// Begins another epoch with the view of each eye. If the settings say so, the last picture is reprojected and shown until there are samples,
    /// and steers the first of those over the window that is `steerable`.
    pub fn begin_epoch(
        &mut self,
        run: &RunSpec,
        views: Vec<EpochView>,
        settings: &Settings,
        steerable: Option<UvWindow>,
    ) {
        if views.len() < self.threads_of_eyes.len() {
            // Its work is cancelled, which another thread waits for.
            let closed = self.threads_of_eyes.split_off(views.len());
            let _ = Job::start("noise filter of the right eye", move |_| drop(closed)).map(Job::abandon);
        }
        self.views = views;
        self.choose(settings);
        let carry = CarryOver { kind: self.kind, steered: steerable.filter(|_| settings.steer) };
        self.begin_film(run, Some(carry).filter(|_| settings.reproject && is_asked_for(run, settings)));
    }

    /// Takes the density for the first samples of the epoch, once, if they are to be steered.
    pub fn take_steering(&mut self) -> Option<Arc<ScreenDensity>> {
        self.threads_of_eyes.first_mut().and_then(NoiseFilter::take_steering)
    }

    /// Begins with an empty film in the present epoch.
    pub fn begin(&mut self, run: &RunSpec) {
        self.begin_film(run, None);
    }

    fn begin_film(&mut self, run: &RunSpec, carry: Option<CarryOver>) {
        (self.fresh, self.arrived) = (false, None);
        for (thread, view) in self.threads_of_eyes.iter_mut().zip(&self.views) {
            thread.begin(run.film, view.clone(), carry);
        }
    }

    /// Starts the threads on the present film, each with the account of its eye's samples; features are traced at once if there `is_picture`
    /// already. Wavelets are computed on this device, or on the CPU. The threads that run already begin again.
    pub fn start(
        &mut self,
        run: &RunSpec,
        accounts: Vec<AccountReader>,
        is_picture: bool,
        device: Option<&Arc<Gpu>>,
    ) {
        // If a thread cannot be started, the picture stays noisy.
        let missing = accounts.into_iter().take(self.views.len()).skip(self.threads_of_eyes.len());
        let started = missing.map_while(|account| NoiseFilter::start(self.threads, account).ok());
        self.threads_of_eyes.extend(started);
        self.refused = !self.is_running();
        self.set_device(device);
        self.begin(run);
        if is_picture {
            self.prepare();
        }
    }

    /// Starts the thread in an epoch of one eye without samples yet; features are traced once the settings select a filter.
    pub fn start_anew(
        &mut self,
        run: &RunSpec,
        account: Option<AccountReader>,
        view: EpochView,
        settings: &Settings,
        device: Option<&Arc<Gpu>>,
    ) {
        self.views = vec![view];
        self.start(run, account.into_iter().collect(), false, device);
        self.prepare_for(run, settings);
    }

    /// Selects the filter of the settings, and traces features if there is one.
    pub fn prepare_for(&mut self, run: &RunSpec, settings: &Settings) {
        self.choose(settings);
        if is_asked_for(run, settings) {
            self.prepare();
        }
    }

    /// Whether every eye has its thread.
    fn is_running(&self) -> bool {
        !self.views.is_empty() && self.threads_of_eyes.len() == self.views.len()
    }

    /// Whether these settings need the threads and they are not running.
    pub fn is_wanting(&self, run: &RunSpec, settings: &Settings) -> bool {
        is_asked_for(run, settings) && !self.is_running() && !self.refused && !self.views.is_empty()
    }

    /// Allows tracing of features, once the first picture of the epoch is shown.
    pub fn prepare(&mut self) {
        self.threads_of_eyes.iter_mut().for_each(|thread| thread.prepare(self.kind));
    }

    /// Whether pictures of this many samples can be denoised with these settings now.
    pub fn is_ready(&self, run: &RunSpec, settings: &Settings, samples: u64) -> bool {
        self.all_of(run, settings, |thread| thread.is_ready(settings.denoise, &run.film, samples))
    }

    /// Whether they can be denoised now or later.
    pub fn will_be_ready(&self, run: &RunSpec, settings: &Settings, samples: u64) -> bool {
        self.all_of(run, settings, |thread| thread.will_be_ready(settings.denoise, &run.film, samples))
    }

    /// Whether these settings show denoised pictures and this holds for the thread of every eye.
    fn all_of(&self, run: &RunSpec, settings: &Settings, holds: impl Fn(&NoiseFilter) -> bool) -> bool {
        is_asked_for(run, settings) && self.is_running() && self.threads_of_eyes.iter().all(holds)
    }

    /// Whether a reprojection was requested and is not finished.
    pub fn is_reprojecting(&self) -> bool {
        self.threads_of_eyes.iter().any(NoiseFilter::is_reprojecting)
    }

    /// Number of views that began with a reprojection since the start.
    pub fn reprojections(&self) -> u64 {
        self.threads_of_eyes.first().map_or(0, NoiseFilter::reprojections)
    }

    /// Whether the filter is running, for one of the eyes at least.
    pub fn is_busy(&self) -> bool {
        self.threads_of_eyes.iter().any(NoiseFilter::is_busy)
    }

    /// Begins to denoise the samples given so far: `samples` samples of a film whose eyes have these sums, which may be left out.
    pub fn filter(&mut self, samples: u64, data: Vec<FilmData>) {
        let data = data.into_iter().map(Some).chain(std::iter::repeat_with(|| None));
        for (thread, data) in self.threads_of_eyes.iter_mut().zip(data) {
            thread.filter(self.kind, samples, data);
        }
    }

    /// Takes over a denoised picture of every eye, if they have arrived; returns how long the slowest took.
    pub fn poll(&mut self) -> Option<Duration> {
        let taken = self.threads_of_eyes.iter_mut().filter_map(NoiseFilter::poll);
        self.arrived = taken.chain(self.arrived.take()).max();
        // The pictures of both eyes are shown together.
        let is_awaited = self.is_busy() || self.is_reprojecting();
        let time = if is_awaited { None } else { self.arrived.take() };
        self.fresh |= time.is_some();
        time
    }

    /// Blocks until the running filter has finished.
    pub fn wait(&mut self) {
        self.threads_of_eyes.iter_mut().for_each(NoiseFilter::wait);
    }

    /// The last denoised picture of the present film, of two eyes that of the left, if these settings show it.
    pub fn shown(&self, run: &RunSpec, settings: &Settings) -> Option<&FilteredFrame> {
        self.shown_of_eyes(run, settings).and_then(|frames| frames.into_iter().next())
    }

    /// The last denoised picture of each eye, the left one's first, if these settings show them and there is one of every eye.
    pub fn shown_of_eyes(&self, run: &RunSpec, settings: &Settings) -> Option<Vec<&FilteredFrame>> {
        let threads =
            Some(&self.threads_of_eyes).filter(|_| is_asked_for(run, settings) && self.is_running());
        threads?.iter().map(|thread| thread.shown().filter(|frame| frame.kind == settings.denoise)).collect()
    }

    /// Last error estimate of this eye's denoised picture that these settings show.
    pub fn error(&self, eye: Eye, settings: &Settings) -> Option<&ErrorEstimate> {
        self.threads_of_eyes.get(eye as usize).and_then(|thread| thread.error(settings.denoise))
    }

    /// Takes the last denoised picture of each eye, without reprojected content; `None` unless there is one of every eye.
    pub fn take(&mut self) -> Option<Vec<FilteredPicture>> {
        let take = |thread: &mut NoiseFilter| thread.take_shown().and_then(|frame| frame.filtered);
        let pictures: Option<Vec<_>> = self.threads_of_eyes.iter_mut().map(take).collect();
        pictures.filter(|pictures| !pictures.is_empty() && pictures.len() == self.views.len())
    }
}

/// Whether these settings show a denoised picture of this render, which needs both randomisations.
fn is_asked_for(run: &RunSpec, settings: &Settings) -> bool {
    run.replicated && !settings.view.is_error() && settings.denoise != Denoise::Off
}
