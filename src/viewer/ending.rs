//! Shutdown of the window: writes pictures and figures, and determines the exit code.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

use miette::{IntoDiagnostic, Result};
use serde::Serialize;

use crate::accounting::observer::Observer;
use crate::client::window::statistics::RecentValues;
use crate::client::{Denoise, Film, Settings};
use crate::gpu;
use crate::remote::{Health, TracerStatus};
use crate::render::effect_plan::PlannedEffect;
use crate::render::figures::{Seconds, human, write_json};
use crate::render::light_groups::GroupFilms;
use crate::render::observed::ObservedPicture;
use crate::render::outputs::Extras;
use crate::render::process;
use crate::render::process::tell;
use crate::render::rejected::RejectedReport;
use crate::render::report::ErrorReport;
use crate::render::run_spec::{ChoiceReport, RunEnd};
use crate::render::stereo_error::{EyeErrors, StereoEnd};
use crate::scene::desc::StereoRig;
use crate::study::ErrorQuantile;
use crate::viewer::Viewer;
use crate::viewer::picture::output::ComposedFilm;
use crate::viewer::screen::Screen;
use crate::viewer::tools::layers_in;

/// Longest wait for the last samples, once the tracer was told to stop.
const LAST_SAMPLES: Duration = Duration::from_secs(2);

/// Statistics of a session. Field names are the JSON keys; times in milliseconds.
#[derive(Serialize)]
struct ViewReport {
    version: &'static str,
    scene: PathBuf,
    integrator: &'static str,
    /// Reason for the integrator, if the program chose it.
    #[serde(skip_serializing_if = "Option::is_none")]
    auto: Option<ChoiceReport>,
    device: String,
    /// The eyes, if there are two.
    #[serde(skip_serializing_if = "Option::is_none")]
    stereo: Option<StereoRig>,
    /// Every effect, on or off, and why.
    plan: Vec<PlannedEffect>,
    /// Values of the last epoch that were negative or not finite, by cause and origin.
    rejected: RejectedReport,
    /// Effects that were forced off.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    left_out: Vec<&'static str>,
    /// How tracer and display share the processor.
    cores: String,
    threads: usize,
    /// Tracers on other machines.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    tracers: Vec<TracerReport>,
    /// SIMD instruction set of the ray traversal.
    simd: &'static str,
    width: u32,
    height: u32,
    /// Time from program start to the first picture.
    first_picture_ms: Option<f64>,
    frames: u64,
    frame_ms: TimePercentiles,
    edit_latency_ms: TimePercentiles,
    edits: usize,
    /// Mean number of samples on screen, keyed by seconds after an edit, over edits that no other edit followed in that time.
    samples_after_edit: BTreeMap<String, f64>,
    /// Time from an edit until the last worker has left the old epoch.
    abort_ms: TimePercentiles,
    aborts: usize,
    stalls: u64,
    epochs: u64,
    /// Number of views that began with a reprojection of the previous picture.
    reprojections: u64,
    /// Number of views whose first camera paths were steered by that.
    steered_epochs: u64,
    resizes: u64,
    device_losses: u32,
    surface_losses: u32,
    validation_messages: usize,
    seconds: f64,
    traced_samples: u64,
    rasterised_samples: u64,
    traced_samples_per_second: f64,
    rasterised_samples_per_second: f64,
    /// Error of the last picture, if known and there is one eye.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ErrorReport>,
    /// Errors of the last pictures of two eyes, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    eyes: Option<EyeErrors>,
    passes_ms: BTreeMap<&'static str, f64>,
    peak_memory_bytes: Option<u64>,
}

/// Final status of a remote tracer. Field names are JSON keys.
#[derive(Serialize)]
struct TracerReport {
    address: String,
    well: bool,
    state: String,
}

impl From<TracerStatus> for TracerReport {
    fn from(status: TracerStatus) -> Self {
        let TracerStatus { address, health, words, .. } = status;
        Self { address, well: health == Health::Well, state: words }
    }
}

/// Percentiles of times in milliseconds. Field names are JSON keys.
#[derive(Serialize)]
struct TimePercentiles {
    p50: f32,
    p95: f32,
    p99: f32,
}

impl TimePercentiles {
    fn of(values: &RecentValues) -> Self {
        let [p50, p95, p99] = values.percentiles([50.0, 95.0, 99.0]);
        Self { p50, p95, p99 }
    }
}

