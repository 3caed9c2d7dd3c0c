//! Schedules denoising of the picture in the window: the filter thread, and the last denoised picture.

use std::sync::Arc;
use std::time::Duration;

use crate::accounting::accumulator::AccountReader;
use crate::client::{Denoise, FilmData, Settings};
use crate::denoise::filtered_picture::FilteredPicture;
use crate::denoise::noise_filter::{CarryOver, EpochView, FilteredFrame, NoiseFilter};
use crate::gpu::Gpu;
use crate::render::run_spec::RunSpec;
use crate::stream::UvWindow;
use crate::study::ErrorEstimate;
use crate::tracer::screen::ScreenDensity;

/// Noise filter of the window. Its thread starts with the first request and stays.
pub struct WindowFilter {
    /// The filter thread, once it runs.
    pub thread: Option<NoiseFilter>,
    /// Number of threads for filters that bring their own.
    threads: usize,
    /// The selected filter.
    kind: Denoise,
    /// Whether the thread could not be started.
    refused: bool,
    /// View of the present epoch.
    view: Option<EpochView>,
    /// Whether there is a denoised picture that has not been shown.
    pub fresh: bool,
}

impl WindowFilter {
    /// A filter without a thread yet; filters with threads of their own use this many.
    pub fn new(threads: usize) -> Self {
        let kind = Denoise::default();
        Self { thread: None, threads, kind, refused: false, view: None, fresh: false }
    }

    /// Selects the filter of the settings.
    pub fn choose(&mut self, settings: &Settings) {
        self.kind = settings.denoise;
    }

    /// Computes wavelets on this device from the next view on; on the CPU if `None`.
    pub fn set_device(&mut self, device: Option<Arc<Gpu>>) {
        if let Some(thread) = &mut self.thread {
            thread.set_device(device);
        }
    }

    /// Begins another epoch. If the settings say so, the last picture is reprojected and shown until there are samples, and steers the first of
    /// those over the window that is `steerable`.
    pub fn begin_epoch(
        &mut self,
        run: &RunSpec,
        view: EpochView,
        settings: &Settings,
        steerable: Option<UvWindow>,
    ) {
        self.view = Some(view);
        self.choose(settings);
        let carry = CarryOver { kind: self.kind, steered: steerable.filter(|_| settings.steer) };
        self.begin_film(run, Some(carry).filter(|_| settings.reproject && is_asked_for(run, settings)));
    }

    /// Takes the density for the first samples of the epoch, once, if they are to be steered.
    pub fn take_steering(&mut self) -> Option<Arc<ScreenDensity>> {
        self.thread.as_mut().and_then(NoiseFilter::take_steering)
    }

    /// Begins with an empty film in the present epoch.
    pub fn begin(&mut self, run: &RunSpec) {
        self.begin_film(run, None);
    }

    fn begin_film(&mut self, run: &RunSpec, carry: Option<CarryOver>) {
        self.fresh = false;
        if let Some((thread, view)) = self.thread.as_mut().zip(self.view.clone()) {
            thread.begin(run.film, view, carry);
        }
    }

    /// Starts the thread on the present film; features are traced at once if there `is_picture` already. Wavelets are computed on this
    /// device, or on the CPU.
    pub fn start(
        &mut self,
        run: &RunSpec,
        account: Option<AccountReader>,
        is_picture: bool,
        device: Option<Arc<Gpu>>,
    ) {
        // If no thread can be started, the picture stays noisy.
        self.thread = account.and_then(|account| NoiseFilter::start(self.threads, account).ok());
        self.refused = self.thread.is_none();
        self.set_device(device);
        self.begin(run);
        if is_picture {
            self.prepare();
        }
    }

    /// Starts the thread in an epoch without samples yet; features are traced once the settings select a filter.
    pub fn start_anew(
        &mut self,
        run: &RunSpec,
        account: Option<AccountReader>,
        view: EpochView,
        settings: &Settings,
        device: Option<Arc<Gpu>>,
    ) {
        self.view = Some(view);
        self.start(run, account, false, device);
        self.prepare_for(run, settings);
    }

    /// Selects the filter of the settings, and traces features if there is one.
    pub fn prepare_for(&mut self, run: &RunSpec, settings: &Settings) {
        self.choose(settings);
        if is_asked_for(run, settings) {
            self.prepare();
        }
    }

    /// Whether these settings need the thread and it is not running.
    pub fn is_wanting(&self, run: &RunSpec, settings: &Settings) -> bool {
        is_asked_for(run, settings) && self.thread.is_none() && !self.refused && self.view.is_some()
    }

    /// Allows tracing of features, once the first picture of the epoch is shown.
    pub fn prepare(&mut self) {
        self.thread.iter_mut().for_each(|thread| thread.prepare(self.kind));
    }

    /// Whether a picture of this many samples can be denoised with these settings now.
    pub fn is_ready(&self, run: &RunSpec, settings: &Settings, samples: u64) -> bool {
        let thread = self.thread.as_ref().filter(|_| is_asked_for(run, settings));
        thread.is_some_and(|thread| thread.is_ready(settings.denoise, &run.film, samples))
    }

    /// Whether it can be denoised now or later.
    pub fn will_be_ready(&self, run: &RunSpec, settings: &Settings, samples: u64) -> bool {
        let thread = self.thread.as_ref().filter(|_| is_asked_for(run, settings));
        thread.is_some_and(|thread| thread.will_be_ready(settings.denoise, &run.film, samples))
    }

    /// Whether the filter is running.
    pub fn is_busy(&self) -> bool {
        self.thread.as_ref().is_some_and(NoiseFilter::is_busy)
    }

    /// Begins to denoise the samples given so far: `samples` samples of a film with these sums.
    pub fn filter(&mut self, samples: u64, data: Option<FilmData>) {
        if let Some(thread) = &mut self.thread {
            thread.filter(self.kind, samples, data);
        }
    }

    /// Takes over a denoised picture, if there is one; returns how long it took.
    pub fn poll(&mut self) -> Option<Duration> {
        let time = self.thread.as_mut()?.poll()?;
        self.fresh = true;
        Some(time)
    }

    /// Blocks until the running filter has finished.
    pub fn wait(&mut self) {
        self.thread.iter_mut().for_each(NoiseFilter::wait);
    }

    /// The last denoised picture of the present film, if these settings show it.
    pub fn shown(&self, run: &RunSpec, settings: &Settings) -> Option<&FilteredFrame> {
        let shown = self.thread.as_ref().filter(|_| is_asked_for(run, settings)).and_then(NoiseFilter::shown);
        shown.filter(|frame| frame.kind == settings.denoise)
    }

    /// Last error estimate of the denoised picture that these settings show.
    pub fn error(&self, settings: &Settings) -> Option<&ErrorEstimate> {
        self.thread.as_ref().and_then(|thread| thread.error(settings.denoise))
    }

    /// Takes the last denoised picture, without reprojected content.
    pub fn take(&mut self) -> Option<FilteredPicture> {
        self.thread.as_mut().and_then(NoiseFilter::take_shown).and_then(|frame| frame.filtered)
    }
}

/// Whether these settings show a denoised picture of this render, which needs both randomisations.
fn is_asked_for(run: &RunSpec, settings: &Settings) -> bool {
    run.replicated && !settings.view.is_error() && settings.denoise != Denoise::Off
}
