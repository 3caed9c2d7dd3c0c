//! What the panel shows: plain data, which the viewer fills in anew for every frame.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crate::client::settings::FilmCounts;
use crate::client::window::panel::compare::ComparisonData;
use crate::client::window::panel::gizmo::{GizmoDrawing, GizmoMode};
use crate::client::window::panel::inspect::{PixelPaths, PixelReading};
use crate::client::window::panel::look::Histogram;
use crate::client::window::panel::mix::LightMixData;
use crate::client::window::viewport::Viewport;

/// Everything that the panel shows.
#[derive(Clone, Debug, Default)]
pub struct PanelData {
    /// Name and driver of the device.
    pub device: String,
    /// Name of the integrator.
    pub method: &'static str,
    /// Names of those that can be chosen.
    pub methods: Vec<&'static str>,
    /// The program chooses.
    pub chooses_method: bool,
    /// Why the program chose this integrator; empty where the user did.
    pub reason: String,
    /// How tracer and display share the processor, in words.
    pub plan: String,
    /// Size of the picture in pixels.
    pub extent: [u32; 2],
    /// Which part of it is shown, and where.
    pub view: PictureView,
    /// Internal resolution: picture pixels per reconstructed pixel and axis.
    pub detail: u32,
    /// Samples and paths that the film has received.
    pub counts: FilmCounts,
    /// Samples per second that the tracer makes.
    pub traced_per_second: f64,
    /// Samples per second that the client rasterises.
    pub rasterised_per_second: f64,
    /// Share of the time in which the display draws.
    pub drawing: f64,
    /// Level of detail of camera and light stream, `None` without samples.
    pub lods: [Option<f32>; 2],
    /// Blocks in the lanes, and how many fit.
    pub ring: (usize, usize),
    /// Name and milliseconds of every pass in the last timed frame.
    pub passes: Vec<(&'static str, f64)>,
    /// Times of the last frames, oldest first, milliseconds.
    pub frames: Vec<f32>,
    /// p50, p95, p99 of `frames`, milliseconds.
    pub percentiles: [f32; 3],
    /// Time that a frame may take.
    pub budget: Duration,
    /// Time from the last edit to the first picture that shows it.
    pub edit_latency: Option<Duration>,
    /// p95 of the latencies of the last edits.
    pub edit_latency_p95: Option<Duration>,
    /// Number of tracing threads.
    pub threads: usize,
    /// Tracers on other machines.
    pub tracers: Vec<TracerRow>,
    /// Time since the present epoch began.
    pub elapsed: Duration,
    /// A message for the user, such as where a file was saved.
    pub message: Option<String>,
    /// The selected object, or the lights.
    pub selection: Option<Selection>,
    /// Every effect, on or off.
    pub effects: Vec<EffectRow>,
    /// Whether the costs of the effects are known.
    pub costs: CostState,
    /// Error of the picture; `None` where the render is not divided into replicates.
    pub error: Option<Arc<ErrorSummary>>,
    /// What is drawn over the picture.
    pub overlay: PictureOverlay,
    /// Names of the effects that are forced off.
    pub left_out: Vec<&'static str>,
    /// Values that the tracer has rejected since the last edit.
    pub rejected: RejectedList,
    /// The pixel under the pointer, where it is inspected.
    pub pixel: Option<PixelReading>,
    /// What undo would take back, in words.
    pub undo: Option<String>,
    /// What redo would repeat.
    pub redo: Option<String>,
    /// What the gizmo does.
    pub gizmo_mode: GizmoMode,
    /// The gizmo over the selected object, where it is shown.
    pub gizmo: Option<GizmoDrawing>,
    /// The rectangle of the picture that is traced alone, or is being dragged.
    pub region: Option<RegionDrawing>,
    /// The outline of the selected object: lines between places in pixels of the picture.
    pub outline: Option<Arc<Vec<[[f32; 2]; 2]>>>,
    /// The paths of the pixel that was clicked at.
    pub paths: Option<Arc<PixelPaths>>,
    /// They are being traced.
    pub traces_paths: bool,
    /// The histogram of the picture, where the tab of the display is seen.
    pub histogram: Option<Arc<Histogram>>,
    /// The light mix.
    pub mix: LightMixData,
    /// Pictures to compare with.
    pub comparison: ComparisonData,
    /// Views that are kept, by number.
    pub views: Vec<u8>,
    /// Scenes that were open lately, the last first.
    pub recent: Vec<PathBuf>,
    /// Tracing is paused.
    pub is_paused: bool,
    /// Camera in words: position, target, field of view.
    pub camera: String,
    /// Field of view in degrees, 0 when not known.
    pub fov: f64,
}

/// A rectangle of the picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionDrawing {
    /// Its first pixel.
    pub origin: [u32; 2],
    /// Its size.
    pub extent: [u32; 2],
    /// It is traced alone; otherwise it is being dragged.
    pub is_traced: bool,
    /// Paths per pixel of its own.
    pub per_pixel: f64,
}

