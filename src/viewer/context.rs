//! What stays constant while the window is open.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::client::window::panel::PanelControls;
use crate::gpu::{DeviceChoice, DeviceFaults};
use crate::remote::TracerAddress;
use crate::render::options::StereoOptions;
use crate::render::outputs::Outputs;
use crate::render::tev::TevLink;

/// Options of the session that stay constant while the window is open, apart from scene and method.
pub struct SessionContext {
    /// Start of the program.
    pub began: Instant,
    /// Pictures to write at the end.
    pub outputs: Outputs,
    /// File for the statistics written at the end.
    pub json: Option<PathBuf>,
    pub device: DeviceChoice,
    /// CSV file for the timings of every pass.
    pub timings: Option<PathBuf>,
    pub faults: DeviceFaults,
    /// Camera paths after which a render ends; `None` for no limit.
    pub samples: Option<u64>,
    /// Connection to the viewer tev, if requested.
    pub tev: Option<TevLink>,
    /// Remote tracers; if empty, threads of this process trace.
    pub tracers: Vec<TracerAddress>,
    /// Frame length; `None` for the display's refresh interval.
    pub budget: Option<Duration>,
    /// Two eyes, if the command line asks for them.
    pub stereo: Option<StereoOptions>,
    /// The controls of the panel as they were at the start.
    pub controls: PanelControls,
    /// Name of the scene, for title and file names.
    pub name: String,
}
