//! What the panel shows: plain data, filled by the viewer.

use std::sync::Arc;
use std::time::Duration;

use crate::client::settings::FilmCounts;
use crate::client::window::panel::known::{CostState, EffectCost, ErrorReadout, Overlay};

/// What the panel shows; filled anew for every frame.
#[derive(Clone, Debug, Default)]
pub struct Readout {
    /// Device name, with driver.
    pub device: String,
    /// Method of light transport.
    pub method: &'static str,
    /// Why this method, where the program chose it.
    pub reason: String,
    /// Plan by which tracer and display share the processor, in words.
    pub plan: String,
    /// Window size in physical pixels.
    pub extent: [u32; 2],
    /// Internal resolution: picture pixels per reconstructed one and axis.
    pub detail: u32,
    /// What the film has received.
    pub counts: FilmCounts,
    /// Texels of the padded film.
    pub texels: u64,
    /// Samples per second that the tracer makes.
    pub traced_per_second: f64,
    /// Samples per second that the client rasterises.
    pub rasterised_per_second: f64,
    /// Level of detail of camera and light stream, `None` without samples.
    pub lods: [Option<f32>; 2],
    /// Blocks in the lanes, and how many fit.
    pub ring: (usize, usize),
    /// Name and milliseconds of every pass in the last timed frame.
    pub passes: Vec<(&'static str, f64)>,
    /// Frame times of the last frames, oldest first, milliseconds.
    pub frames: Vec<f32>,
    /// p50, p95, p99 of `frames`, milliseconds.
    pub percentiles: [f32; 3],
    /// Frame budget.
    pub budget: Duration,
    /// Time from the last edit to the first picture that shows it.
    pub edit_latency: Option<Duration>,
    /// p95 of the last edits' latencies.
    pub edit_latency_p95: Option<Duration>,
    /// Threads that trace.
    pub threads: usize,
    /// Time since the present epoch began.
    pub elapsed: Duration,
    /// What the user is to be told now, such as where a file was saved.
    pub message: Option<String>,
    /// The selected object.
    pub selection: Option<Selection>,
    /// The plan: every effect, on or off.
    pub effects: Vec<Effect>,
    /// How what they cost stands to the scene as it is.
    pub costs: CostState,
    /// The error; `None` where the render is not divided into replicates.
    pub error: Option<Arc<ErrorReadout>>,
    /// What lies over the picture.
    pub overlay: Overlay,
    /// Names of the effects that are forced off.
    pub left_out: Vec<&'static str>,
    /// Camera in words: position, target, field of view.
    pub camera: String,
    /// Field of view in degrees, 0 when not known.
    pub fov: f64,
}

/// One effect of the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Effect {
    /// Its name.
    pub name: &'static str,
    /// It is simulated.
    pub on: bool,
    /// What calls for it, or why nothing does, and where.
    pub reason: String,
    /// It can be left out, or taken back in.
    pub can_switch: bool,
    /// What it costs, if that was measured.
    pub cost: Option<EffectCost>,
}

/// An object picked by a click, or what is shown without one.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// What it is called: `id`, or kind and line of the file.
    pub name: String,
    /// The user has selected it, and can deselect it.
    pub selected: bool,
    /// What can be changed of it.
    pub parameters: Vec<Parameter>,
}

/// One value of the selected object.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Label.
    pub label: String,
    /// Present value.
    pub value: Value,
}

/// A value that can be changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A factor ≥ 0 on what the file says, shown logarithmically.
    Scale(f64),
    /// Linear Rec.709 reflectance or emission colour, 0 … 1.
    Color([f32; 3]),
    /// A number within bounds.
    Number {
        /// Value.
        value: f64,
        /// Least.
        min: f64,
        /// Greatest.
        max: f64,
    },
}