/// Which part of the picture is shown, and how large.
#[derive(Clone, Copy, Debug)]
pub struct PictureView {
    /// The part.
    pub viewport: Viewport,
    /// Physical pixels per point.
    pub pixels_per_point: f32,
}

impl Default for PictureView {
    fn default() -> Self {
        Self { viewport: Viewport::new([1, 1]), pixels_per_point: 1.0 }
    }
}

/// One tracer on another machine.
#[derive(Clone, Debug, PartialEq)]
pub struct TracerRow {
    /// Where it is.
    pub address: String,
    /// How it is.
    pub words: String,
    /// Something is wrong with it.
    pub ill: bool,
}

/// Values that were rejected: how many, and the first of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RejectedList {
    /// How many.
    pub total: u64,
    /// The first.
    pub rows: Vec<RejectedRow>,
}

/// One value that was rejected.
#[derive(Clone, Debug, PartialEq)]
pub struct RejectedRow {
    /// What it was, and where.
    pub what: String,
    /// The command that shows it again.
    pub command: String,
}

/// One line of the list of effects.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectRow {
    /// Its name.
    pub name: &'static str,
    /// Whether it is simulated.
    pub on: bool,
    /// What in the scene calls for it, and where, or why nothing does.
    pub reason: String,
    /// Whether the user can switch it.
    pub can_switch: bool,
    /// Its cost, once that was measured.
    pub cost: Option<EffectCost>,
}

/// The selected object, or the lights of the scene where nothing is selected.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// Its `id`, or kind and line of the file.
    pub name: String,
    /// Whether the user has selected it and can deselect it.
    pub selected: bool,
    /// Its values that can be changed, and behind them those of the lens.
    pub parameters: Vec<SceneParameter>,
    /// Where those of the lens begin.
    pub lens_from: usize,
}

/// One value of the selected object.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneParameter {
    /// Label.
    pub label: String,
    /// Present value.
    pub value: ParameterValue,
}

/// A value that can be changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterValue {
    /// A factor ≥ 0 on the file's value, shown logarithmically.
    Scale(f64),
    /// Linear Rec.709 reflectance or emission colour, 0 … 1.
    Color([f32; 3]),
    /// A number within bounds.
    Number {
        /// Present value.
        value: f64,
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// On or off.
    Switch(bool),
    /// A point or a direction in world space.
    Vector {
        /// Present value.
        value: [f64; 3],
        /// A small change of it.
        step: f64,
    },
}

/// Target errors that the panel offers, with their labels.
pub const TARGETS: [(f64, &str); 7] = [
    (0.1, "10 %"),
    (0.05, "5 %"),
    (0.02, "2 %"),
    (0.01, "1 %"),
    (0.005, "0.5 %"),
    (0.002, "0.2 %"),
    (0.001, "0.1 %"),
];

/// The target error at the start.
pub const DEFAULT_TARGET: f64 = 0.01;

