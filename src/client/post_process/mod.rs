//! Post-processes: passes from the scene-linear picture to another one, XYZ to XYZ, between glare and tone curve. Each is one file, which
//! holds its parameters with their options, its push constants, its controls and its reference; its shader; and one line of the list below.
//!
//! # Adding one
//!
//! 1. **Shader.** Put `name.frag` into `glsl/`; it declares its own block of push constants. Compile it with the feature `shaderc`, and
//!    commit its SPIR-V and the hashes in `glsl/spv` (`glsl/build.rs` says how).
//! 2. **File.** `name.rs` here: a struct of the parameters, which implements [`PostProcess`]. Its
//!    [`texel`](PostProcess::texel) defines what the shader computes; a test beside it compares that with the formula.
//! 3. **Lines.** `pub mod name;`, and a line in the list below. Numbers of options are read by `post_pass::number`.
//!
//! What follows from the list: the [settings](PostSettings) and the options of the command line, also those in the attributes of files; the
//! order on the device and in the reference; the list of effects and its switches; the sliders of the panel; the device memory. The tests of
//! the GPU compare every post-process with its reference, and its push constants with the block in its shader.

pub mod look_around;
mod panorama;
mod post_pass;
pub mod vignette;

use std::borrow::Cow;
use std::sync::Arc;

use glam::Vec3;

use crate::client::layout::PushBlock;
use crate::client::pass::CompilePolicy;
use crate::gpu::{Cmd, Gpu, GpuError};
use crate::image::Grid;

pub use panorama::{PanoramaProjection, PanoramaView};
pub use post_pass::{PictureGrid, PicturePair, PostProcess, PostSlider};

use post_pass::PostPass;

/// A post-process in the list of effects.
pub struct PostEffect {
    /// Its name.
    pub name: &'static str,
    /// Whether it runs.
    pub on: bool,
    /// The options that say so.
    pub options: String,
    /// Its own pass in the timings.
    pub passes: &'static [&'static str],
}

/// Makes of the list of post-processes the struct of their settings, that of their passes, and what acts on all of them.
macro_rules! post_processes {
    ($($name:ident: $Process:ident,)*) => {
        /// The parameters of all post-processes.
        #[derive(clap::Args, Clone, Debug, Default, PartialEq)]
        pub struct PostSettings {
            $(
                #[doc = concat!("See [`", stringify!($name), "`].")]
                #[command(flatten)]
                pub $name: $name::$Process,
            )*
        }

        impl PostSettings {
            /// All post-processes in their order, each with what these settings say of it.
            pub fn effects(&self) -> Vec<PostEffect> {
                vec![$(PostEffect {
                    name: $name::$Process::NAME,
                    on: self.$name.is_on(),
                    options: self.$name.options(),
                    passes: &[$name::$Process::NAME],
                },)*]
            }

            /// Switches the post-process of this name on, in its simplest form, or off.
            pub fn switch(&mut self, name: &str, on: bool) {
                $(if name == $name::$Process::NAME {
                    self.$name = if on { PostProcess::example() } else { Default::default() };
                })*
            }

            /// The controls of all parameters.
            pub fn sliders(&mut self) -> Vec<PostSlider<'_>> {
                let mut sliders = Vec::new();
                $(sliders.extend(self.$name.sliders());)*
                sliders
            }

            /// The picture after all references; `None` without memory.
            pub fn apply<'a>(&self, picture: &'a Grid<Vec3>, grid: PictureGrid) -> Option<Cow<'a, Grid<Vec3>>> {
                let mut picture = Cow::Borrowed(picture);
                $(if self.$name.is_on() {
                    picture = Cow::Owned(post_pass::apply(&self.$name, &picture, grid)?);
                })*
                Some(picture)
            }
        }

        /// The passes of all post-processes, whose pipelines are created on first use.
        pub struct PostPasses {
            $($name: PostPass<$name::$Process>,)*
        }

        impl PostPasses {
            /// Passes without pipelines.
            pub fn new(gpu: &Arc<Gpu>, policy: &CompilePolicy) -> Self {
                Self { $($name: PostPass::new(gpu, policy),)* }
            }

            /// Records the post-processes that run, in their order.
            pub fn record(
                &mut self,
                cmd: &mut Cmd<'_>,
                settings: &PostSettings,
                grid: PictureGrid,
                picture: &mut PicturePair,
            ) -> Result<(), GpuError> {
                $(self.$name.record(cmd, &settings.$name, grid, picture)?;)*
                Ok(())
            }
        }

        /// The push constants of all post-processes.
        pub const BLOCKS: &[&[PushBlock]] = &[$($name::BLOCKS,)*];
    };
}

// They run in this order.
post_processes! {
    vignette: Vignette,
    look_around: LookAround,
}

impl PostSettings {
    /// Whether any of them runs.
    pub fn is_any_on(&self) -> bool {
        self.effects().iter().any(|effect| effect.on)
    }

    /// The options of those that run, each after a space.
    pub fn options(&self) -> String {
        let on = self.effects().into_iter().filter(|effect| effect.on);
        on.map(|effect| format!(" {}", effect.options)).collect()
    }
}
