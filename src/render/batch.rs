//! Renders a scene file to picture files, without a window.
//!
//! [`render`] sets up a [`BatchRender`], traces it until the sample count, the time, the error or Ctrl-C, and writes pictures
//! and report.

mod in_memory;

pub use in_memory::{RenderedPicture, render_in_memory};

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::accounting::accumulator::CheckpointPolicy;
use crate::accounting::observer::Observer;
use crate::client::oidn::OidnQuality;
use crate::client::{Denoise, Film, Settings, VarianceForm};
use crate::denoise::filtered_picture::{FilteredView, UNKNOWN_FILTERED_ERROR};
use crate::denoise::view_filter::OidnOptions;
use crate::image::stereo::Eye;
use crate::render::adaptive::{self, AdaptiveReport, RenderStage, StagePart};
use crate::render::drive::{Drive, DriveObservers, DriveOutcome, drive};
use crate::render::figures::{Seconds, write_json};
use crate::render::films::{FilmOrder, RenderFilms};
use crate::render::light_groups::{self, GroupFilms, GroupMemory};
use crate::render::live_outputs::{LiveOutputs, LiveRender};
use crate::render::load::{self, Opened};
use crate::render::method::{self, CheckOrder, RenderOrder};
use crate::render::observed::ObservedPicture;
use crate::render::options::RenderOptions;
use crate::render::outputs::{Extras, Outputs};
use crate::render::process::tell;
use crate::render::progress::{Goal, Progress};
use crate::render::rejected::RejectedReport;
use crate::render::report::{ErrorReport, PlanCheck, RenderReport};
use crate::render::run_spec::{RunEnd, RunSpec};
use crate::render::state::{IndexRanges, KeptState, PlannedGoal, Recorder, RenderGoal};
use crate::render::stereo::{self, RightEye};
use crate::render::stereo_error::{EyeErrors, StereoEnd};
use crate::render::stereo_outputs::{self, EyePictures};
use crate::render::timings::TimingCapture;
use crate::render::watch::{RenderWatch, RenderWatcher};
use crate::render::{checks, effect_plan, layers, observed, process, warnings};
use crate::scene::Loaded;
use crate::scene::light_groups::{of_sources, text};
use crate::server::{Server, Stats};
use crate::stream::Lanes;
use crate::stream::control::Epoch;
use crate::study::{ErrorEstimate, ErrorStatus, ExactReplicates, MonitorProgress};
use crate::tracer::integrator::PlanCheckTally;
use crate::tracer::screen::ScreenSampling;
use crate::tracer::{Camera, Scene};

/// Runs the subcommand.
///
/// # Errors
///
/// When a step of the run fails. Outputs are checked before anything is rendered, and replaced only when complete.
pub fn render(mut args: RenderOptions) -> Result<()> {
    let kept = KeptState::plan(&mut args)?;
    let outputs = checks::check(&args, Outputs::plan)?;
    run(&args, &outputs, kept)
}

/// Renders with checked options; keeps the state on disk if `kept` says so.
pub fn run(args: &RenderOptions, outputs: &Outputs, kept: Option<KeptState>) -> Result<()> {
    let start = Instant::now();
    process::listen_for_interrupt();
    let mut batch = BatchRender::set_up(args, outputs, kept)?;
    let traced = batch.trace(outputs, None)?;
    batch.write(outputs, &traced)?;
    batch.seconds.total = start.elapsed().as_secs_f64();
    let report = batch.report(outputs, &traced);
    if let Some(path) = &args.json {
        write_json(&report, path)?;
    }
    if !args.quiet {
        tell(&report.summary());
    }
    batch.check_panic(&traced)
}

/// A render that is set up: scene and film are ready, the tracer's threads sleep.
struct BatchRender<'a> {
    args: &'a RenderOptions,
    settings: Settings,
    run: RunSpec,
    /// Driver of the Vulkan device; `None` on the CPU.
    driver: Option<String>,
    /// When the render ends.
    goal: RenderGoal,
    /// Stages of an adaptive render; empty for an even one.
    stages: Vec<RenderStage>,
    loaded: Loaded,
    scene: Arc<Scene>,
    camera: Camera,
    threads: usize,
    client: Box<dyn Film>,
    /// Films of light groups, if requested.
    groups: Option<GroupFilms>,
    /// The right eye, if there are two.
    right_eye: Option<RightEye>,
    /// Writes the state to disk, if requested.
    recorder: Option<Recorder>,
    /// Sums of the replicates from the kept state: of the camera or left eye, and of the right eye.
    replicates: [Option<ExactReplicates>; 2],
    server: Server,
    lanes: Lanes,
    timings: Option<TimingCapture>,
    seconds: Seconds,
    /// Errors of the denoised pictures of the camera or left eye, and of the right eye, once known.
    filtered_errors: [Option<ErrorEstimate>; 2],
}

