//! Options of `pointillist render`.

use std::path::PathBuf;
use std::time::Duration;

use clap::{ArgGroup, Args};

use crate::client::Denoise;
use crate::cmd::args::display::DisplayArgs;
use crate::cmd::args::stereo::EyesArgs;
use crate::cmd::args::values::{
    AovArg, EACH_EMITTER, LightGroupsArg, StereoLayoutArg, aov, count, error, host_port, light_groups,
    positive, seconds, share, stereo_layout,
};
use crate::image::stereo::StereoLayout;
use crate::render::options::{RenderOptions, SceneOptions};
use crate::study::ErrorQuantile;

/// Options of `pointillist render`.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("amount").args(["samples", "spp", "time"])))]
pub struct RenderArgs {
    /// What is traced.
    #[command(flatten)]
    pub source: SceneOptions,

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Stop after this many camera paths in all, over the picture and its overscan; k, M, G are accepted.
    #[arg(long, value_name = "N", value_parser = count, help_heading = "Sampling")]
    pub samples: Option<u64>,

    /// Stop after this many samples per pixel [default: what the scene asks for, else 16].
    #[arg(long, value_name = "N", value_parser = count, help_heading = "Sampling")]
    pub spp: Option<u64>,

    /// Stop after this many seconds of rendering.
    #[arg(long, value_name = "SECONDS", value_parser = seconds, help_heading = "Sampling")]
    pub time: Option<Duration>,

    /// Stop when a part of the picture (see --error-at) has this relative error or less, as 1% or 0.01.
    ///
    /// With --time, --spp or --samples, whichever is reached first. Half of the pixels decide when to stop and the other,
    /// held-out half states the result, which avoids optional-stopping bias. The progress bar predicts the time to the target
    /// from 8 samples per pixel on; every prediction is logged with its outcome, and `study --predictions` scores the log.
    #[arg(long, value_name = "E", value_parser = error, help_heading = "Sampling")]
    pub error: Option<f64>,

    /// Quantile of the picture that --error is about.
    #[arg(long, value_name = "SHARE", default_value = "p95", requires = "error", help_heading = "Sampling")]
    pub error_at: ErrorQuantile,

    /// Number of independent randomisations: 2 tell the error of their mean, 1 does not know its own error.
    ///
    /// The error of the mean of two was 0.98 to 1.31 times that of a single one with as many samples, mostly below 1.2.
    #[arg(long, value_name = "1|2", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2), help_heading = "Sampling")]
    pub replicates: u8,

    /// First index of the sample sequence; the picture holds the paths from there on (with --samples 1, to replay one path).
    #[arg(long, value_name = "N", default_value_t = 0, help_heading = "Sampling")]
    pub first_index: u64,

    /// Sample the screen in proportion to the estimated error, for stills: more camera paths where the picture needs them.
    ///
    /// A pilot, the first sixteenth of the samples or of the time and at least 4 samples per pixel, samples the screen evenly. Its error
    /// in each region of some pixels gives the number of camera paths of the region in the rest of the render, at least a quarter of an even
    /// share. The picture stays unbiased. It takes 16 samples per pixel or more.
    #[arg(long, help_heading = "Sampling")]
    pub adaptive: bool,

    /// Rasterise samples in index order: the same bytes for any number of threads and any --simd.
    #[arg(long, help_heading = "Sampling")]
    pub deterministic: bool,

