//! Renders the pictures of a study: one scene, one device and one set of threads, reused for all pictures.

use std::sync::Arc;
use std::time::Duration;

use miette::{IntoDiagnostic, Result};

use crate::accounting::accumulator::CheckpointPolicy;
use crate::accounting::observer::Observer;
use crate::client::{Denoise, DisplayImage, Film, FilmData, FilmSpec, Settings, develop};
use crate::cmd::args::StudyArgs;
use crate::color::Profile;
use crate::denoise::filtered_picture::{FilteredPicture, HalfMeans};
use crate::denoise::view_filter::ViewFilter;
use crate::image::Grid;
use crate::render::adaptive::{self, RenderStage, StagePart};
use crate::render::device::Device;
use crate::render::drive::{Drive, DriveObservers, DriveOutcome, drive};
use crate::render::figures::Seconds;
use crate::render::light_groups::GroupFilms;
use crate::render::load::{self, Opened};
use crate::render::method::{self, RenderOrder};
use crate::render::options::SceneOptions;
use crate::render::progress::{Goal, Progress};
use crate::render::run_spec::{RunSpec, shown_variance};
use crate::render::state::RenderGoal;
use crate::render::{observed, warnings};
use crate::scene::SceneDesc;
use crate::scene::desc::IntegratorKind;
use crate::scene::light_groups::LightGroup;
use crate::server::{Server, Stats};
use crate::stream::Lanes;
use crate::stream::control::Epoch;
use crate::study::brightness::MeanLuminance;
use crate::study::error_tile::ReplicatePixel;
use crate::study::prediction::PredictionOutcome;
use crate::study::{ErrorEstimate, ErrorQuantile, ErrorStatus, Replicates};
use crate::tracer::screen::ScreenSampling;
use crate::tracer::{Camera, Scene};

/// Renders of at least this duration use witness paths.
const WITNESSED: Duration = Duration::from_secs(1);

/// Limit of a render.
#[derive(Clone, Copy, Debug)]
pub enum RenderLimit {
    Time(Duration),
    Paths(u64),
}

/// Range of a trial's pixel count: enough tiles for a quantile, and few enough to reach many samples per pixel quickly.
const TRIAL_PIXELS: [f64; 2] = [12_000.0, 40_000.0];

/// Pixels of a trial per second of the study's budget, within these bounds.
const PIXELS_PER_SECOND: f64 = 400.0;

/// A picture with fewer than this many times the pixels of a trial is its own trial.
const WORTH_A_TRIAL: f64 = 2.5;

/// A prepared scene, with everything to render it.
pub struct StudyRenderer {
    /// Specification of all runs, which differ in method and seed.
    pub run: RunSpec,
    /// A smaller film of the same view, for trials; `None` if the picture itself is small.
    pub trial: Option<FilmSpec>,
    pub scene: Arc<Scene>,
    pub camera: Camera,
    pub desc: SceneDesc,
    /// Display settings.
    pub settings: Settings,
    /// Rasterisation device.
    pub device: Device,
    /// Tracing threads.
    pub threads: usize,
    /// Seconds to load and prepare the scene.
    pub load_seconds: f64,
    film: StudyFilm,
    /// The previous film, which may be used again.
    spare: Option<StudyFilm>,
    /// Noise filter of the view, and the film it is for.
    filter: Option<(FilmSpec, ViewFilter)>,
    server: Server,
    lanes: Lanes,
    epoch: Epoch,
}

/// A film with its specification.
struct StudyFilm {
    spec: FilmSpec,
    kappa: Option<f32>,
    client: Box<dyn Film>,
}

/// A rendered picture with its statistics.
pub struct StudyRender {
    /// Linear Rec.709, without reconstruction blur.
    pub rgb: Grid<[f32; 3]>,
    /// Whether every pixel has samples.
    pub is_complete: bool,
    /// Sums of the film.
    pub data: FilmData,
    /// Time and end of the render.
    pub driven: DriveOutcome,
    pub stats: Stats,
    /// Error status from its replicates; empty for an undivided run.
    pub state: Arc<ErrorStatus>,
    /// Predictions with their outcomes.
    pub predictions: Vec<PredictionOutcome>,
    /// Mean and difference of its replicates per pixel; empty for an undivided run.
    pub pixels: Vec<ReplicatePixel>,
    /// Sums of its replicates; `None` for an undivided run.
    replicates: Option<Arc<Replicates>>,
}

impl StudyRender {
    /// Error estimated from its replicates, if known.
    pub fn estimate(&self) -> Option<ErrorEstimate> {
        self.state.checkpoints.last().map(|_| self.state.estimate)
    }

    /// Mean luminance of each replicate.
    pub fn brightness(&self) -> Vec<MeanLuminance> {
        self.replicates.iter().flat_map(|sums| sums.mean_luminances()).flatten().collect()
    }
}

