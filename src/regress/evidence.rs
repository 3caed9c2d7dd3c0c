//! What several independent renderings of one picture say together.

use std::path::Path;

use crate::image::compare::Picture;
use crate::image::{Grid, ImageError};

/// Side of an area in pixels.
pub const AREA: usize = 8;

/// Mean and variance of independent renderings of equal effort.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// Number of renderings; 1 for a single picture, whose variances are given or estimated.
    pub renderings: usize,
    /// Mean of each pixel: linear Rec.709.
    pub mean: Grid<[f32; 3]>,
    /// Variance of `mean`, of each channel.
    pub variance: Grid<[f32; 3]>,
    /// Mean of each area of [`AREA`]² pixels (less at the right and lower border) in each rendering, `[renderings][areas]`, row by row.
    pub areas: Vec<Vec<[f32; 3]>>,
    /// Hash of each rendering's values, in order: equal for the same bits.
    pub hashes: Vec<String>,
}

impl Evidence {
    /// Of renderings with independent seeds.
    ///
    /// # Errors
    /// [`ImageError::Size`] for pictures of different sizes.
    pub fn of_pictures(_pictures: &[Picture]) -> Result<Self, ImageError> {
        unreachable!("written elsewhere")
    }

    /// Of one picture of any program: by its channel of variances, or by its noise estimated.
    ///
    /// # Errors
    /// Those of reading it.
    pub fn of_single(_path: &Path) -> Result<Self, ImageError> {
        unreachable!("written elsewhere")
    }

    /// Reads a reference that [`Self::write`] wrote, with its attributes by name.
    ///
    /// # Errors
    /// [`ImageError::Read`], [`ImageError::Decode`]; [`ImageError::Channel`] for a picture that is no such reference.
    pub fn read(_path: &Path) -> Result<(Self, Vec<(String, String)>), ImageError> {
        unreachable!("written elsewhere")
    }

    /// Writes an EXR file with attributes (provenance), small: values are rounded to a fraction of their standard error first.
    ///
    /// # Errors
    /// [`ImageError::Write`].
    pub fn write(&self, _path: &Path, _attributes: &[(String, String)]) -> Result<(), ImageError> {
        unreachable!("written elsewhere")
    }
}
