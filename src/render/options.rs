//! What a run is asked for, as plain data. The command line is read into it, and so may another program.

use std::path::PathBuf;
use std::time::Duration;

use crate::client::{Denoise, Settings, SplatFilter};
use crate::render::forced::Forced;
use crate::scene::desc::{AovDesc, IntegratorKind};
use crate::scene::light_groups::NamedGroup;
use crate::study::ErrorQuantile;
use crate::tracer::accel::SimdKernel;

/// The scene and how it is traced. The options of the command line of the same names explain each.
#[derive(Clone, Debug)]
pub struct SceneOptions {
    pub scene: PathBuf,
    /// Values for names in the scene file.
    pub defines: Vec<(String, String)>,
    /// Plugins that are not supported are replaced or left out, and told.
    pub lenient: bool,
    /// Warnings are shown one by one with their source lines.
    pub verbose: bool,
    /// Size of the picture in pixels in the place of the film's.
    pub size: Option<(u32, u32)>,
    /// Method in the place of the scene's.
    pub integrator: Option<IntegratorKind>,
    /// Effects that are forced on or off, in the order in which they were given.
    pub effects: Vec<Forced>,
    /// Longest path in segments in the place of the scene's; `Some(None)` is unlimited.
    pub max_depth: Option<Option<u32>>,
    /// Threads of the tracer; one per core without it.
    pub threads: Option<u16>,
    /// Instructions that traverse the acceleration structure.
    pub simd: SimdKernel,
    pub seed: u32,
    /// Splat filter in the place of the scene's.
    pub filter: Option<SplatFilter>,
    /// Vulkan device by index or part of its name, or `cpu`; the best one without it.
    pub device: Option<String>,
}

impl SceneOptions {
    /// A scene where nothing else is given.
    pub fn of(scene: PathBuf) -> Self {
        Self {
            scene,
            defines: Vec::new(),
            lenient: false,
            verbose: false,
            size: None,
            integrator: None,
            effects: Vec::new(),
            max_depth: None,
            threads: None,
            simd: SimdKernel::best(),
            seed: 0,
            filter: None,
            device: None,
        }
    }

    /// The number of tracer threads.
    pub fn threads(&self) -> usize {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        self.threads.map_or_else(cores, usize::from)
    }
}

/// A render without a window. The options of `pointillist render` of the same names explain each.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// What is traced.
    pub source: SceneOptions,
    /// How it is shown.
    pub display: Settings,
    /// Camera paths in all.
    pub samples: Option<u64>,
    /// Samples per pixel.
    pub spp: Option<u64>,
    pub time: Option<Duration>,
    /// Relative error at which it stops.
    pub error: Option<f64>,
    /// Quantile of the picture that `error` is about.
    pub error_at: ErrorQuantile,
    /// Independent randomisations, 1 or 2.
    pub replicates: u8,
    pub first_index: u64,
    pub adaptive: bool,
    /// Samples are rasterised in index order.
    pub deterministic: bool,
    /// The threshold κ by which fireflies are reweighted.
    pub reweight_fireflies: Option<f32>,
    pub denoise: Denoise,
    /// Where the state is kept.
    pub state: Option<PathBuf>,
    /// `source.scene` is a state to go on with.
    pub resume: bool,
    /// Between two states.
    pub state_every: Duration,
    pub outputs: Vec<PathBuf>,
    /// Layers beside the picture in the place of those that the scene asks for.
    pub aov: Option<Vec<AovDesc>>,
    /// `HOST:PORT` of the viewer tev.
    pub tev: Option<String>,
    /// Groups of lights that have pictures of their own; an empty list stands for one for each emitter.
    pub light_groups: Option<Vec<NamedGroup>>,
    pub json: Option<PathBuf>,
    pub quiet: bool,
    pub gpu_timings: Option<PathBuf>,
    /// Share of the paths that general code traces, too.
    pub check_plan: f64,
}

impl RenderOptions {
    /// A render of this scene where nothing else is given.
    pub fn of(source: SceneOptions) -> Self {
        Self {
            source,
            display: Settings::default(),
            samples: None,
            spp: None,
            time: None,
            error: None,
            error_at: ErrorQuantile::default(),
            replicates: 2,
            first_index: 0,
            adaptive: false,
            deterministic: false,
            reweight_fireflies: None,
            denoise: Denoise::Off,
            state: None,
            resume: false,
            state_every: Duration::from_secs(60),
            outputs: Vec::new(),
            aov: None,
            tev: None,
            light_groups: None,
            json: None,
            quiet: false,
            gpu_timings: None,
            check_plan: 0.0,
        }
    }

    /// True if it says when to stop.
    pub fn has_goal(&self) -> bool {
        self.samples.is_some() || self.spp.is_some() || self.time.is_some() || self.error.is_some()
    }
}