/// Outcome of tracing, apart from the film.
struct Traced {
    driven: DriveOutcome,
    stats: Stats,
    /// Result of `--check-plan`.
    tally: Option<Arc<PlanCheckTally>>,
    /// The picture of the camera, or of the left eye.
    picture: ObservedPicture,
    /// The picture of the right eye, if there is one.
    right: Option<ObservedPicture>,
    adaptive: Option<AdaptiveReport>,
}

impl Traced {
    /// The states of the errors of both eyes, if there are two and they are known.
    fn states(&self) -> Option<[&ErrorStatus; 2]> {
        Some([self.picture.status()?, self.right.as_ref()?.status()?])
    }
}

impl<'a> BatchRender<'a> {
    /// Loads the scene, opens the device, chooses the method and makes film and threads.
    fn set_up(args: &'a RenderOptions, outputs: &Outputs, kept: Option<KeptState>) -> Result<Self> {
        let mut seconds = Seconds::default();
        let aovs = args.aov.clone();
        let Opened { input, scene, mut camera, device } =
            load::open_with_layers(&args.source, aovs, &mut seconds)?;
        warnings::tell_warnings(&input.loaded.warnings, &args.source);
        warnings::tell_notices(scene.notices(), &args.source);
        let (settings, threads) = (args.display.clone(), args.source.threads());
        let settings = Settings { denoise: args.denoise, ..settings };
        let mut run = input.run(&args.source, device.name());
        run.first_index = args.first_index;
        run.spp = args.spp.unwrap_or(run.spp);
        run.deterministic = args.deterministic;
        // `--check-plan` compares path by path, so replicates are not needed.
        run.replicated = args.replicates > 1 && args.check_plan == 0.0;
        // A state may be used later for pictures that need the variance.
        let variance = kept.is_some() || outputs.read_variance(&settings);
        // The sub-pixel variance assumes samples of equal weight.
        run.film.variance =
            (variance && !args.adaptive && args.stereo.is_none()).then_some(VarianceForm::Product);
        layers::check_eyes(&run.aovs, args.stereo.is_some())?;
        if outputs.writes_exr() {
            layers::check(&run.aovs, &run.film)?;
        } else if !run.aovs.is_empty() {
            tell("note: layers beside the picture go into EXR files, and none is written: give -o FILE.exr");
        }
        let mut right_camera = None;
        if let Some(options) = &args.stereo {
            let (rig, [left, right], about) = stereo::set_up(options, &input.loaded.desc, &scene, &camera)?;
            if !args.quiet {
                tell(&about);
            }
            (camera, right_camera, run.stereo) = (left, Some(right), Some(rig));
        }
        let (scene, start) = (Arc::new(scene), Instant::now());
        method::choose(&mut run, &scene, &camera, threads);
        seconds.choose = start.elapsed().as_secs_f64();
        if !args.quiet {
            method::tell_choice(&run);
        }
        (run.reweighted, run.adaptive) = (args.reweight_fireflies, args.adaptive);
        let goal = PlannedGoal::new(args, &run, kept.as_ref());
        let stages = if run.adaptive { adaptive::stages(&run, &goal.part)? } else { Vec::new() };
        let until = goal.part.clone();
        let order = FilmOrder {
            run: &run,
            files: &input.files,
            scene: &scene,
            camera: &camera,
            right_eye: right_camera.as_ref(),
            device: &device,
            threads,
        };
        let RenderFilms { film: client, right_eye: right_film, recorder, replicates } =
            RenderFilms::open(&order, kept, goal)?;
        let (scene, groups) = match &args.light_groups {
            Some(arg) => {
                let groups = light_groups::plan(arg, &run, &input.loaded.desc, &scene)?;
                run.light_groups = Some(text(&groups));
                let scene = scene.with_light_groups(&of_sources(&groups), groups.len());
                let films = GroupFilms::new(groups, &run, &device, threads)?;
                if !args.quiet {
                    let memory = if device.gpu().is_some() { GroupMemory::Device } else { GroupMemory::Host };
                    tell(&light_groups::summary(films.groups(), &run, memory));
                }
                (Arc::new(scene), Some(films))
            }
            None => (scene, None),
        };
        let right_eye = right_camera.zip(right_film).map(|(camera, film)| RightEye::new(camera, film, &run));
        let (server, lanes) = Server::start_with(threads, device.tracing_priority()).into_diagnostic()?;
        let timings = args.gpu_timings.as_deref().map(|path| {
            if device.gpu().is_none() {
                tell("note: no GPU is used, so --gpu-timings holds the spans of the CPU only");
            }
            server.set_tracing(true);
            TimingCapture::new(path, device.gpu())
        });
        let (timings, loaded) = (timings.transpose()?, input.loaded);
        Ok(Self {
            args,
            settings,
            run,
            driver: device.gpu().map(|gpu| gpu.info().driver.clone()),
            goal: until,
            stages,
            loaded,
            scene,
            camera,
            threads,
            client,
            groups,
            right_eye,
            recorder,
            replicates,
            server,
            lanes,
            timings,
            seconds,
            filtered_errors: [None; 2],
        })
    }

