//! The command line: one struct of options per subcommand, and the groups of options that they share.
//!
//! The doc comments of the options are the program's `--help`.

pub mod compare;
pub mod display;
pub mod effects;
pub mod farm;
pub mod measure;
pub mod mix;
pub mod plugins;
pub mod regress;
pub mod remote;
pub mod render;
pub mod replay;
pub mod scene;
pub mod stereo;
pub mod study;
pub mod values;
pub mod view;

pub use compare::CompareArgs;
pub use farm::{InfoArgs, MergeArgs, ShardArgs};
pub use measure::{BenchArgs, ExplainArgs};
pub use mix::MixArgs;
pub use plugins::PluginsArgs;
pub use regress::RegressArgs;
pub use remote::ServeArgs;
pub use render::RenderArgs;
pub use replay::ReplayArgs;
pub use study::StudyArgs;
pub use view::ViewArgs;

use clap::{Parser, Subcommand};

/// Interactive global illumination: point samples become the best picture possible, at once.
///
/// `pointillist COMMAND --help` explains every option. In the environment, POINTILLIST_LOG=info prints more messages, and
/// POINTILLIST_VALIDATION=1 switches Vulkan's validation layers on.
#[derive(Parser, Debug)]
#[command(name = "pointillist", version, about, max_term_width = 110)]
pub struct Cli {
    /// The subcommand and its options.
    #[command(subcommand)]
    pub command: CliCommand,
}

/// The subcommands.
#[derive(Subcommand, Debug)]
pub enum CliCommand {
    /// Render a Mitsuba 3 scene file to EXR and PNG, without a window.
    ///
    /// EXR files hold the unblurred scene-linear picture in Rec.709 (R G B), the raw sums of both streams, their variances,
    /// the counts of paths, and the command that repeats the run. PNG files hold the picture as it is displayed. A file is
    /// replaced only when the new one is complete. Ctrl-C finishes the picture from the samples so far.
    ///
    /// Every render consists of two independent randomisations. Half their squared difference is an unbiased estimate of the
    /// variance of their mean, which is the picture, so that its error is known without a reference. The stated error is the
    /// relative error (root mean square of luminance over 8×8 pixels, by their mean luminance and 1 % of the picture's) that
    /// 50, 95 or 99 % of the picture stay below, with a 90 % interval. It counts light that a few paths of other methods find and
    /// the picture lacks, and the blur of photons once they have become more. It excludes light that none of them has met.
    Render(Box<RenderArgs>),

    /// Render one part of a picture into a state, which `merge` adds to others.
    ///
    /// A sample depends on scene, settings, seed and index only, and a part is a range of indices. However a picture is divided and in
    /// whatever order its parts are merged, the bits are those of the whole. A part that was interrupted goes on where its state ends.
    Shard(Box<ShardArgs>),

    /// Add the parts of a picture: write the picture, its error, or the state of all of them.
    ///
    /// Without -o it says what is there: the indices, those that are missing, and the error so far. Parts that are damaged, missing, of
    /// another picture or there twice are an error that names them, unless --allow-missing leaves them out.
    Merge(Box<MergeArgs>),

    /// Say what is in a state or in a picture's file, and how it was made.
    Info(InfoArgs),

    /// Open a window that shows the scene at once, and sharper by the second.
    View(Box<ViewArgs>),

    /// Trace a scene for windows elsewhere: `pointillist view --connect` on this machine or on another one.
    ///
    /// Camera and edits come from the viewer, samples go to it. Without --token-file only this machine can connect: from another one through
    /// `ssh -L 7070:127.0.0.1:7070 HOST`.
    Serve(ServeArgs),

    /// Trace one path again and print what it meets: every vertex, density and factor.
    ///
    /// The report of a render names the command for each value that it rejected: scene, options, index, and for photon mapping the
    /// photons that the path has seen. Options that decide paths must be those of the render.
    Replay(Box<ReplayArgs>),

    /// Measure every pass of the viewer on the device, without a window.
    ///
    /// Runs the viewer's frames and prints for each pass the median and 95 % quantile of its time, the bytes that it moves
    /// by a stated model, GB/s, and the ratio to an image copy of the picture in the same run.
    Bench(Box<BenchArgs>),

    /// List the effects of a scene: which are simulated, why, and with --prices what each costs.
    ///
    /// For every effect of tracer and client: whether it is on, and the object of the file that calls for it or why nothing does; then the
    /// memory that the film takes on the device. That is there at once; --error and --prices measure. The JSON also has what decides the
    /// effect at run time, and with --prices every image, buffer and pipeline on the device.
    Explain(Box<ExplainArgs>),

    /// Compare a picture with a reference by several metrics; reads EXR files of any program.
    ///
    /// The files may hold half, float or integer channels in scan lines or tiles: `R G B`, one layer of them, or `Y`. A pixel
    /// that is not finite counts as wrong.
    Compare(Box<CompareArgs>),

    /// Mix the pictures of groups of lights in an EXR file: each times a factor or a colour, without rendering again.
    ///
    /// `render --light-groups` makes such files. Given a picture to look like, finds the factors from 0 on that come nearest to it. Prints the
    /// factors as options; an EXR file that is written has the groups as they are in the mix, and can be mixed again.
    Mix(Box<MixArgs>),

    /// Measure what accuracy costs in time, and write a page, tables and plots of it.
    ///
    /// Measures, in turn and repeatedly: the error of each method after 1/30 s, 0.1, 1/3, 1, 3, … s against a long render or
    /// --against; the time to an error of 5, 2, 1 and 0.5 %; the cost of each effect and what the picture loses without it;
    /// the cost and error of each display setting; the cost of more exact arithmetic, and of knowing the error; how well
    /// predictions held; and rejected samples, with the command that replays them.
    ///
    /// The folder receives index.html (one file that needs no network), study.csv, study.json and plots. An interrupted study
    /// keeps its measurements, and another run adds to them. The time to an error is left out where a method's bias shows or
    /// its error comes close to that of the reference.
    Study(Box<StudyArgs>),

    /// Regression renders: which scenes of a folder look different from their references, by statistics.
    ///
    /// Each case is rendered several times with independent seeds and compared with its reference by tests whose false alarms are 1 % for the whole
    /// run. A green run says how small a change it would have found. src/regress/README.md is the guide.
    Regress(Box<RegressArgs>),

    /// List what of Mitsuba's scene format is supported: plugins by kind, with their parameters.
    ///
    /// For each parameter: what it is written as and what it is if it is not given, where the reader has a fixed default. Names in
    /// angle brackets are elements within the plugin. The list is made by reading each plugin as a scene is read.
    Plugins(PluginsArgs),

    /// List the Vulkan devices, and for each whether it can be used.
    Devices,
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