impl Viewer {
    /// Stops the tracer, writes all requested files, and closes the window. The error is the reason for closing, if it was not the user, or
    /// else the first file that could not be written.
    pub(super) fn finish(mut self) -> Result<()> {
        let lasted = self.metrics.started.elapsed().as_secs_f64();
        self.session.abort();
        if !self.options.outputs.is_empty()
            && let Err(error) = self.picture.read_rest(&mut self.session, LAST_SAMPLES)
        {
            // The film is lost; the retained samples are not.
            tell(&format!("the last samples could not be rasterised: {error}"));
        }
        if let Err(error) = self.send_to_tev(true) {
            tell(&format!("tev does not show the last samples: {error}"));
        }
        let report = self.report(lasted);
        self.preferences.write(&self.panel.controls.layout);
        self.tools.files.saves.finish().iter().for_each(|message| tell(message));
        let capture = self.capture.take();
        let captured = capture.map_or(Ok(()), |capture| capture.finish(self.session.tracers.server()));
        // If no window was ever opened there is no picture, and the reason has been reported already.
        let wanted = !self.options.outputs.is_empty() && self.picture.screen.is_some();
        if let Some(loader) = self.loader.as_ref().filter(|_| wanted) {
            let path = loader.source.args.scene.display();
            tell(&format!(
                "note: the window was closed while {path} was still being read: pictures show what was read before"
            ));
        }
        let written = if wanted { self.write_pictures() } else { Ok(()) };
        let panicked = self.session.panicked.clone();
        let Self { picture, panel, options, outcome, .. } = self;
        if gpu::display_lost() {
            // The window's resources are left to the operating system: the event loop has ended, so nothing can complete their destruction.
            std::mem::forget((picture, panel));
        }
        let told = options.json.map_or(Ok(()), |path| write_json(&report, &path));
        outcome.and(written).and(captured).and(told)?;
        match panicked {
            Some((index, message)) => {
                Err(miette::miette!("path {index} panicked: {message}; please report it"))
            }
            None => Ok(()),
        }
    }

    fn report(&self, seconds: f64) -> ViewReport {
        let (session, metrics, screen) = (&self.session, &self.metrics, self.picture.screen.as_ref());
        let (run, [width, height]) = (session.run_spec(), session.size());
        let (traced, rasterised) = (session.traced(), self.picture.rasterised);
        let (error, eyes) = self.last_errors();
        ViewReport {
            version: env!("CARGO_PKG_VERSION"),
            scene: run.scene.clone(),
            integrator: run.integrator.name(),
            auto: run.auto.clone(),
            device: run.device.clone(),
            stereo: run.stereo,
            plan: self.panel.plan(session, &self.editor),
            left_out: run.left_out().collect(),
            rejected: session.rejected(&self.editor),
            cores: session.processor_sharing.clone(),
            threads: session.tracers.threads(),
            tracers: session.tracers.status().into_iter().map(TracerReport::from).collect(),
            simd: self.editor.scene().kernel().name(),
            width,
            height,
            first_picture_ms: metrics.first.map(|first| first.as_secs_f64() * 1e3),
            frames: metrics.presented,
            frame_ms: TimePercentiles::of(&metrics.frames),
            edit_latency_ms: TimePercentiles::of(&metrics.edits),
            edits: metrics.edits.iter().count(),
            samples_after_edit: metrics.samples_after_edit(),
            abort_ms: TimePercentiles::of(&session.aborts),
            aborts: session.aborts.iter().count(),
            stalls: metrics.stalls,
            epochs: metrics.epochs,
            reprojections: self.picture.filter.reprojections(),
            steered_epochs: session.steered_epochs,
            resizes: metrics.resizes,
            device_losses: screen.map_or(0, |screen| screen.device_losses),
            surface_losses: screen.map_or(0, |screen| screen.surface_losses),
            validation_messages: screen.map_or(0, Screen::validation_messages),
            seconds,
            traced_samples: traced,
            rasterised_samples: rasterised,
            traced_samples_per_second: traced as f64 / seconds.max(1e-9),
            rasterised_samples_per_second: rasterised as f64 / seconds.max(1e-9),
            error,
            eyes,
            passes_ms: metrics.passes.iter().copied().collect(),
            peak_memory_bytes: process::peak_memory_bytes(),
        }
    }