    /// Starts observing the pictures of a render that is divided into replicates; returns the observer of the camera's or the left eye's.
    fn observe(&mut self, filters: bool) -> Result<Option<Observer>> {
        let [sums, right_sums] = std::mem::take(&mut self.replicates);
        let (run, target) = (&self.run, self.goal.error);
        if !run.replicated {
            return Ok(None);
        }
        let about = self.recorder.as_ref().map(Recorder::about);
        let observe = |camera: &Camera, sums: Option<ExactReplicates>, seen: Option<&MonitorProgress>| {
            let observer = match sums.zip(seen) {
                Some((sums, seen)) => observed::resume(run, target, sums, seen.clone())?,
                None => observed::observe(run, target, CheckpointPolicy::Exact)?,
            };
            if filters && run.can_state_filtered_error() {
                observer.hold_out();
            }
            method::witnesses(run, &self.scene, camera).into_iter().for_each(|paths| observer.call(paths));
            Ok::<_, miette::Report>(observer)
        };
        if let Some(eye) = &mut self.right_eye {
            let seen = about.and_then(|about| about.right_eye.as_ref()).map(|of_eye| &of_eye.progress);
            eye.observer = Some(observe(&eye.camera, right_sums, seen)?);
        }
        observe(&self.camera, sums, about.map(|about| &about.progress)).map(Some)
    }

