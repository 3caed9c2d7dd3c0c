//! Options of `pointillist view`.

use std::path::PathBuf;

use clap::Args;

use crate::client::{ColorOutput, Denoise, Settings};
use crate::cmd::args::display::DisplayArgs;
use crate::cmd::args::remote::ConnectArgs;
use crate::cmd::args::stereo::EyesArgs;
use crate::cmd::args::values::{count, host_port, positive, window_layout};
use crate::color::pq;
#[cfg(feature = "faults")]
use crate::gpu::{CallFault, CallFaults, DeviceFaults};
use crate::image::stereo::StereoLayout;
use crate::render::options::SceneOptions;
use crate::viewer::options::{OF_TRACER, ViewOptions};

/// Options of `pointillist view`.
#[derive(Args, Debug)]
#[command(mut_arg("scene", |scene| scene.required(false).default_value(OF_TRACER).hide_default_value(true)))]
pub struct ViewArgs {
    /// What is traced.
    #[command(flatten)]
    pub source: SceneOptions,

    /// Where it is traced.
    #[command(flatten)]
    pub tracers: ConnectArgs,

    /// How it is shown.
    #[command(flatten)]
    pub display: DisplayArgs,

    /// Filter noise out of the picture in the window; samples, sums and the stated error stay those of the picture without [default:
    /// wavelet; off with --deterministic and with --replicates 1, which has no halves to compare].
    ///
    /// `oidn` is Intel's Open Image Denoise and needs its library: the file that the environment variable OIDN_LIBRARY names, or else
    /// libOpenImageDenoise where the system looks for libraries. `pointillist devices` says whether it is there, and where it can be had.
    #[arg(long, value_name = "KIND", help_heading = "Display")]
    pub denoise: Option<Denoise>,

    /// Begin every view with samples alone. Otherwise, where only the camera moves, the last filtered picture stands in for samples of the new
    /// view until there are enough of them.
    #[arg(long, help_heading = "Display")]
    pub no_reproject: bool,

    /// Trace the first camera paths after a move where the last filtered picture, carried over, shows least.
    #[arg(long, help_heading = "Display")]
    pub steer: bool,

    /// Pictures per second aimed at [default: the display's rate].
    #[arg(long, value_name = "N", value_parser = positive, help_heading = "Window")]
    pub fps: Option<f32>,

    /// Begin without the panel.
    #[arg(long, help_heading = "Window")]
    pub no_panel: bool,

    /// Colour encoding of the window, if the display offers it.
    #[arg(long, value_name = "KIND", default_value = "sdr", help_heading = "Window")]
    pub hdr: ColorOutput,

    /// Peak luminance of the display with --hdr, cd/m², from that of diffuse white on: highlights roll off to it, and the display is told.
    #[arg(long, value_name = "CD/M2", default_value_t = pq::PEAK, value_parser = clap::value_parser!(u32).range(203..=10_000), help_heading = "Window")]
    pub hdr_peak: u32,

    /// See with two eyes: trace both at once, and show them as one picture. LAYOUT is one of those of `render --stereo`, without pair, or
    /// `swapchain`: a layer of the window's images for each eye, where the display has quad-buffered stereo.
    #[arg(
        long,
        value_name = "LAYOUT",
        num_args = 0..=1,
        default_missing_value = StereoLayout::SideBySide.name(),
        value_parser = window_layout,
        help_heading = "Stereo"
    )]
    pub stereo: Option<StereoLayout>,

    /// Where the eyes are.
    #[command(flatten)]
    pub eyes: EyesArgs,

    /// Stop tracing after this many camera paths (k, M, G are accepted); the window stays open.
    #[arg(long, value_name = "N", value_parser = count, help_heading = "Sampling")]
    pub samples: Option<u64>,

    /// Rasterise in index order and whole batches: with --samples the same bytes as `render --deterministic`.
    #[arg(long, help_heading = "Sampling")]
    pub deterministic: bool,

    /// Number of independent randomisations: 2 tell the error of their mean, 1 does not know its own error.
    #[arg(long, value_name = "1|2", default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2), help_heading = "Sampling")]
    pub replicates: u8,

    /// Write the picture to this .exr or .png file when the window closes, however it closes; may be given several times.
    #[arg(short = 'o', long = "output", value_name = "FILE", help_heading = "Output")]
    pub outputs: Vec<PathBuf>,

    /// Show the picture in the image viewer tev, too, as `render --tev` does.
    #[arg(long, value_name = "HOST:PORT", value_parser = host_port, help_heading = "Output")]
    pub tev: Option<String>,

    /// Write a report of the session as JSON when the window closes; `-` is standard output.
    #[arg(long, value_name = "FILE|-", help_heading = "Output")]
    pub json: Option<PathBuf>,

    /// Write when every pass, worker and client step ran: FILE as CSV, FILE.json as a Chrome trace (see `render --help`).
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub gpu_timings: Option<PathBuf>,

    /// Faults of devices.
    #[cfg(feature = "faults")]
    #[command(flatten)]
    faults: FaultArgs,
}

/// Faults of devices, for tests.
#[cfg(feature = "faults")]
#[derive(Args, Debug)]
struct FaultArgs {
    /// The device is lost after this many frames; given again, the one after it, too.
    #[arg(long, value_name = "N", hide = true)]
    lose_device_after: Vec<u64>,

    /// So many calls (surface, swapchain, acquire, present, allocation, mapping or pipeline) have this result after others.
    #[arg(long, value_name = "CALL,AFTER,TIMES,RESULT", hide = true)]
    fail_call: Vec<CallFault>,

    /// Images and buffers have this many MiB of device memory.
    #[arg(long, value_name = "MIB", hide = true)]
    device_memory: Option<u64>,
}

#[cfg(feature = "faults")]
impl From<FaultArgs> for DeviceFaults {
    fn from(args: FaultArgs) -> Self {
        Self {
            calls: CallFaults::of(&args.fail_call),
            losses: args.lose_device_after,
            memory: args.device_memory.map(|mib| mib << 20),
        }
    }
}

impl From<ViewArgs> for ViewOptions {
    fn from(args: ViewArgs) -> Self {
        Self {
            source: args.source,
            tracers: args.tracers.into(),
            display: Settings { output: args.hdr, peak: args.hdr_peak, ..args.display.settings() },
            fixed_exposure: args.display.exposure.is_some(),
            denoise: args.denoise,
            no_reproject: args.no_reproject,
            steer: args.steer,
            fps: args.fps,
            no_panel: args.no_panel,
            stereo: args.stereo.map(|layout| args.eyes.options(Some(layout))),
            samples: args.samples,
            deterministic: args.deterministic,
            replicates: args.replicates,
            outputs: args.outputs,
            tev: args.tev,
            json: args.json,
            gpu_timings: args.gpu_timings,
            #[cfg(feature = "faults")]
            faults: args.faults.into(),
            #[cfg(not(feature = "faults"))]
            faults: Default::default(),
        }
    }
}