/// Name of the CPU, as reported by the system.
pub fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let name = name.map_or(std::env::consts::ARCH, |(_, name)| name.trim());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{name}, {cores} cores")
}

impl StudyRenderer {
    /// Loads and prepares the scene of a command line.
    pub fn new(args: &StudyArgs, source: &SceneOptions) -> Result<Self> {
        let mut seconds = Seconds::default();
        let Opened { input, scene, camera, device } = load::open(source, &mut seconds)?;
        warnings::tell_warnings(&input.loaded.warnings, source);
        warnings::tell_notices(scene.notices(), source);
        let settings = args.display.settings();
        let mut run = input.run(source, device.name());
        run.film.variance = shown_variance(&settings);
        let threads = source.threads();
        let film = StudyFilm { spec: run.film, kappa: None, client: device.client(run.film, threads, None)? };
        let trial = trial(run.film, args.budget.as_secs_f64());
        let (server, lanes) = Server::start_with(threads, device.tracing_priority()).into_diagnostic()?;
        Ok(Self {
            run,
            trial,
            scene: Arc::new(scene),
            camera,
            desc: input.loaded.desc,
            settings,
            device,
            threads,
            load_seconds: seconds.load + seconds.prepare,
            film,
            spare: None,
            filter: None,
            server,
            lanes,
            epoch: Epoch(0),
        })
    }

    /// Texels of the film, including overscan.
    pub fn texels(&self) -> f64 {
        texels(&self.run.film)
    }

    /// Specification of a run by method `kind` with this seed.
    pub fn run(&self, kind: IntegratorKind, seed: u32) -> RunSpec {
        RunSpec { integrator: kind, seed, ..self.run.clone() }
    }

    /// Renders the scene.
    pub fn trace(&mut self, run: &RunSpec, limit: RenderLimit) -> Result<StudyRender> {
        self.trace_other(run, self.scene.clone(), self.camera.clone(), limit)
    }

    /// Renders another scene on the same film.
    pub fn trace_other(
        &mut self,
        run: &RunSpec,
        scene: Arc<Scene>,
        camera: Camera,
        limit: RenderLimit,
    ) -> Result<StudyRender> {
        self.trace_with(run, scene, camera, limit, None)
    }

    /// Renders a scene with light groups, with a picture for each.
    pub fn trace_grouped(
        &mut self,
        run: &RunSpec,
        scene: Arc<Scene>,
        groups: Vec<LightGroup>,
        limit: RenderLimit,
    ) -> Result<StudyRender> {
        let mut groups = GroupFilms::new(groups, run, &self.device, self.threads)?;
        self.trace_with(run, scene, self.camera.clone(), limit, Some(&mut groups))
    }

    fn trace_with(
        &mut self,
        run: &RunSpec,
        scene: Arc<Scene>,
        camera: Camera,
        limit: RenderLimit,
        mut groups: Option<&mut GroupFilms>,
    ) -> Result<StudyRender> {
        self.use_film(run.film, run.reweighted)?;
        self.film.client.clear();
        let (goal, time) = match limit {
            RenderLimit::Time(time) => {
                (RenderGoal { indices: 0..u64::MAX, time: Some(time), error: None }, Some(time))
            }
            RenderLimit::Paths(paths) => (RenderGoal { indices: 0..paths, time: None, error: None }, None),
        };
        let stages = match run.adaptive {
            true => adaptive::stages(run, &goal)?,
            false => vec![RenderStage::even(goal.indices, time)],
        };
        let observer =
            run.replicated.then(|| observed::observe(run, None, CheckpointPolicy::Exact)).transpose()?;
        // The error that a user is shown includes witness paths; in shorter renders they would take too much of the time.
        let has_witnesses = time.is_some_and(|time| time >= WITNESSED);
        let witnesses = has_witnesses.then(|| method::witnesses(run, &scene, &camera)).flatten();
        if let Some((observer, witnesses)) = observer.as_ref().zip(witnesses) {
            observer.call(witnesses);
        }
        let bar = Progress::new(Goal::Error, true);
        let (mut driven, mut stats) = (DriveOutcome::new(false), Stats::default());
        for RenderStage { part, indices, until } in stages {
            let time = until.map(|until| until.saturating_sub(driven.wall));
            if part != StagePart::Even && time == Some(Duration::ZERO) {
                continue;
            }
            let sampling = match (part, &observer) {
                (StagePart::Pilot, _) => ScreenSampling::Pilot,
                (StagePart::Main, Some(observer)) => adaptive::sampling(run, observer, None).0,
                _ => ScreenSampling::Even,
            };
            self.epoch = self.epoch.next();
            // Stages of an adaptive render count indices, limits count paths.
            let range = match run.adaptive {
                true => method::as_paths(run.integrator, &indices),
                false => indices.clone(),
            };
            let order = RenderOrder {
                scene: scene.clone(),
                camera: camera.clone(),
                range,
                window: run.film.window(),
                epoch: self.epoch,
                sampling,
                check: None,
                right_eye: None,
            };
            method::start(&self.server, run, order, &mut None)?;
            let plan = Drive {
                epoch: self.epoch,
                first_index: indices.start,
                deterministic: false,
                time,
                texels: texels(&run.film),
                quantity: ErrorQuantile::P95,
            };
            let onlookers = DriveObservers {
                bar: &bar,
                timings: &mut None,
                observer: observer.as_ref(),
                recorder: None,
                live: None,
                groups: groups.as_deref_mut(),
                right_eye: None,
                watch: None,
            };
            let client = &mut *self.film.client;
            driven.add(drive(plan, &self.server, &mut self.lanes, client, onlookers)?);
            let done = self.server.stats();
            stats.epoch = done.epoch;
            stats.workers.extend(done.workers);
            if driven.interrupted
                || driven.panicked.is_some()
                || (!driven.complete && part != StagePart::Pilot)
            {
                break;
            }
        }
        if let Some((index, message)) = &driven.panicked {
            miette::bail!("path {index} panicked: {message}: {}", run.command(*index, 1));
        }
        let replicates =
            observer.as_ref().and_then(Observer::accumulated).map(|samples| samples.replicates());
        let pixels = replicates.as_ref().and_then(|replicates| replicates.pixels()).unwrap_or_default();
        let (state, predictions) = observer.as_ref().map(Observer::end).unwrap_or_default();
        let data = self.film.client.develop().into_diagnostic()?;
        let [width, height] = [run.film.width, run.film.height].map(|side| side as usize);
        let rgb = Grid::from_rows(width, height, develop::linear_rgb(&data, &Profile::srgb()));
        let rgb = rgb.ok_or_else(|| miette::miette!("the film has another size than its picture"))?;
        let is_complete = data.camera.iter().all(|sum| sum[3] > 0.0);
        Ok(StudyRender { rgb, is_complete, data, driven, stats, state, predictions, pixels, replicates })
    }