    /// Traces until the sample count, the time, the error or Ctrl-C, or until `watcher` ends it.
    fn trace(&mut self, outputs: &Outputs, mut watcher: Option<&mut RenderWatcher<'_>>) -> Result<Traced> {
        let filters = self.settings.denoise != Denoise::Off;
        let observer = self.observe(filters)?;
        let (args, run, goal) = (self.args, &self.run, &self.goal);
        let per_index = run.integrator.paths_per_index();
        let bar = Progress::new(
            match (goal.time, goal.indices.end) {
                (Some(limit), _) => Goal::Time(limit),
                (None, u64::MAX) => Goal::Error,
                _ => Goal::Paths(IndexRanges::one(goal.indices.clone()).count().saturating_mul(per_index)),
            },
            args.quiet,
        );
        let done = self.recorder.as_ref().map(|recorder| recorder.about().clone());
        let missing = match &done {
            Some(done) => done.indices.missing(goal.indices.clone()),
            None => IndexRanges::one(goal.indices.clone()),
        };
        let before = done.map_or(Duration::ZERO, |done| Duration::from_secs_f64(done.seconds));
        let texels = run.film.padded_extent().map(f64::from).iter().product();
        let stages = match run.adaptive {
            true => self.stages.clone(),
            false => {
                missing.ranges().iter().map(|range| RenderStage::even(range.clone(), goal.time)).collect()
            }
        };
        let (mut driven, mut tally, mut photons) = (DriveOutcome::new(missing.count() == 0), None, None);
        let (mut stats, mut adaptive) = (Stats::default(), None);
        let mut live = LiveOutputs::start(LiveRender {
            args,
            outputs,
            run,
            desc: &self.loaded.desc,
            scene: &self.scene,
        })?;
        for (number, RenderStage { part, indices: range, until }) in (1..).zip(stages) {
            let time = until.map(|until| until.saturating_sub(before + driven.wall));
            if part != StagePart::Even && time == Some(Duration::ZERO) {
                continue;
            }
            let sampling = match (part, &observer) {
                (StagePart::Pilot, _) => ScreenSampling::Pilot,
                (StagePart::Main, Some(observer)) => {
                    let right = self.right_eye.as_ref().and_then(|eye| eye.observer.as_ref());
                    let (sampling, report) = adaptive::sampling(run, observer, right);
                    adaptive = Some(report);
                    sampling
                }
                _ => ScreenSampling::Even,
            };
            let epoch = Epoch(number);
            let order = RenderOrder {
                scene: self.scene.clone(),
                camera: self.camera.clone(),
                range: method::as_paths(run.integrator, &range),
                window: run.film.window(),
                epoch,
                sampling,
                check: self.check_order()?,
                right_eye: self.right_eye.as_ref().map(|eye| eye.camera.clone()),
            };
            tally = method::start(&self.server, run, order, &mut photons)?;
            let plan = Drive {
                epoch,
                first_index: range.start,
                deterministic: run.deterministic,
                time,
                texels,
                quantity: args.error_at,
            };
            if let Some(recorder) = &mut self.recorder {
                recorder.begin_range();
            }
            let onlookers = DriveObservers {
                bar: &bar,
                timings: &mut self.timings,
                observer: observer.as_ref(),
                recorder: self.recorder.as_mut(),
                live: Some(&mut live),
                groups: self.groups.as_mut(),
                right_eye: self.right_eye.as_mut(),
                watch: watcher.as_mut().map(|call| RenderWatch {
                    call: &mut **call,
                    run,
                    settings: &self.settings,
                    at: args.error_at,
                    before: before + driven.wall,
                }),
            };
            driven.add(drive(plan, &self.server, &mut self.lanes, &mut *self.client, onlookers)?);
            let done = self.server.stats();
            stats.epoch = done.epoch;
            stats.workers.extend(done.workers);
            let is_over = driven.interrupted || driven.reached || driven.panicked.is_some();
            // A time limit may end the pilot; the render then continues with the next stage. The tracer may have completed a stage before the
            // block was taken that met the error target.
            if is_over || (!driven.complete && part != StagePart::Pilot) {
                break;
            }
        }
        bar.finish();
        live.finish(&mut *self.client, self.right_eye.as_mut())?;
        if run.adaptive && adaptive.is_none() && !driven.interrupted {
            tell(
                "note: --adaptive: the render has ended before its pilot, so that the screen was sampled evenly",
            );
        }
        self.server.term();
        let picture = ObservedPicture::end(observer, filters);
        let right = self.right_eye.as_mut().map(|eye| ObservedPicture::end(eye.observer.take(), filters));
        picture.worse(right.as_ref(), args.error_at).log_predictions(run);
        if tally.as_ref().is_some_and(|tally| tally.counts()[0] == 0) {
            tell(&format!(
                "note: --check-plan {} has compared no path: give a larger share",
                args.check_plan
            ));
        }
        self.seconds.render = driven.wall.as_secs_f64();
        self.seconds.rasterise = driven.rasterise.as_secs_f64();
        self.seconds.trace = tracing_time(&stats).as_secs_f64();
        Ok(Traced { driven, stats, tally, picture, right, adaptive })
    }

    /// The check requested by `--check-plan`.
    fn check_order(&self) -> Result<Option<CheckOrder>> {
        let share = self.args.check_plan;
        if share == 0.0 {
            return Ok(None);
        }
        let general = load::prepare(Scene::prepare_general, &self.loaded.desc, self.args.source.simd)?;
        Ok(Some(CheckOrder { share, general: Arc::new(general) }))
    }

    /// Writes all pictures and ends the capture of timings.
    fn write(&mut self, outputs: &Outputs, traced: &Traced) -> Result<()> {
        let outcome = self.end(traced);
        let start = Instant::now();
        let [extras, right_extras] = self.extras(outputs, traced)?;
        let (client, seconds, at) = (&mut *self.client, &mut self.seconds, self.args.error_at);
        let written = match &mut self.right_eye {
            Some(eye) => {
                let end = StereoEnd::new(outcome, traced.states(), self.goal.error.is_some(), at);
                let pictures = EyePictures {
                    films: [client, &mut *eye.film],
                    extras: [extras, right_extras],
                    layout: self.args.stereo.and_then(|stereo| stereo.layout),
                };
                stereo_outputs::write(outputs, pictures, &self.run, &end, &self.settings, seconds)
            }
            None => outputs.write(client, &self.run, &outcome, &self.settings, extras, seconds),
        };
        self.finish_timings(start)?;
        written
    }

