//! What is left behind when the window closes, for whatever reason: pictures, figures, an exit code.

use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};
use serde::Serialize;

use crate::app::error_report::ErrorReport;
use crate::app::plan::PlannedEffect;
use crate::app::report::{Seconds, write_json};
use crate::app::run_spec::ChoiceReport;
use crate::app::view::screen::Screen;
use crate::app::view::viewer::Viewer;
use crate::app::{process, tell};
use crate::client::reference::ReferenceFilm;
use crate::client::window::statistics::Recent;
use crate::client::{Client, ClientError};
use crate::gpu;

/// Longest time that the last samples are waited for.
const LAST_SAMPLES: Duration = Duration::from_secs(2);

/// Figures of a session. Field names are the JSON keys; times in milliseconds.
#[derive(Serialize)]
struct Report {
    version: &'static str,
    scene: std::path::PathBuf,
    integrator: &'static str,
    /// Why, where the program chose it.
    #[serde(skip_serializing_if = "Option::is_none")]
    auto: Option<ChoiceReport>,
    device: String,
    /// Every effect, on or off, and why.
    plan: Vec<PlannedEffect>,
    /// Effects that were forced off.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    left_out: Vec<&'static str>,
    /// How tracer and display share the processor.
    cores: String,
    threads: usize,
    /// Instructions that walked the rays.
    simd: &'static str,
    width: u32,
    height: u32,
    /// From the start of the viewer, with the scene loaded, to the first picture.
    first_picture_ms: Option<f64>,
    frames: u64,
    frame_ms: Percentiles,
    edit_latency_ms: Percentiles,
    edits: usize,
    /// From an edit to the last worker leaving the old epoch.
    abort_ms: Percentiles,
    aborts: usize,
    stalls: u64,
    epochs: u64,
    resizes: u64,
    device_losses: u32,
    surface_losses: u32,
    validation_messages: usize,
    seconds: f64,
    traced_samples: u64,
    rasterised_samples: u64,
    traced_samples_per_second: f64,
    rasterised_samples_per_second: f64,
    /// How wrong the last picture is, if that is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<ErrorReport>,
    passes_ms: std::collections::BTreeMap<&'static str, f64>,
    peak_memory_bytes: Option<u64>,
}

#[derive(Serialize)]
struct Percentiles {
    p50: f32,
    p95: f32,
    p99: f32,
}

impl Percentiles {
    fn of(values: &Recent) -> Self {
        let [p50, p95, p99] = values.percentiles([50.0, 95.0, 99.0]);
        Self { p50, p95, p99 }
    }
}

/// Stops the tracer, writes what was asked for, and gives back why the window closed.
///
/// # Errors
///
/// The reason, if it was not the user's wish, or else the first file that could not be written.
pub fn finish(mut viewer: Viewer) -> Result<()> {
    let lasted = viewer.figures.started.elapsed().as_secs_f64();
    viewer.session.abort();
    let last = viewer.last_samples();
    let report = viewer.report(lasted);
    viewer.saving.finish().iter().for_each(|message| tell(message));
    let json = viewer.plan.json.clone();
    let panicked = viewer.session.panicked().cloned();
    let outcome = std::mem::replace(&mut viewer.outcome, Ok(()));
    let captured = viewer.capture.take().map_or(Ok(()), |capture| capture.finish(viewer.session.server()));
    let written = last.and_then(|()| write_pictures(viewer));
    let told = json.map_or(Ok(()), |path| write_json(&report, &path));
    outcome.and(written).and(captured).and(told)?;
    match panicked {
        Some((index, message)) => Err(miette::miette!("path {index} panicked: {message}; please report it")),
        None => Ok(()),
    }
}

impl Viewer {
    /// Takes what the workers have sent.
    fn last_samples(&mut self) -> Result<()> {
        if self.plan.outputs.is_empty() {
            return Ok(());
        }
        let start = Instant::now();
        while !self.session.is_through() && start.elapsed() < LAST_SAMPLES || !self.kept.caught_up() {
            self.session.events();
            if let Err(error) = self.read(1 << 16) {
                // The film is lost; kept samples are not.
                tell(&format!("the last samples could not be rasterised: {error}"));
                break;
            }
            if self.screen.as_mut().and_then(Screen::film).is_none() {
                break;
            }
            if !self.session.is_through() {
                self.session.wait(Duration::from_millis(5));
            }
        }
        Ok(())
    }

