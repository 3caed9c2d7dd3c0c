//! Options that say what is traced.

use std::path::PathBuf;

use clap::{ArgMatches, Args, Command, FromArgMatches, ValueEnum};

use crate::client::SplatFilter;
use crate::cmd::args::effects::effect;
use crate::cmd::args::values::{MaxDepth, define, depth, size};
use crate::render::forced::Forced;
use crate::render::options::SceneOptions;
use crate::scene::desc::IntegratorKind;
use crate::tracer::accel::SimdKernel;

/// The scene and how it is traced.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Scene and light transport")]
struct SceneArgs {
    /// The scene, a Mitsuba XML file of version 0.4 to 3; or a model by itself: OBJ, PLY, glTF (GLB) or USD (usda, usdc, usdz).
    ///
    /// A model has the materials, lights and cameras of its file; where it has none, it stands in a soft sky, and the camera sees
    /// all of it.
    scene: PathBuf,

    /// Value for a $NAME in the scene; may be given several times.
    #[arg(short = 'D', value_name = "NAME=VALUE", value_parser = define)]
    defines: Vec<(String, String)>,

    /// Render a scene although it holds plugins that are not supported: a bsdf becomes magenta, a shape or emitter is left out.
    ///
    /// Each is a warning with its place; without this option it is an error.
    #[arg(long)]
    lenient: bool,

    /// Show every warning about the scene and every remark with its source line; otherwise what is alike is one line.
    #[arg(long)]
    verbose: bool,

    /// Picture size in pixels, instead of the film's size and crop.
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(u32, u32)>,

    /// Method of light transport [default: what the scene asks for, else path].
    #[arg(long, value_name = "KIND")]
    integrator: Option<IntegratorKind>,

    /// Effects of the tracer to force off (-) or on (+), as `pointillist explain` lists them.
    ///
    /// An effect that is forced off is left out of the light transport; the picture's file, the report and the summary say so.
    /// Switches without effect are reported; impossible ones are errors.
    #[arg(long, value_name = "+X,-Y", value_delimiter = ',', allow_hyphen_values = true, value_parser = effect)]
    effects: Vec<Forced>,

    /// Longest path in segments; -1 is unlimited [default: what the scene asks for].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = depth)]
    max_depth: Option<MaxDepth>,

    /// Number of tracer threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    /// Processor instructions that trace rays; all give the same samples, bit for bit.
    #[arg(long, value_name = "KIND", default_value = "auto")]
    simd: SimdArg,

    /// Seed of the sample sequence; another seed gives an independent picture.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,

    /// Splat filter: how a sample is spread over pixels [default: what the scene asks for, else gaussian].
    #[arg(long, value_name = "KIND")]
    filter: Option<SplatFilter>,

    /// Vulkan device by index or part of its name, or `cpu` for the same passes in Rust [default: the best device].
    #[arg(long, value_name = "NAME|INDEX|cpu")]
    device: Option<String>,
}

impl From<SceneArgs> for SceneOptions {
    fn from(args: SceneArgs) -> Self {
        let SceneArgs { scene, defines, lenient, verbose, size, integrator, effects, .. } = args;
        Self {
            scene,
            loaded: None,
            defines,
            lenient,
            verbose,
            size,
            integrator,
            effects,
            max_depth: args.max_depth.map(|depth| depth.0),
            threads: args.threads,
            simd: args.simd.into(),
            seed: args.seed,
            filter: args.filter,
            device: args.device,
        }
    }
}

/// The command line reads these options as [`SceneArgs`].
impl Args for SceneOptions {
    fn augment_args(command: Command) -> Command {
        SceneArgs::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        SceneArgs::augment_args_for_update(command)
    }
}

impl FromArgMatches for SceneOptions {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        SceneArgs::from_arg_matches(matches).map(Self::from)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
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
