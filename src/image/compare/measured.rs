//! Pictures that know their own noise.

use std::path::Path;

use super::pixels::luminance;
use crate::image::error::ImageError;
use crate::image::exr;

/// A picture's luminance with the variance of every pixel's mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Luminance Y.
    pub mean: Vec<f64>,
    /// Variance of `mean`, not of single samples.
    pub variance: Vec<f64>,
}

impl Measured {
    /// Name of the channel that holds the variance of the mean.
    pub const VARIANCE_CHANNEL: &'static str = "variance.Y";

    /// Reads R, G, B and [`VARIANCE_CHANNEL`](Self::VARIANCE_CHANNEL) of an EXR file.
    ///
    /// # Errors
    /// As [`exr::read`], and [`ImageError::Channel`].
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let layers = exr::read(path)?;
        let [r, g, b, variance] =
            ["R", "G", "B", Self::VARIANCE_CHANNEL].map(|name| exr::channel(path, &layers, name));
        let (r, g, b) = (r?, g?, b?);
        Ok(Self {
            width: layers.width,
            height: layers.height,
            mean: (0..r.len()).map(|i| luminance([r[i], g[i], b[i]])).collect(),
            variance: variance?.iter().map(|&v| f64::from(v)).collect(),
        })
    }
}
