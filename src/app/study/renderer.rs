//! Renders the pictures of a study: one scene, one device and one set of threads, which stay warm from picture to picture.

use std::sync::Arc;
use std::time::{Duration, Instant};

use miette::{IntoDiagnostic, Result};

use crate::app::args::StudyArgs;
use crate::app::args::scene::SceneArgs;
use crate::app::denoise::ViewFilter;
use crate::app::device::Device;
use crate::app::drive::{Drive, DriveObservers, DriveOutcome, drive};
use crate::app::filtered_picture::{FilteredPicture, HalfMeans};
use crate::app::load::{self, Opened};
use crate::app::method::{self, RenderOrder};
use crate::app::observer::{Beside, Observer};
use crate::app::progress::{Goal, Progress};
use crate::app::report::Seconds;
use crate::app::run_spec::{RunSpec, shown_variance};
use crate::client::{Denoise, DisplayImage, Film, FilmData, FilmSpec, Settings, develop};
use crate::color::Profile;
use crate::image::Grid;
use crate::scene::SceneDesc;
use crate::scene::desc::IntegratorKind;
use crate::server::{Server, Stats};
use crate::stream::Lanes;
use crate::stream::control::Epoch;
use crate::study::error::ReplicatePixel;
use crate::study::prediction::PredictionOutcome;
use crate::study::{ErrorEstimate, ErrorQuantile, ErrorStatus, Replicates};
use crate::tracer::{Camera, Scene};

/// How long a picture is traced.
#[derive(Clone, Copy, Debug)]
pub enum RenderLimit {
    Time(Duration),
    Paths(u64),
}

/// A prepared scene and all that renders it.
pub struct StudyRenderer {
    /// The specification of all runs, which differ in method and seed.
    pub run: RunSpec,
    pub scene: Arc<Scene>,
    pub camera: Camera,
    pub desc: SceneDesc,
    /// How pictures are shown.
    pub settings: Settings,
    /// The device that rasterises them.
    pub device: Device,
    /// Tracing threads.
    pub threads: usize,
    /// Seconds to load and prepare the scene.
    pub load_seconds: f64,
    client: Box<dyn Film>,
    server: Server,
    lanes: Lanes,
    epoch: Epoch,
}

/// A picture and the record of its render.
pub struct StudyRender {
    /// Linear Rec.709, unblurred.
    pub rgb: Grid<[f32; 3]>,
    /// The sums.
    pub data: FilmData,
    pub shown: DisplayImage,
    /// Time and end of the render.
    pub driven: DriveOutcome,
    pub stats: Stats,
    /// Seconds from sums to displayed picture.
    pub display_seconds: f64,
    /// The error that its replicates state; empty for an undivided run.
    pub state: Arc<ErrorStatus>,
    /// Its predictions and their outcomes.
    pub predictions: Vec<PredictionOutcome>,
    /// Mean and difference of its replicates; empty for an undivided run.
    pub pixels: Vec<ReplicatePixel>,
    /// The sums of its replicates; `None` for an undivided run.
    replicates: Option<Replicates>,
}

impl StudyRender {
    /// The error that its replicates state, if it is known.
    pub fn estimate(&self) -> Option<ErrorEstimate> {
        self.state.checkpoints.last().map(|_| self.state.estimate)
    }
}

/// The processor's name, as far as the system tells.
pub fn cpu() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let name = name.map_or(std::env::consts::ARCH, |(_, name)| name.trim());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{name}, {cores} cores")
}

impl StudyRenderer {
    /// Loads and prepares the scene of a command line.
    pub fn new(args: &StudyArgs, source: &SceneArgs) -> Result<Self> {
        let mut seconds = Seconds::default();
        let Opened { input, scene, camera, device } = load::open(source, &mut seconds)?;
        load::tell_warnings(&input.loaded);
        let settings = args.display.settings();
        let mut run = RunSpec::of(source, &input, device.name());
        run.film.variance = shown_variance(&settings);
        let threads = source.threads();
        let client = device.client(run.film, threads, None)?;
        let (server, lanes) = Server::start_with(threads, device.tracing_priority()).into_diagnostic()?;
        Ok(Self {
            run,
            scene: Arc::new(scene),
            camera,
            desc: input.loaded.desc,
            settings,
            device,
            threads,
            load_seconds: seconds.load + seconds.prepare,
            client,
            server,
            lanes,
            epoch: Epoch(0),
        })
    }

