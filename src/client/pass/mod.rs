//! The passes of the Vulkan film, one file and one struct each: pipelines, and `record` with what it reads and writes.
//!
//! | file | pass | reference in `client/reference` |
//! |---|---|---|
//! | [`splat`] | samples → batch image, filter-shaped sprites, additive | `splat` |
//! | [`fold`] | batch image → two-float sums, means | `fold` |
//! | [`variance`] | samples again → batch of squared deviations → two-float sums | `variance` |
//! | [`mips`] | averages down to 1×1 | `mips` |
//! | [`bilateral`] | averages over neighbours whose difference is noise, if asked for | `bilateral` |
//! | [`adaptive_filter`] | the light of every sample spread by the density around it | `adaptive_filter` |
//! | [`reconstruct`] | blur by count and variance, normalise, sum the streams; on a GPU in compute | `reconstruct`, `kernel` |
//! | [`error_view`] | the variance in place of the picture, if asked for | `error_view` |
//! | [`compose`] | regions with samples of their own mixed into the picture, groups of lights added | [`develop::mix_region`](crate::client::develop::mix_region) |
//! | [`glare`] | scatter of the eye: convolution by FFT in compute | `glare` |
//! | [`PostPass`](crate::client::post_process) | what changes the picture, if asked for | [`post_process`](crate::client::post_process) |
//! | [`tonemap`] | tone curve, matrix, desaturation, transfer, dither | `tonemap`, `curves` |
//! | [`stereo`] | the pictures of two eyes as one, of a film that has both | [`image::stereo`](crate::image::stereo) |
//! | [`wavelet`] | the noise filter, before a picture is shown through it | [`client/wavelet`](crate::client::wavelet) |
//!
//! [`VulkanFilm`](crate::client::film::VulkanFilm) runs the passes of a batch, down to `variance`; `denoise` runs
//! `wavelet`; [`repaint`] runs the others in order. [`images`] holds what they read and write. Pipelines are made on first use and specialized: what a film
//! or a repaint does not need is not in the code that runs.
//!
//! Errors are those of the driver: [`GpuError::Call`] names the pipeline or the image, [`GpuError::Memory`] the image or buffer that
//! found no memory.
//!
//! # Adding a display pass
//!
//! One from the scene-linear picture to another is a post-process: a shader, a file and a line, as
//! [`post_process`](crate::client::post_process) says. A pass at another place, or one that needs more images, takes more:
//!
//! 1. **Setting.** Add a field to [`Settings`](crate::client::Settings). An option with a closed set of values derives
//!    `clap::ValueEnum` and gets its labels in `client/settings.rs`; the command line takes it in `cmd/args/display.rs`.
//! 2. **Plan.** [`Effects`](crate::client::compiled_effects::Effects) decides whether the pass runs, and yields its specialization
//!    constants. A line in [`effect_list`](crate::client::effect_list::effect_list) names the effect, its passes and its
//!    images.
//! 3. **Reference.** Write the pass in plain Rust in `client/reference` and call it from
//!    [`ReferenceFilm`](crate::client::reference::ReferenceFilm), which displays a picture by it. It defines what the shader computes.
//! 4. **Layout.** Push constants are a block in [`layout`](crate::client::layout) and one of the same name and members in the
//!    shader, or in `glsl/include/layout.glsl` if several read it; the test of the shaders compares the offsets.
//! 5. **Shader.** Put `name.frag` into `glsl/`, compile it with the feature `shaderc`, and commit its SPIR-V in `glsl/spv`.
//! 6. **Pass.** A file here with one struct: a [`ShaderVariants`] for the pipelines and a `record` that opens a scope, makes
//!    images ready with [`Cmd::access`](crate::gpu::Cmd::access), and draws. [`repaint::Repaint`] calls it at its place.
//! 7. **Tests.** Compare both films in the tests of the GPU, and test the reference against its formula in those of the
//!    client.

pub mod adaptive_filter;
pub mod bilateral;
pub mod compose;
pub mod error_view;
pub mod fold;
pub mod glare;
pub mod images;
pub mod mips;
pub mod reconstruct;
pub mod repaint;
pub mod splat;
pub mod stereo;
pub mod tonemap;
pub mod variance;
pub mod wavelet;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::client::background::BackgroundTask;
use crate::gpu::{Blend, Gpu, GpuError, GraphicsDesc, Pipeline, TexelFormat, Topology, VertexLayout};

/// How the pipelines of a repaint are compiled: whether it is skipped while another thread compiles one or blocks until then (the default),
/// and for images of how many layers. Shared by all passes of a repaint.
#[derive(Clone, Debug)]
pub struct CompilePolicy {
    aside: Arc<AtomicBool>,
    layers: u32,
}

impl Default for CompilePolicy {
    fn default() -> Self {
        Self::for_layers(1)
    }
}

impl CompilePolicy {
    /// For images of so many layers, all of which are drawn at once.
    pub fn for_layers(layers: u32) -> Self {
        Self { aside: Arc::default(), layers }
    }

    /// The same for images of one layer.
    pub fn of_one_layer(&self) -> Self {
        Self { layers: 1, ..self.clone() }
    }

    /// Layers of the images.
    pub fn layers(&self) -> u32 {
        self.layers
    }

    /// Sets whether everything recorded from now on has its pipelines compiled on another thread.
    pub fn set_aside(&self, aside: bool) {
        self.aside.store(aside, Ordering::Relaxed);
    }

    /// Whether pipelines are compiled on another thread.
    pub fn is_aside(&self) -> bool {
        self.aside.load(Ordering::Relaxed)
    }
}

