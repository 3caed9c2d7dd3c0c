//! Data of the panel: plain values, which the viewer fills in for every frame.

use std::sync::Arc;

use crate::client::window::viewport::Viewport;

/// Everything that the panel shows.
#[derive(Clone, Debug, Default)]
pub struct PanelData {
    /// Size of the picture in pixels.
    pub extent: [u32; 2],
    /// Visible part of the picture, and its position.
    pub view: PictureView,
    /// A message for the user, such as where a file was saved.
    pub message: Option<String>,
    /// Whether the section of the selection has anything to show.
    pub has_selection: bool,
    /// `[seconds, error]` of the checkpoints of the picture that is compared with.
    pub compared: Vec<[f64; 2]>,
    /// Map drawn over the picture.
    pub overlay: PictureOverlay,
    /// Name of the change that undo would revert.
    pub undo: Option<String>,
    /// Name of the change that redo would repeat.
    pub redo: Option<String>,
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
    }
}
