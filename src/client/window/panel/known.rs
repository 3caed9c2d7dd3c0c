//! What the panel is told of the picture's error, of the maps over it and of costs: plain data, filled by the viewer.

use std::sync::Arc;

/// Relative errors to choose from, with what they are called.
pub const TARGETS: [(f64, &str); 7] = [
    (0.1, "10 %"),
    (0.05, "5 %"),
    (0.02, "2 %"),
    (0.01, "1 %"),
    (0.005, "0.5 %"),
    (0.002, "0.2 %"),
    (0.001, "0.1 %"),
];

/// The one that is chosen at first.
pub const DEFAULT_TARGET: f64 = 0.01;

/// What the panel shows of the picture's error.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ErrorReadout {
    /// Error that half, 95 % and 99 % of the picture stay below, and the 90 % interval of each, in words. `None` before the
    /// first look.
    pub now: Option<[[String; 2]; 3]>,
    /// Seconds and relative error (95 %) of every look.
    pub looks: Vec<[f64; 2]>,
    /// The line through them and on to the target, as seconds and relative errors.
    pub fit: Vec<[f64; 2]>,
    /// When the target will be reached, seconds since the render began: best guess, and the ends of the 90 % interval.
    pub due: Option<[f64; 3]>,
    /// The same in words, or what there is to say instead.
    pub words: String,
    /// Seconds since the render began.
    pub seconds: f64,
}

/// What lies over the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Show {
    /// Nothing.
    #[default]
    Picture,
    /// The error of every neighbourhood of 8×8 pixels.
    ErrorMap,
    /// The time that paths take by region.
    CostMap,
}

/// What is to be laid over the picture.
#[derive(Clone, Debug, Default)]
pub enum Overlay {
    /// Nothing.
    #[default]
    None,
    /// A map.
    Map(Arc<MapReadout>),
    /// Why there is no map, in words.
    Missing(String),
}

/// A map over the picture in false colours.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MapReadout {
    /// Which one.
    pub show: Show,
    /// Columns and rows.
    pub grid: [usize; 2],
    /// How many columns and rows fill the window: the last ones may reach beyond it.
    pub cells: [f64; 2],
    /// Figures, row by row; NaN where nothing is known. Relative errors, or microseconds per path.
    pub values: Vec<f64>,
    /// What the colours mean.
    pub scale: Scale,
    /// Share of each cell in the time of all, for the map of costs.
    pub shares: Vec<f64>,
}

/// From figures to the way of colours.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scale {
    /// Figure at the dark end.
    pub low: f64,
    /// Figure at the light end.
    pub high: f64,
    /// Equal steps of colour are equal factors.
    pub logarithmic: bool,
}

impl Scale {
    /// Where a figure lies between the ends: 0 … 1 within them.
    pub fn place(self, figure: f64) -> f32 {
        let Self { low, high, logarithmic } = self;
        let place = match logarithmic {
            // What is not there at all is as dark as what is least.
            true => (figure.max(1e-9 * high) / low).ln() / (high / low).ln(),
            false => (figure - low) / (high - low),
        };
        if figure.is_nan() { f32::NAN } else { place as f32 }
    }

    /// The figure in the middle of the colours.
    pub fn middle(self) -> f64 {
        if self.logarithmic { (self.low * self.high).sqrt() } else { 0.5 * (self.low + self.high) }
    }
}

/// What is known of the costs of effects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CostState {
    /// Nothing.
    #[default]
    Unknown,
    /// They are being measured.
    Measuring,
    /// They are those of the scene as it is.
    Fresh,
    /// Something has been edited since.
    Stale,
}

/// What an effect costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EffectCost {
    /// Share of the tracing time that is saved without it.
    Share(f64),
    /// How much longer paths would take with a small example of it, as a share of the present time, where it is off.
    More(f64),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_find_their_colours() {
        let log = Scale { low: 0.001, high: 0.1, logarithmic: true };
        assert!((log.place(0.01) - 0.5).abs() < 1e-6 && (log.middle() - 0.01).abs() < 1e-9);
        assert!(log.place(0.0) < 0.0 && log.place(f64::NAN).is_nan() && log.place(1.0) > 1.0);
        let linear = Scale { low: 0.0, high: 4.0, logarithmic: false };
        assert!((linear.place(1.0) - 0.25).abs() < 1e-6 && linear.middle() == 2.0);
        assert!(TARGETS.iter().any(|(target, _)| *target == DEFAULT_TARGET));
    }
}