    /// The displayed denoised picture of this scene, and its linear pixels; `None` for an undivided run, and if memory runs out.
    pub fn filtered(
        &mut self,
        film: &FilmSpec,
        traced: &StudyRender,
    ) -> Result<Option<(DisplayImage, Vec<[f32; 3]>)>> {
        if self.filter.as_ref().is_none_or(|(of, _)| of != film) {
            let filter = ViewFilter::new(&self.scene, &self.camera, film, &|| false);
            self.filter = filter.map(|filter| (*film, filter));
        }
        let (Some((_, filter)), Some(replicates)) = (&mut self.filter, &traced.replicates) else {
            return Ok(None);
        };
        let picture = HalfMeans::of(replicates).and_then(|halves| {
            FilteredPicture::of(replicates, &halves, Some(&traced.data), filter, Denoise::Wavelet)
        });
        let Ok(picture) = picture else { return Ok(None) };
        let from_xyz = Profile::srgb().from_xyz;
        let linear = picture.xyz().pixels().iter().map(|xyz| (from_xyz * *xyz).to_array()).collect();
        Ok(Some((picture.display(&self.settings)?, linear)))
    }

    /// Makes this film current, empty or as it was left.
    fn use_film(&mut self, spec: FilmSpec, kappa: Option<f32>) -> Result<()> {
        let fits = |film: &StudyFilm| film.spec == spec && film.kappa == kappa;
        if fits(&self.film) {
            return Ok(());
        }
        let wanted = match self.spare.take().filter(fits) {
            Some(film) => film,
            None => StudyFilm { spec, kappa, client: self.device.client(spec, self.threads, kappa)? },
        };
        self.spare = Some(std::mem::replace(&mut self.film, wanted));
        Ok(())
    }

    /// Displays the last picture with some settings.
    pub fn show(&mut self, settings: &Settings) -> Result<DisplayImage> {
        self.film.client.display(settings).into_diagnostic()
    }
}

fn texels(film: &FilmSpec) -> f64 {
    let [width, height] = film.padded_extent().map(f64::from);
    width * height
}

/// Film of a trial: the same view with fewer pixels.
fn trial(film: FilmSpec, budget: f64) -> Option<FilmSpec> {
    let [width, height] = [film.width, film.height].map(f64::from);
    let pixels = (PIXELS_PER_SECOND * budget).clamp(TRIAL_PIXELS[0], TRIAL_PIXELS[1]);
    let scale = (pixels / (width * height)).sqrt();
    let side = |pixels: f64| (scale * pixels).round().max(1.0) as u32;
    (width * height > WORTH_A_TRIAL * pixels).then(|| FilmSpec {
        width: side(width),
        height: side(height),
        variance: None,
        ..film
    })
}
