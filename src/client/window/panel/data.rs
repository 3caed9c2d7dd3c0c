//! Data of the panel: plain values, which the viewer fills in for every frame.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use crate::client::settings::FilmCounts;
use crate::client::window::viewport::Viewport;

/// Everything that the panel shows.
#[derive(Clone, Debug, Default)]
pub struct PanelData {
    /// Name and driver of the device.
    pub device: String,
    /// Name of the integrator in use.
    pub method: &'static str,
    /// Names of the selectable integrators.
    pub methods: Vec<&'static str>,
    /// Whether the choice of the integrator is automatic.
    pub chooses_method: bool,
    /// Reason for the automatic choice; empty if the user chose the integrator.
    pub reason: String,
    /// How tracer and display share the CPU, for the user.
    pub plan: String,
    /// Size of the picture in pixels.
    pub extent: [u32; 2],
    /// Visible part of the picture, and its position.
    pub view: PictureView,
    /// Internal resolution: picture pixels per reconstructed pixel and axis.
    pub detail: u32,
    /// Samples and paths that the film has received.
    pub counts: FilmCounts,
    /// Traced samples per second.
    pub traced_per_second: f64,
    /// Rasterised samples per second.
    pub rasterised_per_second: f64,
    /// Fraction of the time that the display spends drawing.
    pub drawing: f64,
    /// Level of detail of camera and light stream, `None` without samples.
    pub lods: [Option<f32>; 2],
    /// Blocks in the lanes, and their capacity.
    pub ring: (usize, usize),
    /// Name and milliseconds of every pass in the last timed frame.
    pub passes: Vec<(&'static str, f64)>,
    /// Times of the last frames, oldest first, milliseconds.
    pub frames: Vec<f32>,
    /// p50, p95, p99 of `frames`, milliseconds.
    pub percentiles: [f32; 3],
    /// Target duration of a frame.
    pub budget: Duration,
    /// Time from the last edit to the first picture that shows it.
    pub edit_latency: Option<Duration>,
    /// p95 of the latencies of the last edits.
    pub edit_latency_p95: Option<Duration>,
    /// Number of tracing threads.
    pub threads: usize,
    /// Remote tracers.
    pub tracers: Vec<TracerRow>,
    /// Time since the present epoch began.
    pub elapsed: Duration,
    /// A message for the user, such as where a file was saved.
    pub message: Option<String>,
    /// The selected object, or the lights.
    pub selection: Option<Selection>,
    /// Error of the picture; `None` where the render is not divided into replicates.
    pub error: Option<Arc<ErrorSummary>>,
    /// Map drawn over the picture.
    pub overlay: PictureOverlay,
    /// Names of the effects that are forced off.
    pub left_out: Vec<&'static str>,
    /// Values that the tracer has rejected since the last edit.
    pub rejected: RejectedList,
    /// Name of the change that undo would revert.
    pub undo: Option<String>,
    /// Name of the change that redo would repeat.
    pub redo: Option<String>,
    /// Recent scenes, newest first.
    pub recent: Vec<PathBuf>,
    /// Whether tracing is paused.
    pub is_paused: bool,
}

/// A region of the picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionDrawing {
    /// First pixel.
    pub origin: [u32; 2],
    /// Width and height.
    pub extent: [u32; 2],
    /// Whether the region is traced alone; otherwise it is being dragged.
    pub is_traced: bool,
    /// Paths per pixel of the region's samples.
    pub per_pixel: f64,
}

/// Visible part of the picture, with its scale.
#[derive(Clone, Copy, Debug)]
pub struct PictureView {
    /// Viewport of the picture.
    pub viewport: Viewport,
    /// Physical pixels per point.
    pub pixels_per_point: f32,
}

impl Default for PictureView {
    fn default() -> Self {
        Self { viewport: Viewport::new([1, 1]), pixels_per_point: 1.0 }
    }
}

/// A remote tracer.
#[derive(Clone, Debug, PartialEq)]
pub struct TracerRow {
    /// Host and port.
    pub address: String,
    /// Status for the user.
    pub words: String,
    /// Whether it is failing.
    pub ill: bool,
}

/// Rejected values: total number, and the first ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RejectedList {
    /// Total number.
    pub total: u64,
    /// The first rejected values.
    pub rows: Vec<RejectedRow>,
}

/// A rejected value.
#[derive(Clone, Debug, PartialEq)]
pub struct RejectedRow {
    /// Fault and location.
    pub what: String,
    /// Command that reproduces it.
    pub command: String,
}

