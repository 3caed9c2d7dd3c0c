//! Options of a run as plain data, filled from the command line or by another program.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crate::client::{Denoise, Settings, SplatFilter};
use crate::image::stereo::StereoLayout;
use crate::render::forced::Forced;
use crate::scene::Loaded;
use crate::scene::desc::{AovDesc, ConvergenceChoice, IntegratorKind, StereoConvergence, StereoRig};
use crate::scene::light_groups::NamedGroup;
use crate::study::ErrorQuantile;
use crate::tracer::accel::SimdKernel;

/// Scene and method of tracing. The command-line options of the same names explain each field.
#[derive(Clone, Debug)]
pub struct SceneOptions {
    pub scene: PathBuf,
    /// The scene, where another program has read it already and told its warnings; `scene` then is only its name.
    pub loaded: Option<Arc<Loaded>>,
    /// Values of named parameters in the scene file (`-D`).
    pub defines: Vec<(String, String)>,
    /// Replace or skip unsupported plugins, with a warning.
    pub lenient: bool,
    /// Show every warning with its source line.
    pub verbose: bool,
    /// Picture size in pixels; `None` for the scene's.
    pub size: Option<(u32, u32)>,
    /// Method; `None` for the scene's.
    pub integrator: Option<IntegratorKind>,
    /// Forced effects, in the order given.
    pub effects: Vec<Forced>,
    /// Longest path in segments; `None` for the scene's, `Some(None)` for unlimited.
    pub max_depth: Option<Option<u32>>,
    /// Tracer threads; `None` for one per core.
    pub threads: Option<u16>,
    /// SIMD kernel of ray traversal.
    pub simd: SimdKernel,
    pub seed: u32,
    /// Splat filter; `None` for the scene's.
    pub filter: Option<SplatFilter>,
    /// Vulkan device by index or part of its name, or `cpu`; `None` for the best one.
    pub device: Option<String>,
}

impl SceneOptions {
    /// Default options for this scene.
    pub fn of(scene: PathBuf) -> Self {
        Self {
            scene,
            loaded: None,
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

/// Options of a render without a window. The options of `pointillist render` of the same names explain each.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Scene and method.
    pub source: SceneOptions,
    /// Display settings.
    pub display: Settings,
    /// Total number of camera paths.
    pub samples: Option<u64>,
    /// Samples per pixel.
    pub spp: Option<u64>,
    pub time: Option<Duration>,
    /// Relative error at which the render stops.
    pub error: Option<f64>,
    /// Quantile of the picture's error that `error` refers to.
    pub error_at: ErrorQuantile,
    /// Number of independent randomisations, 1 or 2.
    pub replicates: u8,
    pub first_index: u64,
    pub adaptive: bool,
    /// Rasterise samples in index order.
    pub deterministic: bool,
    /// Threshold κ of firefly reweighting.
    pub reweight_fireflies: Option<f32>,
    pub denoise: Denoise,
    /// File of the state.
    pub state: Option<PathBuf>,
    /// `source.scene` is a state file to resume.
    pub resume: bool,
    /// Interval between writes of the state.
    pub state_every: Duration,
    pub outputs: Vec<PathBuf>,
    /// Additional layers; `None` for those of the scene.
    pub aov: Option<Vec<AovDesc>>,
    /// `HOST:PORT` of the viewer tev.
    pub tev: Option<String>,
    /// Pictures of two eyes.
    pub stereo: Option<StereoOptions>,
    /// Light groups with separate pictures; an empty list means one per emitter.
    pub light_groups: Option<Vec<NamedGroup>>,
    pub json: Option<PathBuf>,
    pub quiet: bool,
    pub gpu_timings: Option<PathBuf>,
    /// Fraction of the paths that general code also traces.
    pub check_plan: f64,
}

/// What is asked for of the pictures of two eyes.
#[derive(Clone, Copy, Debug)]
pub struct StereoOptions {
    /// How a PNG file shows both; `None` for a file of each.
    pub layout: Option<StereoLayout>,
    /// Distance between the eyes, world units.
    pub interocular: Option<f64>,
    /// What they look at.
    pub convergence: ConvergenceChoice,
}

impl StereoOptions {
    /// Options for eyes where those of `rig` are.
    pub fn of_rig(rig: &StereoRig, layout: Option<StereoLayout>) -> Self {
        let convergence = match rig.convergence {
            StereoConvergence::Parallel => ConvergenceChoice::Parallel,
            StereoConvergence::OffAxis { distance } => ConvergenceChoice::Distance(distance),
        };
        Self { layout, interocular: Some(rig.interocular), convergence }
    }
}

impl RenderOptions {
    /// Default options for a render of this scene.
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
            stereo: None,
            light_groups: None,
            json: None,
            quiet: false,
            gpu_timings: None,
            check_plan: 0.0,
        }
    }

    /// Whether any stopping criterion is given.
    pub fn has_goal(&self) -> bool {
        self.samples.is_some() || self.spp.is_some() || self.time.is_some() || self.error.is_some()
    }
}
