//! When the picture in the window is filtered: the thread of the noise filter, and the last picture of it.

use std::sync::Arc;
use std::time::Duration;

use crate::client::retained::RetainedSamples;
use crate::client::{Denoise, FilmData, Settings};
use crate::denoise::filtered_picture::FilteredPicture;
use crate::denoise::noise_filter::{EpochView, FilteredFrame, NoiseFilter};
use crate::gpu::Gpu;
use crate::render::run_spec::RunSpec;
use crate::study::ErrorEstimate;

/// The filter of the window. Its thread starts with the first picture that asks for it, and stays.
pub struct WindowFilter {
    thread: Option<NoiseFilter>,
    /// Threads of the run.
    threads: usize,
    /// The error of what it shows is stated.
    states_error: bool,
    /// The filter that was asked for last.
    kind: Denoise,
    /// The thread could not be started.
    refused: bool,
    /// What the present epoch shows.
    view: Option<EpochView>,
    /// A picture has come that was not shown yet.
    fresh: bool,
}

impl WindowFilter {
    /// A filter without a thread of its own yet; filters that bring their own use as many as this.
    pub fn new(threads: usize) -> Self {
        let kind = Denoise::default();
        Self { thread: None, threads, states_error: true, kind, refused: false, view: None, fresh: false }
    }

    /// The same for a picture whose error is not stated.
    pub fn without_error(self) -> Self {
        Self { states_error: false, ..self }
    }

    /// Notes which filter the settings ask for.
    pub fn choose(&mut self, settings: &Settings) {
        self.kind = settings.denoise;
    }

    /// Computes wavelets on this device from the next view on, or on the processor.
    pub fn set_device(&mut self, device: Option<Arc<Gpu>>) {
        if let Some(thread) = &mut self.thread {
            thread.set_device(device);
        }
    }

    /// Begins with another epoch. Where the settings say so, the last picture stands in for its samples.
    pub fn begin_epoch(&mut self, run: &RunSpec, view: EpochView, settings: &Settings) {
        self.view = Some(view);
        self.choose(settings);
        self.begin_film(run, Some(self.kind).filter(|_| settings.reproject && is_asked_for(run, settings)));
    }

    /// Begins with an empty film of the present epoch.
    pub fn begin(&mut self, run: &RunSpec) {
        self.begin_film(run, None);
    }

    fn begin_film(&mut self, run: &RunSpec, reproject: Option<Denoise>) {
        self.fresh = false;
        if let Some((thread, view)) = self.thread.as_mut().zip(self.view.clone()) {
            thread.begin(run.film, view, self.states_error && run.can_state_filtered_error(), reproject);
        }
    }

    /// Starts the thread. It begins with the samples of the film, if they are all kept, and otherwise with the next epoch; features are
    /// traced at once where there `is_picture` already. Wavelets are computed on this device, or on the processor.
    pub fn start(
        &mut self,
        run: &RunSpec,
        kept: &RetainedSamples,
        is_picture: bool,
        device: Option<Arc<Gpu>>,
    ) {
        // Without a thread the picture stays as it is.
        self.thread = NoiseFilter::start(self.threads).ok();
        self.refused = self.thread.is_none();
        self.set_device(device);
        self.begin(run);
        let Some(thread) = self.thread.as_mut().filter(|_| kept.complete()) else { return };
        kept.each(|samples, first_index, paths| thread.samples(first_index, paths, samples));
        if is_picture {
            thread.prepare(self.kind);
        }
    }

    /// Starts the thread with an epoch of which no sample is there yet; features are traced once the settings ask for a filter.
    pub fn start_anew(
        &mut self,
        run: &RunSpec,
        view: EpochView,
        settings: &Settings,
        device: Option<Arc<Gpu>>,
    ) {
        self.view = Some(view);
        if run.replicated {
            self.thread = NoiseFilter::start(self.threads).ok();
            self.set_device(device);
            self.begin(run);
        }
        self.prepare_for(run, settings);
    }