    /// Reweight fireflies, samples of high contribution that few paths find: less noise, and a picture that is mostly too dark.
    ///
    /// The bias vanishes with the number of samples: what is found by about K samples in each pixel counts in full (Zirr,
    /// Hanika and Dachsbacher 2018). Takes the memory of up to 17 films, and shows PNG files without blur and glare. The
    /// stated error is that of the picture without.
    #[arg(
        long,
        value_name = "K",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "1",
        value_parser = positive,
        help_heading = "Output"
    )]
    pub reweight_fireflies: Option<f32>,

    /// Filter noise out of the displayed picture: PNG files, and the layer `denoised` of EXR files; samples and sums stay those of the
    /// picture without. Its error is stated beside that of the picture without, unless both randomisations may share some: while light is missing, by
    /// methods with photons, and after a render was resumed.
    ///
    /// `oidn` is Intel's Open Image Denoise and needs its library: the file that the environment variable OIDN_LIBRARY names, or else
    /// libOpenImageDenoise where the system looks for libraries. `pointillist devices` says whether it is there, and where it can be had.
    #[arg(long, value_name = "KIND", default_value = "off", help_heading = "Output")]
    pub denoise: Denoise,

    /// Keep the state of the render in this file, so that it can be gone on with: every --state-every seconds and at the end.
    ///
    /// The sums are then exact, the same bits in any order, and made on the processor; the picture is that of --deterministic.
    #[arg(long, value_name = "FILE", help_heading = "State")]
    pub state: Option<PathBuf>,

    /// Go on with a render: the argument is its state instead of a scene.
    ///
    /// Scene and settings are those of the state, which is kept up to date, or with --state left as it is. With --spp, --samples, --time
    /// or --error it goes on until that is reached, otherwise until what was asked for when it began. The picture is the same, bit for bit,
    /// as if it had not been interrupted.
    #[arg(long, help_heading = "State")]
    pub resume: bool,

    /// Seconds between two states: as much is lost at most when the program is killed.
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = seconds, help_heading = "State")]
    pub state_every: Duration,

    /// Write the picture to this .exr or .png file; may be given several times [default: the scene's name as .png].
    ///
    /// On SIGUSR1 the picture so far is written beside it, to FILE-0012spp.exr after 12 samples per pixel, and the render goes on.
    #[arg(short = 'o', long = "output", value_name = "FILE", help_heading = "Output")]
    pub outputs: Vec<PathBuf>,

    /// Layers that EXR files have beside the picture, as name:type,… or by their types alone [default: those of the scene].
    ///
    /// Types are albedo, depth, position, uv, geo_normal, sh_normal, prim_index and shape_index, with the channels that
    /// Mitsuba's integrator `aov` gives them; and of the media before what is seen first, which are ours alone, transmittance (R, G, B) and
    /// scattering_depth (T), the mean distance at which light is scattered last. With --stereo there is also disparity (x): pixels by which what is seen lies
    /// farther right for the left eye than for the right, in the layer NAMEL of the left view and NAMER of the right. Each is the mean of what camera
    /// rays see first, weighted by the splat filter.
    #[arg(long, value_name = "LIST", value_parser = aov, help_heading = "Output")]
    pub aov: Option<AovArg>,

    /// Show the picture on its way in the image viewer tev, which listens at 127.0.0.1:14158 unless told otherwise.
    ///
    /// Once a second and at the end, in linear Rec.709. The render goes on where there is no tev.
    #[arg(long, value_name = "HOST:PORT", value_parser = host_port, help_heading = "Output")]
    pub tev: Option<String>,

    /// Render the pictures of two eyes at once, and show both in PNG files in this way [default: side-by-side].
    ///
    /// LAYOUT is side-by-side, over-under (either with -half), cross-eyed, anaglyph (red–cyan; also anaglyph-green-magenta, anaglyph-amber-blue,
    /// anaglyph-grey), row-interlaced, column-interlaced, checkerboard, or pair: FILE_left.png and FILE_right.png. EXR files have the views
    /// `left` and `right`. Names may also end in .jps or .mpo. The eyes share what both of them see, so that both cost little more than
    /// one. The error is stated of each eye and of both together, and --error waits for the worse one.
    #[arg(
        long,
        value_name = "LAYOUT",
        num_args = 0..=1,
        default_missing_value = StereoLayout::SideBySide.name(),
        value_parser = stereo_layout,
        help_heading = "Stereo"
    )]
    pub stereo: Option<StereoLayoutArg>,

    /// Where the eyes are.
    #[command(flatten)]
    pub eyes: EyesArgs,

    /// Make a picture for each group of lights in the same render, as layers of EXR files that add up to the picture.
    ///
    /// GROUPS is NAME=EMITTER,EMITTER;NAME=EMITTER,…: emitters by their `id` (an area light by that of its shape, and a medium that shines by
    /// its own), or by the name that the program gives them if they have none; those that are not named are the group `others`. Without GROUPS each emitter is a group of its
    /// own. If there are more than 8, those whose names differ in a number at their end are one group (lamp_1, lamp_2: lamp), and if there are
    /// still more the 7 strongest groups stay and the rest is `others`. A group is the layer NAME.R, NAME.G, NAME.B. All of a path is
    /// credited to the lights that it comes from: each path is traced once, and the picture is the same as without. With --stereo each view
    /// has these layers, and the eyes share no paths.
    #[arg(
        long,
        value_name = "GROUPS",
        num_args = 0..=1,
        default_missing_value = EACH_EMITTER,
        value_parser = light_groups,
        help_heading = "Output"
    )]
    pub light_groups: Option<LightGroupsArg>,

    /// Write a report of the run as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE|-", help_heading = "Output")]
    pub json: Option<PathBuf>,

    /// Show no progress bar and no summary, only warnings and errors.
    #[arg(long, short, help_heading = "Output")]
    pub quiet: bool,

    /// Write when every pass, worker and client step ran: FILE as CSV, FILE.json as a Chrome trace.
    ///
    /// The CSV has one row per frame and scope (frame,scope,depth,start_ns,end_ns). The trace, for ui.perfetto.dev, has GPU
    /// passes, tracer threads and client on one clock: the device's clock is calibrated every 100 ms, or if it cannot be read,
    /// frames are placed between submission and completion. Both files state the method, its uncertainty, and what is missing.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub gpu_timings: Option<PathBuf>,

    /// Trace this share of the paths (0 to 1) by fully general code too, and fail if the samples differ by a bit.
    ///
    /// Renders undivided, as by --replicates 1. In a scene without colour samples may differ in the fifth digit; paths whose
    /// roulette a rounding decides differently are counted.
    #[arg(long, value_name = "F", default_value_t = 0.0, value_parser = share, help_heading = "Output")]
    pub check_plan: f64,
}