    fn report(&mut self, seconds: f64) -> Report {
        let (traced, error) = (self.session.traced(), self.last_error());
        let figures = &self.figures;
        let losses = self.screen.as_ref().map_or([0; 2], |screen| screen.losses);
        Report {
            version: env!("CARGO_PKG_VERSION"),
            scene: self.plan.run.scene.clone(),
            integrator: self.plan.run.integrator.name(),
            auto: self.plan.run.auto.clone(),
            device: self.plan.run.device.clone(),
            plan: self.list(),
            left_out: self.plan.run.left_out().collect(),
            cores: self.plan.cores.clone(),
            threads: self.session.threads(),
            simd: self.user.scene().kernel().name(),
            width: self.size[0],
            height: self.size[1],
            first_picture_ms: figures.first.map(|first| first.as_secs_f64() * 1e3),
            frames: figures.presented,
            frame_ms: Percentiles::of(&figures.frames),
            edit_latency_ms: Percentiles::of(&figures.edits),
            edits: figures.edits.iter().count(),
            abort_ms: Percentiles::of(&self.session.aborts),
            aborts: self.session.aborts.iter().count(),
            stalls: figures.stalls,
            epochs: figures.epochs,
            resizes: figures.resizes,
            device_losses: losses[0],
            surface_losses: losses[1],
            validation_messages: self.screen.as_ref().map_or(0, Screen::validation_messages),
            seconds,
            traced_samples: traced,
            rasterised_samples: figures.rasterised,
            traced_samples_per_second: traced as f64 / seconds.max(1e-9),
            rasterised_samples_per_second: figures.rasterised as f64 / seconds.max(1e-9),
            error,
            passes_ms: figures.passes.iter().copied().collect(),
            peak_memory_bytes: process::peak_memory_bytes(),
        }
    }
}

/// Writes the pictures asked for, from the film or, where that is lost, from the kept samples.
fn write_pictures(mut viewer: Viewer) -> Result<()> {
    // Where no window was ever opened there is no picture, and the reason is told already.
    if viewer.plan.outputs.is_empty() || viewer.screen.is_none() {
        viewer.close();
        return Ok(());
    }
    let prefix = viewer.session.is_complete();
    let settings = viewer.controls.settings.clone();
    let run = viewer.facts_now().unwrap_or_else(|error| {
        tell(&format!("the changes of the scene could not be saved: {error}"));
        viewer.plan.run.clone()
    });
    let film = viewer.screen.as_mut().and_then(Screen::take_film);
    let mut seconds = Seconds::default();
    let outputs = &viewer.plan.outputs;
    let mut written = Err(miette::miette!("there is no film"));
    if let Some(film) = film {
        let mut client = Client::Vulkan(film);
        written = outputs.write(&mut client, (&run, prefix), &settings, &mut seconds);
        // Before the device's window goes.
        drop(client);
    }
    if let Err(error) = &written {
        tell(&format!("{error}; the picture is made without the device"));
        let mut client = from_kept(&mut viewer).into_diagnostic()?;
        written = viewer.plan.outputs.write(&mut client, (&run, false), &settings, &mut seconds);
    }
    viewer.close();
    written
}

/// The CPU twin of the film, filled with the samples that are kept.
fn from_kept(viewer: &mut Viewer) -> Result<Client, ClientError> {
    let mut film = ReferenceFilm::new(viewer.spec(), 0)?;
    viewer.kept.rewind();
    while let Some((samples, _, paths)) = viewer.kept.feed() {
        film.count_paths(paths);
        film.add(samples)?;
    }
    film.flush()?;
    Ok(Client::Reference(film))
}

impl Viewer {
    /// Ends the threads and closes the window. Where its display is gone, what belongs to it is left to the system: nobody
    /// answers any more.
    fn close(self) {
        if gpu::display_lost() {
            std::mem::forget(self.screen);
            std::mem::forget(self.ui);
        }
    }
}