    /// Notes which filter the settings ask for, and traces features where they ask for one.
    pub fn prepare_for(&mut self, run: &RunSpec, settings: &Settings) {
        self.choose(settings);
        if is_asked_for(run, settings) {
            self.prepare();
        }
    }

    /// Whether the thread must be started to show the picture so.
    pub fn is_wanting(&self, run: &RunSpec, settings: &Settings) -> bool {
        is_asked_for(run, settings) && self.thread.is_none() && !self.refused && self.view.is_some()
    }

    /// The thread, which is to have a copy of all samples.
    pub fn thread(&self) -> Option<&NoiseFilter> {
        self.thread.as_ref()
    }

    /// The first picture of the epoch is shown: features may be traced.
    pub fn prepare(&mut self) {
        self.thread.iter_mut().for_each(|thread| thread.prepare(self.kind));
    }

    /// Whether pictures of this many samples with these settings can be made now.
    pub fn is_ready(&self, run: &RunSpec, settings: &Settings, samples: u64) -> bool {
        let thread = self.thread.as_ref().filter(|_| is_asked_for(run, settings));
        thread.is_some_and(|thread| thread.is_ready(settings.denoise, &run.film, samples))
    }

    /// Whether they can be filtered now, or by and by.
    pub fn will_be_ready(&self, run: &RunSpec, settings: &Settings, samples: u64) -> bool {
        let thread = self.thread.as_ref().filter(|_| is_asked_for(run, settings));
        thread.is_some_and(|thread| thread.will_be_ready(settings.denoise, &run.film, samples))
    }

    /// Whether the last picture was asked to stand in for samples, and has not yet.
    pub fn is_reprojecting(&self) -> bool {
        self.thread.as_ref().is_some_and(NoiseFilter::is_reprojecting)
    }

    /// Views that another one has stood in for since the start.
    pub fn reprojections(&self) -> u64 {
        self.thread.as_ref().map_or(0, NoiseFilter::reprojections)
    }

    /// Whether a picture is being filtered.
    pub fn is_busy(&self) -> bool {
        self.thread.as_ref().is_some_and(NoiseFilter::is_busy)
    }

    /// Begins to filter what was given so far: `samples` samples of a film with these sums.
    pub fn filter(&mut self, samples: u64, data: Option<FilmData>) {
        if let Some(thread) = &mut self.thread {
            thread.filter(self.kind, samples, data);
        }
    }

    /// Takes over a picture that was filtered, if one is there; returns how long it took.
    pub fn poll(&mut self) -> Option<Duration> {
        let time = self.thread.as_mut()?.poll()?;
        self.fresh = true;
        Some(time)
    }

    /// Waits for the picture that is being filtered.
    pub fn wait(&mut self) {
        self.thread.iter_mut().for_each(NoiseFilter::wait);
    }

    /// Whether a picture has come that was not shown yet.
    pub fn is_fresh(&self) -> bool {
        self.fresh
    }

    /// The last picture was shown.
    pub fn is_seen(&mut self) {
        self.fresh = false;
    }

    /// The last filtered picture of the present film, if these settings show it.
    pub fn shown(&self, run: &RunSpec, settings: &Settings) -> Option<&FilteredFrame> {
        let shown = self.thread.as_ref().filter(|_| is_asked_for(run, settings)).and_then(NoiseFilter::shown);
        shown.filter(|frame| frame.kind == settings.denoise)
    }

    /// The error of the picture that these settings show through the filter, as it was when it was estimated last.
    pub fn error(&self, settings: &Settings) -> Option<&ErrorEstimate> {
        self.thread.as_ref().and_then(|thread| thread.error(settings.denoise))
    }

    /// Takes the last filtered picture, without anything of another view.
    pub fn take(&mut self) -> Option<FilteredPicture> {
        self.thread.as_mut().and_then(NoiseFilter::take_shown).and_then(|frame| frame.filtered)
    }
}

/// Whether these settings show the picture of a render through the filter, which needs both randomisations.
fn is_asked_for(run: &RunSpec, settings: &Settings) -> bool {
    run.replicated && !settings.view.is_error() && settings.denoise != Denoise::Off
}