    /// The outcome of the run for the metadata of its picture; with two eyes without their errors.
    fn end(&self, traced: &Traced) -> RunEnd {
        let mut outcome = RunEnd {
            prefix: self.is_prefix(&traced.driven),
            rejected: self.rejected(&traced.stats).summary(),
            notes: Vec::new(),
        };
        if let Some(state) = traced.picture.status().filter(|_| self.right_eye.is_none()) {
            outcome.describe(state, self.args.error_at);
        }
        outcome
    }

    /// Ends the capture of timings; pictures were made since `start`.
    fn finish_timings(&mut self, start: Instant) -> Result<()> {
        let Some(mut timings) = self.timings.take() else { return Ok(()) };
        timings.client("display and write", start)?;
        timings.finish(Some(&self.server))
    }

    /// The error of a path that panicked, if one did.
    fn check_panic(&self, traced: &Traced) -> Result<()> {
        let Some((index, message)) = &traced.driven.panicked else { return Ok(()) };
        Err(miette::miette!(
            "path {index} panicked: {message}; the picture holds what was traced before. Please report it with the scene \
             and this command: {}",
            self.replay(traced.tally.as_deref(), *index)
        ))
    }

    /// Layers and denoised pictures of the camera or left eye, and of the right eye.
    fn extras(&mut self, outputs: &Outputs, traced: &Traced) -> Result<[Extras; 2]> {
        let [width, height] = self.run.film.padded_extent().map(f64::from);
        let spp = self.client.counts().paths() as f64 / (width * height);
        let mut extras = [Extras::default(), Extras::default()];
        match &self.right_eye {
            _ if !outputs.writes_exr() => {}
            None => extras[0].layers = layers::trace(&self.run, &self.scene, &self.camera, spp),
            Some(right) => {
                let cameras = [&self.camera, &right.camera];
                for (eye, extras) in Eye::BOTH.into_iter().zip(&mut extras) {
                    extras.layers = layers::trace_eye(&self.run, &self.scene, eye, cameras, spp);
                }
            }
        }
        if let Some(groups) = &mut self.groups {
            extras[0].layers.extend(groups.channels()?);
            extras[1].layers.extend(groups.right_channels()?);
        }
        let start = Instant::now();
        let filter = |picture: &ObservedPicture, camera: &Camera, film: &mut dyn Film| {
            let view = FilteredView { scene: &self.scene, camera, film: &self.run.film };
            let oidn = OidnOptions { threads: self.threads, quality: OidnQuality::High };
            picture.filter(view, &self.run, film, self.settings.denoise, oidn)
        };
        let left = filter(&traced.picture, &self.camera, &mut *self.client)?;
        (extras[0].denoised, self.filtered_errors[0]) = left;
        if let Some((eye, picture)) = self.right_eye.as_mut().zip(traced.right.as_ref()) {
            let right = filter(picture, &eye.camera, &mut *eye.film)?;
            (extras[1].denoised, self.filtered_errors[1]) = right;
        }
        let wants_error = traced.picture.status().is_some_and(|state| self.run.states_filtered_error(state));
        let is_unknown = extras[0].denoised.is_some() && wants_error && self.filtered_errors[0].is_none();
        if is_unknown && self.recorder.is_some() && !self.args.quiet {
            tell(UNKNOWN_FILTERED_ERROR);
        }
        self.seconds.denoise = start.elapsed().as_secs_f64();
        Ok(extras)
    }

    /// Whether the paths of the picture form a prefix of the sequence, without gaps.
    fn is_prefix(&self, driven: &DriveOutcome) -> bool {
        match &self.recorder {
            Some(recorder) => recorder.about().indices.ranges().len() <= 1,
            None => driven.complete || self.run.deterministic,
        }
    }