    /// Pixels of the film, overscan included.
    pub fn texels(&self) -> f64 {
        let [width, height] = self.run.film.padded_extent().map(f64::from);
        width * height
    }

    /// The specification of a run by `kind` with this seed.
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
        self.client.clear();
        self.epoch = self.epoch.next();
        let (range, time) = match limit {
            RenderLimit::Time(time) => (0..u64::MAX, Some(time)),
            RenderLimit::Paths(paths) => (0..paths, None),
        };
        let order = RenderOrder {
            scene,
            camera,
            range,
            window: run.film.window(),
            epoch: self.epoch,
            sampling: Default::default(),
            check: None,
        };
        let observer = run.replicated.then(|| Observer::start(run, None, Beside::Render)).transpose()?;
        method::start(&self.server, run, order, &mut None)?;
        let bar = Progress::new(Goal::Error, true);
        let plan = Drive {
            epoch: self.epoch,
            first_index: 0,
            deterministic: false,
            time,
            texels: self.texels(),
            quantity: ErrorQuantile::P95,
        };
        let onlookers = DriveObservers {
            bar: &bar,
            timings: &mut None,
            observer: observer.as_ref(),
            recorder: None,
            live: None,
            groups: None,
        };
        let driven = drive(plan, &self.server, &mut self.lanes, &mut *self.client, onlookers)?;
        if let Some((index, message)) = &driven.panicked {
            miette::bail!("path {index} panicked: {message}: {}", run.command(*index, 1));
        }
        let pixels = observer.as_ref().map(Observer::pixels).unwrap_or_default();
        let replicates = observer.as_ref().and_then(Observer::replicates);
        let (state, predictions) = observer.as_ref().map(Observer::end).unwrap_or_default();
        let stats = self.server.stats();
        let start = Instant::now();
        let shown = self.show(&self.settings.clone())?;
        let display_seconds = start.elapsed().as_secs_f64();
        let data = self.client.develop().into_diagnostic()?;
        let [width, height] = [run.film.width, run.film.height].map(|side| side as usize);
        let rgb = Grid::from_rows(width, height, develop::linear_rgb(&data, &Profile::srgb()));
        let rgb = rgb.ok_or_else(|| miette::miette!("the film has another size than its picture"))?;
        Ok(StudyRender {
            rgb,
            data,
            shown,
            driven,
            stats,
            display_seconds,
            state,
            predictions,
            pixels,
            replicates,
        })
    }

    /// A picture of this scene as it is displayed through the noise filter; `None` for an undivided run, and without memory.
    pub fn filtered(&self, traced: &StudyRender) -> Result<Option<DisplayImage>> {
        let picture = traced.replicates.as_ref().and_then(|replicates| {
            let mut filter = ViewFilter::new(&self.scene, &self.camera, &self.run.film, &|| false)?;
            let halves = HalfMeans::of(replicates).ok()?;
            FilteredPicture::of(replicates, &halves, Some(&traced.data), &mut filter, Denoise::Wavelet).ok()
        });
        picture.map(|picture| picture.display(&self.settings)).transpose()
    }

    /// Replaces the film by an empty one.
    pub fn remake(&mut self, spec: FilmSpec) -> Result<()> {
        self.client = self.device.client(spec, self.threads, None)?;
        Ok(())
    }

    /// Displays the last picture with some settings.
    pub fn show(&mut self, settings: &Settings) -> Result<DisplayImage> {
        self.client.display(settings).into_diagnostic()
    }
}
