//! Options that say what is traced.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::effects::{Forced, effect};
use super::values::{MaxDepth, define, depth, size};
use crate::client::SplatFilter;
use crate::scene::desc::IntegratorKind;
use crate::tracer::accel::SimdKernel;

/// The scene and how it is traced.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Scene and light transport")]
pub struct SceneArgs {
    /// The scene, a Mitsuba XML file of version 0.4 to 3; or a model by itself: OBJ, PLY, glTF (GLB) or USD (usda, usdc, usdz).
    ///
    /// A model has the materials, lights and cameras of its file; where it has none, it stands in a soft sky, and the camera sees
    /// all of it.
    pub scene: PathBuf,

    /// Value for a $NAME in the scene; may be given several times.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    pub defines: Vec<(String, String)>,

    /// Render a scene although it holds plugins that are not supported: a bsdf becomes magenta, a shape or emitter is left out.
    ///
    /// Each is a warning with its place; without this option it is an error.
    #[arg(long)]
    pub lenient: bool,

    /// Show every warning about the scene and every remark with its source line; otherwise what is alike is one line.
    #[arg(long)]
    pub verbose: bool,

    /// Picture size in pixels, instead of the film's size and crop.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,

    /// Method of light transport [default: what the scene asks for, else path].
    #[arg(long, value_name = "KIND")]
    pub integrator: Option<IntegratorKind>,

    /// Effects of the tracer to force off (-) or on (+), as `pointillist explain` lists them.
    ///
    /// An effect that is forced off is left out of the light transport; the picture's file, the report and the summary say so.
    /// Switches without effect are reported; impossible ones are errors.
    #[arg(long, value_name = "+X,-Y", value_delimiter = ',', allow_hyphen_values = true, value_parser = effect)]
    pub effects: Vec<Forced>,

    /// Longest path in segments; -1 is unlimited [default: what the scene asks for].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = depth)]
    pub max_depth: Option<MaxDepth>,

    /// Number of tracer threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// Processor instructions that trace rays; all give the same samples, bit for bit.
    #[arg(long, value_name = "KIND", default_value = "auto")]
    pub simd: SimdArg,

    /// Seed of the sample sequence; another seed gives an independent picture.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u32,

    /// Splat filter: how a sample is spread over pixels [default: what the scene asks for, else gaussian].
    #[arg(long, value_name = "KIND")]
    pub filter: Option<SplatFilter>,

    /// Vulkan device by index or part of its name, or `cpu` for the same passes in Rust [default: the best device].
    #[arg(long, value_name = "NAME|INDEX|cpu")]
    pub device: Option<String>,
}

impl SceneArgs {
    /// The number of tracer threads.
    pub fn threads(&self) -> usize {
        let cores = || std::thread::available_parallelism().map_or(1, usize::from);
        self.threads.map_or_else(cores, usize::from)
    }
}

/// `--simd`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SimdArg {
    /// The fastest that the processor has
    Auto,
    /// Instructions of any processor
    Scalar,
    /// AVX2 of x86-64, with FMA and BMI
    Avx2,
    /// AVX-512 of x86-64 (F, VL, DQ, BW), besides these
    Avx512,
}

impl From<SimdArg> for SimdKernel {
    fn from(simd: SimdArg) -> Self {
        match simd {
            SimdArg::Auto => SimdKernel::best(),
            SimdArg::Scalar => SimdKernel::Scalar,
            SimdArg::Avx2 => SimdKernel::Avx2,
            SimdArg::Avx512 => SimdKernel::Avx512,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Options and kernels have the same words, and every kernel can be asked for.
    #[test]
    fn simd_has_the_words_of_the_kernels() {
        for kernel in SimdKernel::ALL {
            let arg = SimdArg::from_str(kernel.name(), false).expect("a word for each");
            assert_eq!(SimdKernel::from(arg), kernel);
        }
        assert_eq!(SimdKernel::from(SimdArg::Auto), SimdKernel::best());
        assert_eq!(SimdArg::value_variants().len(), SimdKernel::ALL.len() + 1);
    }
}