    /// Rejected values so far.
    fn rejected(&self, stats: &Stats) -> RejectedReport {
        let total = stats.total().rejections;
        let rejections = self.recorder.as_ref().map_or(&total, |recorder| &recorder.about().rejections);
        RejectedReport::new(&self.run, &self.loaded.desc, &self.scene, rejections)
    }

    /// The command that traces `index` again. With `--check-plan`, a path that differs is reproduced only together with all compared paths,
    /// and with `--adaptive` only in the whole render.
    fn replay(&self, tally: Option<&PlanCheckTally>, index: u64) -> String {
        let run = &self.run;
        let per_index = run.integrator.paths_per_index();
        match tally.and_then(PlanCheckTally::reach) {
            Some((first, last)) => run.command(first, (last - first + 1) * per_index) + " --check-plan 1",
            None if run.adaptive => {
                let indices = self
                    .stages
                    .iter()
                    .fold(0u64, |sum, stage| sum.saturating_add(stage.indices.end - stage.indices.start));
                run.command(0, indices.saturating_mul(per_index))
            }
            None => run.command(index, 1),
        }
    }

    /// Errors of the pictures of the camera or left eye, and of the right eye, as far as they are known.
    fn errors(&self, traced: &Traced) -> [Option<ErrorReport>; 2] {
        let (target, at, filter) = (self.goal.error, self.args.error_at, self.settings.denoise);
        let of = |picture: &ObservedPicture, filtered: &Option<ErrorEstimate>| {
            let state = picture.status()?;
            // Each eye reaches the target at its own time.
            let reached = if traced.right.is_some() { state.reached } else { traced.driven.reached };
            let report = ErrorReport::new(state, &self.run, target, at, reached, filter)?;
            Some(report.with_filtered(filtered.as_ref()))
        };
        let [left, right] = &self.filtered_errors;
        [of(&traced.picture, left), traced.right.as_ref().and_then(|picture| of(picture, right))]
    }

    fn report(&self, outputs: &Outputs, traced: &Traced) -> RenderReport {
        let (run, driven, counts) = (&self.run, &traced.driven, self.client.counts());
        let [width, height] = run.film.padded_extent().map(f64::from);
        let per = |n: u64, time: Duration| n as f64 / time.as_secs_f64().max(1e-9);
        let [error, right_error] = self.errors(traced);
        let eyes = traced.states().and_then(|states| EyeErrors::new([error.clone(), right_error], states));
        // Only paths of this run: a resumed state contains others.
        let paths = traced.stats.total().paths * run.integrator.paths_per_index();
        let warnings = self.loaded.warnings.iter().map(ToString::to_string);
        RenderReport {
            version: env!("CARGO_PKG_VERSION"),
            scene: run.scene.clone(),
            width: run.film.width,
            height: run.film.height,
            integrator: run.integrator.name(),
            auto: run.auto.clone(),
            plan: effect_plan::plan(&self.loaded.desc, run, &self.settings),
            left_out: run.left_out().collect(),
            adaptive: traced.adaptive.clone(),
            light_groups: self.groups.as_ref().map(GroupFilms::report).unwrap_or_default(),
            plan_check: traced.tally.as_ref().map(|tally| {
                let [paths, different] = tally.counts();
                PlanCheck { paths, different }
            }),
            camera_samples: counts.camera_samples,
            light_samples: counts.light_samples,
            camera_paths: counts.camera_paths,
            light_paths: counts.light_paths,
            samples_per_pixel: counts.paths() as f64 / (width * height),
            samples_per_second: per(paths, driven.wall),
            paths_per_trace_second: per(paths, tracing_time(&traced.stats)),
            seconds: self.seconds,
            error: error.filter(|_| traced.right.is_none()),
            eyes,
            withheld: self.client.withheld(),
            rejected: self.rejected(&traced.stats),
            device: run.device.clone(),
            driver: self.driver.clone(),
            threads: self.threads,
            simd: self.scene.kernel().name(),
            seed: run.seed,
            deterministic: run.deterministic,
            interrupted: driven.interrupted,
            peak_memory_bytes: process::peak_memory_bytes(),
            warnings: warnings.chain(self.scene.notices().iter().cloned()).collect(),
            outputs: outputs.files().cloned().collect(),
        }
    }
}

/// CPU time that the tracer's threads spent tracing, or wall time if the system does not report it.
fn tracing_time(stats: &Stats) -> Duration {
    let total = stats.total();
    total.cpu.unwrap_or(total.busy)
}