/// The selected object or, if nothing is selected, the lights of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Selection {
    /// `id` of the object, or its kind and line in the file.
    pub name: String,
    /// Whether it is a selection that can be cleared.
    pub selected: bool,
    /// Editable parameters, followed by those of the lens.
    pub parameters: Vec<SceneParameter>,
    /// Index of the first lens parameter.
    pub lens_from: usize,
}

/// An editable parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneParameter {
    /// Label of the parameter.
    pub label: String,
    /// Present value.
    pub value: ParameterValue,
}

/// Value of an editable parameter.
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
        /// Step of the value when dragged.
        step: f64,
    },
}

/// Selectable error targets, with their labels.
pub const TARGETS: [(f64, &str); 7] = [
    (0.1, "10 %"),
    (0.05, "5 %"),
    (0.02, "2 %"),
    (0.01, "1 %"),
    (0.005, "0.5 %"),
    (0.002, "0.2 %"),
    (0.001, "0.1 %"),
];

/// Initial error target.
pub const DEFAULT_TARGET: f64 = 0.01;

/// The relative error of the picture: now, so far, and predicted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ErrorSummary {
    /// Median, 95 % and 99 % quantiles of the error with their 90 % intervals, as text. `None` before the first checkpoint.
    pub quantiles: Option<[[String; 2]; 3]>,
    /// Error of the denoised picture (95 % quantile) as text; `None` if the picture is not denoised.
    pub filtered: Option<String>,
    /// `[seconds, error]` of every checkpoint; error at the 95 % quantile.
    pub checkpoints: Vec<[f64; 2]>,
    /// The fitted line, extended to the target: `[seconds, error]`.
    pub fit: Vec<[f64; 2]>,
    /// Predicted time at which the target is reached, in seconds since the render began, and the ends of its 90 % interval.
    pub prediction: Option<[f64; 3]>,
    /// The prediction as text, or why there is none.
    pub message: String,
    /// Why the error is unreliable.
    pub warning: Option<String>,
    /// Light missing from the picture and included in the error, if significant.
    pub unfound: Option<UnfoundSummary>,
    /// Seconds since the render began.
    pub seconds: f64,
    /// `[seconds, error]` of the checkpoints of the reference picture.
    pub compared: Vec<[f64; 2]>,
}

/// Light missing from the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct UnfoundSummary {
    /// Amount and kind, as text.
    pub text: String,
    /// Name of a method that finds it, if any.
    pub method: Option<&'static str>,
}

/// Map selected by the user.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MapChoice {
    /// No map.
    #[default]
    None,
    /// Error of every neighbourhood of 8×8 pixels.
    Error,
    /// Time per path, by region.
    Cost,
    /// Relative difference of luminance from another picture.
    Difference,
    /// Perceptual difference (FLIP) from another picture.
    Flip,
}

/// Overlay on the picture.
#[derive(Clone, Debug, Default)]
pub enum PictureOverlay {
    /// Nothing.
    #[default]
    None,
    /// A map.
    Map(Arc<FalseColorMap>),
    /// The reason why there is no map.
    Missing(String),
}

/// A false-colour map over the picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FalseColorMap {
    /// Kind of map.
    pub kind: MapChoice,
    /// Number of columns and rows.
    pub grid: [usize; 2],
    /// Number of columns and rows that span the picture; the last ones may extend beyond it.
    pub cells: [f64; 2],
    /// Relative errors, or microseconds per path, row-major; NaN where unknown.
    pub values: Vec<f64>,
    /// Maps values to colours.
    pub scale: ColorScale,
    /// Fraction of the total time per cell; empty except for the cost map.
    pub shares: Vec<f64>,
}

/// Maps values to positions on the colour ramp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ColorScale {
    /// Value at the dark end.
    pub low: f64,
    /// Value at the light end.
    pub high: f64,
    /// Whether equal steps of colour are equal factors rather than equal differences.
    pub logarithmic: bool,
}

impl ColorScale {
    /// Position of a value on the ramp, 0 … 1 between the ends; NaN for NaN.
    pub fn position(self, value: f64) -> f32 {
        let Self { low, high, logarithmic } = self;
        let position = match logarithmic {
            // Zero, whose logarithm is undefined, is placed far below the dark end.
            true => (value.max(1e-9 * high) / low).ln() / (high / low).ln(),
            false => (value - low) / (high - low),
        };
        if value.is_nan() { f32::NAN } else { position as f32 }
    }

    /// Value at the middle of the ramp.
    pub fn middle(self) -> f64 {
        if self.logarithmic { (self.low * self.high).sqrt() } else { 0.5 * (self.low + self.high) }
    }
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
