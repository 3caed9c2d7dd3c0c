//! What is known of the samples of the picture: an observer of the error for each eye, and the noise filter, which reads from the accounts of
//! both. Each eye is seen alone.

use std::sync::Arc;

use miette::Result;

use crate::accounting::accumulator::CheckpointPolicy;
use crate::accounting::observer::{ObservedRender, Observer};
use crate::client::Settings;
use crate::client::film::VulkanFilm;
use crate::denoise::noise_filter::{EpochView, FilteredFrame};
use crate::gpu::Gpu;
use crate::image::stereo::Eye;
use crate::job::Job;
use crate::render::run_spec::RunSpec;
use crate::render::{method, observed};
use crate::study::{ErrorEstimate, ErrorStatus, ErrorTarget};
use crate::viewer::picture::regions::RegionRender;
use crate::viewer::picture::{LivePicture, TARGET};

/// What the accounts of an eye's picture begin with; samples are held out for the error of the denoised picture if that can be stated. Of the
/// predictions those about the left eye's picture are logged, since the other's are of the same paths.
fn accounts(eye: Eye, run: &RunSpec, target: Option<ErrorTarget>) -> ObservedRender {
    let mut render = observed::observed(run, target, CheckpointPolicy::WhenIdle);
    if run.can_state_filtered_error() {
        render.samples.hold_out();
    }
    if eye == Eye::Right {
        render.log = Box::new(|_| ());
    }
    render
}

impl LivePicture {
    /// Observers of the error of the picture of the left eye, or the only one, and of the right eye.
    pub fn observers(&self) -> impl Iterator<Item = &Observer> {
        self.observer.iter().chain(&self.right_observer)
    }

    /// The same with their eyes.
    fn observers_mut(&mut self) -> impl Iterator<Item = (Eye, &mut Observer)> {
        Eye::BOTH.into_iter().zip(self.observer.iter_mut().chain(&mut self.right_observer))
    }

    /// The state of the error of the left and of the right eye's picture; `None` for one eye, and where errors are not known.
    pub fn states_of_eyes(&self) -> Option<[Arc<ErrorStatus>; 2]> {
        Some([self.observer.as_ref()?.state(), self.right_observer.as_ref()?.state()])
    }

    /// The eye whose picture has the larger error, which decides when a target is reached; the left one for one eye.
    pub fn worse_eye(&self) -> Eye {
        let Some(states) = self.states_of_eyes() else { return Eye::Left };
        let [left, right] = states.map(|state| state.estimate.relative[TARGET.at.index()].value);
        if right > left { Eye::Right } else { Eye::Left }
    }

    /// Error observer of what is being traced: a region, or the whole picture; of two eyes that of the [worse](Self::worse_eye).
    pub fn present_observer(&self) -> Option<&Observer> {
        match (self.regions.traced(), self.worse_eye()) {
            (Some(region), _) => region.observer(),
            (None, Eye::Left) => self.observer.as_ref(),
            (None, Eye::Right) => self.right_observer.as_ref(),
        }
    }

    /// The error target of the observers.
    pub fn target(&self) -> ErrorTarget {
        self.observer.as_ref().and_then(Observer::target).unwrap_or(TARGET)
    }

    /// Sets the relative error that is the target of the observers.
    pub fn aim(&mut self, error: f64) {
        let target = Some(ErrorTarget { error, ..TARGET });
        self.observers_mut().for_each(|(_, observer)| observer.set_target(target));
        let of_regions = self.regions.iter_mut().filter_map(RegionRender::observer_mut);
        of_regions.for_each(|observer| observer.set_target(target));
    }

    /// Begins the accounts of another epoch, seen by these eyes.
    ///
    /// # Errors
    ///
    /// When the system gives no thread for the right eye's.
    pub(super) fn begin_accounts(&mut self, run: &RunSpec, views: &[EpochView]) -> Result<()> {
        let has_right = self.observer.is_some() && views.len() > 1;
        if has_right && self.right_observer.is_none() {
            let target = Some(self.target());
            self.right_observer = Some(observed::observe(run, target, CheckpointPolicy::WhenIdle)?);
        } else if !has_right && let Some(closed) = self.right_observer.take() {
            // Its threads may be at work, which another thread waits for.
            let _ = Job::start("accounts of the right eye", move |_| drop(closed)).map(Job::abandon);
        }
        for ((eye, observer), view) in self.observers_mut().zip(views) {
            let witnesses = method::witnesses(run, &view.scene, &view.camera);
            observer.begin(accounts(eye, run, observer.target()).with_witnesses(witnesses));
        }
        Ok(())
    }

    /// Begins the accounts of the same epoch again, for a film that is filled from its first sample on.
    pub(super) fn begin_accounts_again(&mut self, run: &RunSpec) {
        for (eye, observer) in self.observers_mut() {
            observer.begin_again(accounts(eye, run, observer.target()));
        }
    }

    /// Takes over denoised pictures; returns whether the next repaint shows denoised pictures.
    pub(super) fn look_at_filter(&mut self, run: &RunSpec, settings: &Settings) -> bool {
        self.filter.choose(settings);
        // A device that is the CPU has no time to spare for the filter.
        let is_beside = self.film().is_some_and(|film| !film.is_summed_on_host());
        let device: Option<Arc<Gpu>> = self.gpu().filter(|_| is_beside).cloned();
        match self.filter.is_wanting(run, settings) {
            true => {
                let accounts = self.observers().map(Observer::account).collect();
                self.filter.start(run, accounts, !self.unseen, device.as_ref());
            }
            false => self.filter.set_device(device.as_ref()),
        }
        if let Some(time) = self.filter.poll() {
            self.pacer.filtered(time);
            self.filter_time += time;
        }
        self.filter.is_ready(run, settings, self.samples()) && !self.mix.is_mixing()
    }

    /// The last denoised picture of each eye, if these settings show them. A light mix is not denoised: the filter has the samples of unmixed
    /// light.
    pub(super) fn filtered_frames(&self, run: &RunSpec, settings: &Settings) -> Option<Vec<&FilteredFrame>> {
        let eyes = 1 + usize::from(self.film().is_some_and(VulkanFilm::has_right_eye));
        let frames = self.filter.shown_of_eyes(run, settings);
        frames.filter(|frames| frames.len() == eyes && !self.mix.is_mixing())
    }

    /// Error estimate of the denoised picture, of two eyes of the [worse](Self::worse_eye), if these settings show it. The inner `None`: not
    /// known, as where regions have other samples.
    pub fn filtered_error(&self, run: &RunSpec, settings: &Settings) -> Option<Option<&ErrorEstimate>> {
        self.filtered_frames(run, settings)?;
        Some(self.filter.error(self.worse_eye(), settings).filter(|_| self.regions.is_empty()))
    }

    /// Begins to denoise the samples so far.
    pub(super) fn filter_now(&mut self) {
        let samples = self.samples();
        // If the sums are on the device, denoised pictures have no sub-pixel detail.
        let film = self.film_mut().filter(|film| film.is_summed_on_host() && !film.is_coarse());
        let data = film.and_then(|film| {
            let eyes = film.begin_develop_eyes().ok()?;
            eyes.into_iter().map(|eye| eye.wait().ok()).collect()
        });
        self.filter.filter(samples, data.unwrap_or_default());
    }
}