/// Most variants of a shader that are kept: as many as the mips of one picture may need. Some constants have hundreds of values, such as the
/// width and the exponent of the reconstruction kernel, and the driver of a CPU device takes some hundred kilobytes for each pipeline.
const MOST_VARIANTS: usize = 8;

/// Pipelines of one shader, one per set of specialization constants, compiled on first use; on another thread if the [`CompilePolicy`] says
/// so. Those that were used last are kept.
pub struct Variants<P> {
    gpu: Arc<Gpu>,
    shader: &'static str,
    policy: CompilePolicy,
    /// The variants, the one used last at the end.
    made: Vec<(Vec<u32>, Variant<P>)>,
}

/// A pipeline, or the thread compiling it.
enum Variant<P> {
    Ready(P),
    UnderWay(BackgroundTask<Result<P, GpuError>>),
}

impl<P: Send + 'static> Variants<P> {
    /// Variants of this shader, compiled as this policy says.
    pub fn new(gpu: &Arc<Gpu>, shader: &'static str, policy: &CompilePolicy) -> Self {
        Self { gpu: gpu.clone(), shader, policy: policy.clone(), made: Vec::new() }
    }

    /// The pipeline with these constants and whatever else tells it from others, created by `compile`.
    ///
    /// # Errors
    ///
    /// Those of `compile`, and [`GpuError::Compiling`] while another thread is compiling.
    pub fn get(
        &mut self,
        constants: &[u32],
        compile: impl FnOnce() -> Result<P, GpuError> + Clone + Send + 'static,
    ) -> Result<&P, GpuError> {
        let waits = !self.policy.is_aside();
        let at = match self.made.iter().position(|(made, _)| made == constants) {
            Some(at) => {
                self.made[at..].rotate_left(1);
                self.made.len() - 1
            }
            None => {
                let variant = self.start(compile.clone(), waits)?;
                let is_under_way = matches!(variant, Variant::UnderWay(_));
                if self.made.len() >= MOST_VARIANTS
                    && let Some(oldest) = self.made.iter().position(|(_, v)| matches!(v, Variant::Ready(_)))
                {
                    self.made.remove(oldest);
                }
                self.made.push((constants.to_vec(), variant));
                if is_under_way {
                    return Err(GpuError::Compiling(self.shader));
                }
                self.made.len() - 1
            }
        };
        if matches!(&self.made[at].1, Variant::UnderWay(task) if waits || task.is_ready()) {
            // After an error the variant is removed, so that the next call retries.
            let (_, variant) = self.made.swap_remove(at);
            let made = match variant {
                Variant::UnderWay(task) => task.wait().unwrap_or_else(compile)?,
                Variant::Ready(pipeline) => pipeline,
            };
            self.made.insert(at, (constants.to_vec(), Variant::Ready(made)));
        }
        match &self.made[at].1 {
            Variant::Ready(pipeline) => Ok(pipeline),
            Variant::UnderWay(_) => Err(GpuError::Compiling(self.shader)),
        }
    }

    /// A new variant, compiled at once if the caller `waits` or no thread can be started.
    fn start(
        &self,
        compile: impl FnOnce() -> Result<P, GpuError> + Clone + Send + 'static,
        waits: bool,
    ) -> Result<Variant<P>, GpuError> {
        if !waits {
            let (aside, count) = (compile.clone(), self.gpu.count_compiling());
            let work = move || {
                let _count = count;
                aside()
            };
            if let Some(task) = BackgroundTask::start(work) {
                return Ok(Variant::UnderWay(task));
            }
        }
        compile().map(Variant::Ready)
    }
}

/// Pipelines of a fragment shader that runs once per texel of its attachments.
pub struct ShaderVariants {
    variants: Variants<Pipeline>,
    push_bytes: usize,
    textures: u32,
    blend: Blend,
}

impl ShaderVariants {
    /// Variants of this shader, with `push_bytes` of push constants and this number of textures. By default the caller blocks until they
    /// are compiled.
    pub fn new(gpu: &Arc<Gpu>, frag: &'static str, push_bytes: usize, textures: u32) -> Self {
        let variants = Variants::new(gpu, frag, &CompilePolicy::default());
        Self { variants, push_bytes, textures, blend: Blend::Replace }
    }

    /// As `self`, blended with the contents of the attachments.
    pub fn blended(self, blend: Blend) -> Self {
        Self { blend, ..self }
    }

    /// As `self`, compiled according to this policy.
    pub fn compiled(mut self, policy: &CompilePolicy) -> Self {
        self.variants.policy = policy.clone();
        self
    }

    /// The pipeline with these constants for attachments of these formats.
    ///
    /// # Errors
    ///
    /// Those of [`Pipeline::new`], and [`GpuError::Compiling`] while another thread compiles it.
    pub fn get(&mut self, constants: &[u32], formats: &[TexelFormat]) -> Result<&Pipeline, GpuError> {
        let Self { variants, push_bytes, textures, blend } = self;
        let (gpu, frag, push_bytes, textures) =
            (variants.gpu.clone(), variants.shader, *push_bytes, *textures);
        let owned = constants.to_vec();
        let attachments: Vec<_> = formats.iter().map(|format| (*format, *blend)).collect();
        let layers = variants.policy.layers();
        // A pipeline draws to attachments of its formats only.
        let key: Vec<u32> =
            constants.iter().copied().chain(formats.iter().map(|format| *format as u32)).collect();
        variants.get(&key, move || {
            let desc = GraphicsDesc {
                name: frag,
                vert: ("fullscreen.vert", &[]),
                frag: (frag, &owned),
                push_bytes,
                textures,
                attachments: &attachments,
                layers,
                topology: Topology::Fullscreen,
                vertex: VertexLayout::default(),
            };
            Pipeline::new(&gpu, &desc)
        })
    }
}
