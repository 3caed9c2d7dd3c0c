//! The estimates of witnesses for areas of the picture, from the tracer to the error estimate.

use std::ops::AddAssign;
use std::sync::Arc;

/// The estimates of two independent witnesses for all areas of a picture, row by row, and the highlights in it.
#[derive(Clone, Debug, Default)]
pub struct Witnessed {
    /// The areas by each witness; empty where none is needed.
    pub areas: [Vec<WitnessedArea>; 2],
    /// Lights that the method finds only by chance.
    pub highlights: Arc<[Highlight]>,
}

/// A lamp that the camera sees over mirrors and glass alone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Highlight {
    /// The number of the area that it lies in.
    pub area: usize,
    /// Its luminance, summed over pixels.
    pub light: f64,
    /// The pixels that it covers.
    pub pixels: f64,
    /// Expected number of samples that hit it, at one sample per pixel.
    pub chance: f64,
}

/// Statistics of one area of the picture, or sums over several.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WitnessedArea {
    /// Number of areas.
    pub areas: f64,
    /// Samples of camera paths.
    pub samples: f64,
    /// Sum of their luminance, and of its square.
    pub camera: [f64; 2],
    /// Mean luminance that light paths bring, and its variance; the sums of both over several areas.
    pub light: [f64; 2],
    /// Sum of the luminance of caustics at the samples of camera paths, as photons show it.
    pub caustics: f64,
    /// Sums over the same samples of the square of that luminance, and of the mean square of its linear Rec.709 components.
    pub caustic_squares: [f64; 2],
    /// Sum over the same samples of an unbiased estimate of the square of the expected luminance, without the noise of photons.
    pub caustic_pairs: f64,
}

impl AddAssign for WitnessedArea {
    fn add_assign(&mut self, other: Self) {
        self.areas += other.areas;
        self.samples += other.samples;
        self.caustics += other.caustics;
        self.caustic_pairs += other.caustic_pairs;
        for i in 0..2 {
            self.camera[i] += other.camera[i];
            self.light[i] += other.light[i];
            self.caustic_squares[i] += other.caustic_squares[i];
        }
    }
}

impl WitnessedArea {
    /// Mean luminance and its variance.
    pub fn mean(&self) -> [f64; 2] {
        let (n, areas) = (self.samples.max(1.0), self.areas.max(1.0));
        let mean = self.camera[0] / n;
        let variance = (self.camera[1] / n - mean * mean).max(0.0) / (n - 1.0).max(1.0);
        [mean + self.light[0] / areas, variance + self.light[1] / (areas * areas)]
    }

    /// Mean luminance of caustics.
    pub fn mean_caustics(&self) -> f64 {
        self.caustics / self.samples.max(1.0)
    }
}