/// The relative error of the picture: now, so far, and predicted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ErrorSummary {
    /// Median, 95 % and 99 % quantile of the error, each with its 90 % interval, in words. `None` before the first checkpoint.
    pub quantiles: Option<[[String; 2]; 3]>,
    /// The error of the picture through the noise filter (95 %) in words; `None` where it is shown as it is.
    pub filtered: Option<String>,
    /// Seconds and error (95 %) of every checkpoint.
    pub checkpoints: Vec<[f64; 2]>,
    /// The line fitted to the checkpoints and extended to the target: seconds and errors.
    pub fit: Vec<[f64; 2]>,
    /// Predicted time at which the target is reached, in seconds since the render began, and the ends of its 90 % interval.
    pub prediction: Option<[f64; 3]>,
    /// The prediction in words, or why there is none.
    pub message: String,
    /// Why the error cannot be trusted, in words.
    pub warning: Option<String>,
    /// Light that the picture lacks and the error counts, if it is worth telling.
    pub unfound: Option<UnfoundSummary>,
    /// Seconds since the render began.
    pub seconds: f64,
    /// Seconds and error of the checkpoints of the picture that this one is compared with.
    pub compared: Vec<[f64; 2]>,
}

/// Light that the picture lacks.
#[derive(Clone, Debug, PartialEq)]
pub struct UnfoundSummary {
    /// How much, and of what kind.
    pub text: String,
    /// Name of the method that finds it, if one does.
    pub method: Option<&'static str>,
}

/// The map that the user wants to see over the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MapChoice {
    /// No map.
    #[default]
    None,
    /// Error of every neighbourhood of 8×8 pixels.
    Error,
    /// Time that paths take, by region.
    Cost,
    /// Relative difference of luminance from another picture.
    Difference,
    /// What is noticed of the difference from another picture.
    Flip,
}

/// What is drawn over the picture.
#[derive(Clone, Debug, Default)]
pub enum PictureOverlay {
    /// Nothing.
    #[default]
    None,
    /// A map.
    Map(Arc<FalseColorMap>),
    /// A message that says why there is no map.
    Missing(String),
}

/// A map over the picture in false colours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FalseColorMap {
    /// Which map it is.
    pub kind: MapChoice,
    /// Columns and rows.
    pub grid: [usize; 2],
    /// How many columns and rows fill the window: the last ones may reach beyond it.
    pub cells: [f64; 2],
    /// Relative errors, or microseconds per path, row by row; NaN where unknown.
    pub values: Vec<f64>,
    /// Maps values to colours.
    pub scale: ColorScale,
    /// Share of each cell in the total time; empty but for the map of costs.
    pub shares: Vec<f64>,
}

/// Maps values to positions on the colour ramp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColorScale {
    /// Value at the dark end.
    pub low: f64,
    /// Value at the light end.
    pub high: f64,
    /// Equal steps of colour are equal factors instead of equal differences.
    pub logarithmic: bool,
}

impl ColorScale {
    /// Position of a value on the ramp, 0 … 1 between the ends; NaN for NaN.
    pub fn position(self, value: f64) -> f32 {
        let Self { low, high, logarithmic } = self;
        let position = match logarithmic {
            // Zero, which has no logarithm, lies far below the dark end.
            true => (value.max(1e-9 * high) / low).ln() / (high / low).ln(),
            false => (value - low) / (high - low),
        };
        if value.is_nan() { f32::NAN } else { position as f32 }
    }

    /// The value in the middle of the ramp.
    pub fn middle(self) -> f64 {
        if self.logarithmic { (self.low * self.high).sqrt() } else { 0.5 * (self.low + self.high) }
    }
}

/// Whether the costs of the effects are known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CostState {
    /// They were never measured.
    #[default]
    Unknown,
    /// They are being measured.
    Measuring,
    /// They hold for the scene as it is.
    Fresh,
    /// The scene was edited since they were measured.
    Stale,
}

/// What an effect costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EffectCost {
    /// Share of the tracing time that is saved without it.
    Share(f64),
    /// Relative increase of the tracing time by a small example of it, where it is off.
    More(f64),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_find_their_colours() {
        let log = ColorScale { low: 0.001, high: 0.1, logarithmic: true };
        assert!((log.position(0.01) - 0.5).abs() < 1e-6 && (log.middle() - 0.01).abs() < 1e-9);
        assert!(log.position(0.0) < 0.0 && log.position(f64::NAN).is_nan() && log.position(1.0) > 1.0);
        let linear = ColorScale { low: 0.0, high: 4.0, logarithmic: false };
        assert!((linear.position(1.0) - 0.25).abs() < 1e-6 && linear.middle() == 2.0);
        assert!(TARGETS.iter().any(|(target, _)| *target == DEFAULT_TARGET));
    }
}