    /// Error of the last picture, or those of two eyes. Also logs the predictions of the picture, or of the worse one, and their outcomes.
    fn last_errors(&self) -> (Option<ErrorReport>, Option<EyeErrors>) {
        let (run, target) = (self.session.run_spec(), Some(self.picture.target()));
        let at = ErrorQuantile::P95;
        let end = |observer: &Observer| ObservedPicture { error: Some(observer.end()), accumulated: None };
        let pictures: Vec<_> = self.picture.observers().map(end).collect();
        let Some((first, right)) = pictures.split_first() else { return (None, None) };
        first.worse(right.first(), at).log_predictions(run);
        let filter = self.picture.filter_shown(run, &self.panel.controls.settings);
        let report = |picture: &ObservedPicture| {
            let state = picture.status()?;
            ErrorReport::new(state, run, target, at, state.reached, filter)
        };
        let states = right.first().and_then(|right| Some([first.status()?, right.status()?]));
        match (right.first(), states) {
            (None, _) => (report(first), None),
            (Some(right), Some(states)) => (None, EyeErrors::new([report(first), report(right)], states)),
            (Some(_), None) => (None, None),
        }
    }

    /// Writes the requested pictures from the film or, if it is lost, from the retained samples.
    fn write_pictures(&mut self) -> Result<()> {
        let outcome = self.picture.outcome(&self.session, &self.editor);
        let settings = &self.panel.controls.settings;
        let mut denoised = self.picture.filtered(self.session.run_spec(), settings);
        let denoise = if denoised.is_empty() { Denoise::Off } else { settings.denoise };
        let settings = Settings { denoise, ..settings.flat() };
        let films = self.picture.mix.films().filter(|_| self.options.outputs.writes_exr());
        let layers = films.map_or(Ok(Vec::new()), GroupFilms::channels).unwrap_or_else(|error| {
            tell(&format!("the pictures of the groups of lights are lost: {error}"));
            Vec::new()
        });
        let run = self.editor.present_run_spec(&self.options.name, self.session.run_spec());
        let run = run.unwrap_or_else(|error| {
            tell(&format!("the changes of the scene could not be saved: {error}"));
            self.session.run_spec().clone()
        });
        let (outputs, mut seconds) = (&self.options.outputs, Seconds::default());
        let has_right_eye = run.stereo.is_some();
        let in_layers =
            outputs.files().filter(|_| has_right_eye).filter_map(|path| layers_in(path, &settings));
        in_layers.for_each(|told| tell(&told));
        let samples = self.picture.counts().samples();
        let mut failed = None;
        if has_right_eye {
            let mut take = |path| self.picture.snapshot_of(path, &self.session, &settings, &denoised);
            let snapshots = outputs.files().map(|path: &PathBuf| Ok((path, take(path)?)));
            match snapshots.collect::<Result<Vec<_>>>() {
                Ok(snapshots) => {
                    let written = snapshots.into_iter();
                    let written = written.map(|(path, it)| it.write(path, &run, &outcome, &settings));
                    return written.fold(Ok(()), Result::and);
                }
                Err(error) => failed = Some(error),
            }
        }
        let extras = Extras { denoised: denoised.pop(), layers };
        let mut taken = self.picture.take_film();
        let written = match &mut taken {
            _ if failed.is_some() => failed.map_or(Ok(()), Err),
            Some(film) if film.is_damaged() => Err(miette::miette!("the film has lost samples")),
            Some(film) => {
                let (regions, mix) = (&mut self.picture.regions, &mut self.picture.mix);
                let mut film = ComposedFilm { film, regions, mix };
                outputs.write(&mut film, &run, &outcome.both, &settings, extras, &mut seconds)
            }
            None => Err(miette::miette!("there is no film")),
        };
        let Err(error) = written else { return Ok(()) };
        let mut film = self.picture.film_without_device(run.film, taken).into_diagnostic()?;
        let (kept, samples) = (film.counts().samples(), samples.max(self.picture.lost()));
        let of = if kept < samples {
            format!(", from {} of its {} samples", human(kept as f64), human(samples as f64))
        } else {
            String::new()
        };
        let StereoEnd { eyes: [of_left, _], both } = outcome;
        let left = if has_right_eye { of_left } else { both };
        let eye = if has_right_eye { ", of the left eye alone" } else { "" };
        tell(&format!("{error}; the picture is made without the device{eye}{of}"));
        outputs.write(
            &mut film,
            &run,
            &RunEnd { prefix: false, ..left },
            &Settings { denoise: Denoise::Off, ..settings },
            Extras::default(),
            &mut seconds,
        )
    }
}