impl From<RenderArgs> for RenderOptions {
    fn from(args: RenderArgs) -> Self {
        Self {
            source: args.source,
            display: args.display.settings(),
            samples: args.samples,
            spp: args.spp,
            time: args.time,
            error: args.error,
            error_at: args.error_at,
            replicates: args.replicates,
            first_index: args.first_index,
            adaptive: args.adaptive,
            deterministic: args.deterministic,
            reweight_fireflies: args.reweight_fireflies,
            denoise: args.denoise,
            state: args.state,
            resume: args.resume,
            state_every: args.state_every,
            outputs: args.outputs,
            aov: args.aov.map(|list| list.0),
            tev: args.tev,
            stereo: args.stereo.map(|StereoLayoutArg(layout)| args.eyes.options(layout)),
            light_groups: args.light_groups.map(|groups| groups.0),
            json: args.json,
            quiet: args.quiet,
            gpu_timings: args.gpu_timings,
            check_plan: args.check_plan,
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct RenderWords {
        #[command(flatten)]
        args: RenderArgs,
    }

    /// `shard` begins with [`RenderOptions::of`]: its values are the defaults of the command line.
    #[test]
    fn options_have_the_defaults_of_the_command_line() {
        let read = RenderOptions::from(RenderWords::parse_from(["render", "scene.xml"]).args);
        assert_eq!(
            format!("{read:?}"),
            format!("{:?}", RenderOptions::of(SceneOptions::of("scene.xml".into())))
        );
    }
}
