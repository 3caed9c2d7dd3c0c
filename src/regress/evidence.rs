//! What several independent renderings of one picture say together.

mod sum;

use std::path::Path;

use super::statistics::areas::AreaLayout;
use super::statistics::noise::estimated_variance;
use super::statistics::packing::{coarse, pack_areas, shared_variances, shown_and_exact, unpack_areas};
use crate::image::compare::{Picture, luminance};
use crate::image::exr::{self, Layers};
use crate::image::{Attribute, Grid, ImageError};

pub use self::sum::EvidenceSum;
pub use super::statistics::areas::AREA;

/// Channels of the picture and of the variances of their values.
const CHANNELS: [(&str, &str); 3] = [("R", "variance.R"), ("G", "variance.G"), ("B", "variance.B")];

/// Channels of the values of the picture that half floats do not hold: 0 where they do.
const EXACT: [&str; 3] = ["regress.exact.R", "regress.exact.G", "regress.exact.B"];

/// Attribute: number of renderings.
const RENDERINGS: &str = "regress.renderings";

/// Attribute: number of renderings whose areas are held.
const AREA_RENDERINGS: &str = "regress.areas";

/// Attribute: these areas, as `pack_areas` makes bytes of them.
const AREA_MEANS: &str = "regress.areaMeans";

/// Attribute: hashes of the renderings, separated by blanks.
const HASHES: &str = "regress.hashes";

/// Before the name of each attribute that the caller gives, because OpenEXR has its own meaning for some names.
const GIVEN: &str = "provenance.";

/// Mean and variance of independent renderings of equal effort.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// Number of renderings; 1 for a single picture, whose variances are given or estimated.
    pub renderings: usize,
    /// Mean of each pixel: linear Rec.709. Not finite where that of one rendering is not.
    pub mean: Grid<[f32; 3]>,
    /// Variance of `mean`, of each channel.
    pub variance: Grid<[f32; 3]>,
    /// Mean of each area of [`AREA`]² pixels (less at the right and lower border) in each rendering, `[renderings][areas]`, row by row;
    /// over the pixels that are finite in all renderings. Empty for a single picture, and for references of other programs.
    pub areas: Vec<Vec<[f32; 3]>>,
    /// Hash of each rendering's values, in order: equal for the same bits.
    pub hashes: Vec<String>,
}

impl Evidence {
    /// Of renderings with independent seeds. The variances of a single one are those of its channel `variance.Y` or estimated, as
    /// [`Self::of_single`] says.
    ///
    /// # Errors
    /// [`ImageError::Size`] for pictures of different sizes, and for none.
    pub fn of_pictures(pictures: &[Picture]) -> Result<Self, ImageError> {
        match pictures {
            [only] => Self::of_one(only, None),
            several => Self::of_grids(&several.iter().map(|picture| &picture.rgb).collect::<Vec<_>>()),
        }
    }

    /// Of the pixels of renderings; the variance of a single one is 0.
    ///
    /// # Errors
    /// [`ImageError::Size`] for different sizes, and for none.
    pub fn of_grids(grids: &[&Grid<[f32; 3]>]) -> Result<Self, ImageError> {
        let mut sum = EvidenceSum::default();
        for grid in grids {
            sum.add(grid, |number| Ok(grids[number].clone()))?;
        }
        sum.evidence()
    }

    /// Of one picture of any program: by its channels `variance.R`, `variance.G`, `variance.B` or `variance.Y`, which hold the variance of
    /// each pixel's mean; without them by its noise estimated from the picture itself, cautiously. The noise of each channel is taken
    /// to be that of luminance in proportion, and not below it, where only `variance.Y` is given.
    ///
    /// # Errors
    /// Those of reading it.
    pub fn of_single(path: &Path) -> Result<Self, ImageError> {
        let mut picture = Picture::read(path, None)?;
        let layers = exr::read(path)?;
        make_exact(&mut picture.rgb, &layers);
        Self::of_one(&picture, given_variances(&layers))
    }

    /// Of one picture with its variances, if they are given by channel.
    fn of_one(picture: &Picture, given: Option<Vec<[f32; 3]>>) -> Result<Self, ImageError> {
        let mean = picture.rgb.clone();
        let variance = match (given, picture.measured()) {
            (Some(given), _) => given,
            (None, Ok(measured)) => {
                let pixels = mean.pixels().iter().zip(&measured.variance);
                pixels.map(|(&rgb, &variance)| of_luminance(rgb, variance)).collect()
            }
            (None, Err(_)) => estimated_variance(&mean),
        };
        let size = (mean.width(), mean.height());
        let hashes = vec![hash(&mean)];
        Ok(Self { renderings: 1, mean, variance: grid(size, variance)?, areas: Vec::new(), hashes })
    }

    /// Reads a reference that [`Self::write`] wrote, with its attributes by name; also a picture with `R`, `G`, `B` and `variance.R`,
    /// `variance.G`, `variance.B` alone, as a single picture.
    ///
    /// # Errors
    /// [`ImageError::Read`], [`ImageError::Decode`]; [`ImageError::Channel`] for a picture that is no such reference.
    pub fn read(path: &Path) -> Result<(Self, Vec<(String, String)>), ImageError> {
        let picture = Picture::read(path, None)?;
        let layers = exr::read(path)?;
        let Some(variance) = given_variances(&layers) else {
            let missing = CHANNELS.iter().find(|(_, variance)| layers.channel(variance).is_none());
            let names: Vec<&str> = layers.channels.iter().map(|(name, _)| name.as_str()).collect();
            return Err(ImageError::Channel {
                path: path.to_path_buf(),
                channel: missing.unwrap_or(&CHANNELS[0]).1.to_owned(),
                found: names.join(", "),
            });
        };
        let number = |name: &str| match layers.attribute(name) {
            Some(Attribute::Number(value)) if *value >= 0.0 => Some(*value as usize),
            _ => None,
        };
        let mut mean = picture.rgb;
        make_exact(&mut mean, &layers);
        let size = (mean.width(), mean.height());
        let refuse = |reason: String| ImageError::Decode { path: path.to_path_buf(), reason };
        let areas = match (number(AREA_RENDERINGS), layers.attribute(AREA_MEANS)) {
            (None | Some(0), _) => Vec::new(),
            (Some(renderings), Some(Attribute::Bytes(packed))) => {
                let count = AreaLayout::new(size.0, size.1).count();
                let finite =
                    |areas: &Vec<Vec<[f32; 3]>>| areas.iter().flatten().flatten().all(|v| v.is_finite());
                unpack_areas(packed, renderings, count)
                    .filter(finite)
                    .ok_or_else(|| refuse(format!("its areas are not those of {renderings} renderings")))?
            }
            (Some(_), _) => {
                let reason = "its areas are in the form of an earlier version: `pointillist regress update` renders it anew";
                return Err(refuse(reason.to_owned()));
            }
        };
        let hashes = match layers.attribute(HASHES) {
            Some(Attribute::Text(hashes)) => hashes.split_whitespace().map(str::to_owned).collect(),
            _ => Vec::new(),
        };
        let renderings = number(RENDERINGS).unwrap_or(1).max(1);
        let evidence = Self { renderings, mean, variance: grid(size, variance)?, areas, hashes };
        let attributes = layers.attributes.into_iter().filter_map(|(name, value)| match value {
            Attribute::Text(text) => Some((name.strip_prefix(GIVEN)?.to_owned(), text)),
            Attribute::Number(_) | Attribute::Bytes(_) => None,
        });
        Ok((evidence, attributes.collect()))
    }

    /// Writes an EXR file with attributes (provenance), small: values are rounded to a fraction of their standard error first.
    ///
    /// Variances are kept as the mean of 4×4 pixels where no pixel stands out, with three bits of mantissa. `R`, `G`, `B` are rounded to
    /// multiples of a power of two of at most half of that standard error, which adds at most 2.1 % to the variance; what it adds is in the
    /// variance that is kept. They are half floats, which every program shows; values that half floats do not hold, such as those without
    /// noise, are exact in channels `regress.exact.R` and so on. The areas of each rendering are rounded in the same way by their
    /// own spread, and are bytes of an attribute (`statistics/packing.rs`). Samples are compressed by PIZ. Attributes get `provenance.` before
    /// their names.
    ///
    /// # Errors
    /// [`ImageError::Write`]; [`ImageError::Encode`] for attributes without a name, or twice with the same.
    pub fn write(&self, path: &Path, attributes: &[(String, String)]) -> Result<(), ImageError> {
        let (width, height) = (self.mean.width(), self.mean.height());
        let refuse = |reason: String| ImageError::Encode { path: path.to_path_buf(), reason };
        let shared = shared_variances(&self.variance);
        let mut layers = Layers { width, height, ..Layers::default() };
        for (c, (value, variance)) in CHANNELS.into_iter().enumerate() {
            let pixels = self.mean.pixels().iter().zip(&shared);
            let pixels: Vec<[f32; 2]> = pixels.map(|(mean, shared)| coarse(mean[c], shared[c])).collect();
            let means: Vec<[f32; 2]> = pixels.iter().map(|[mean, _]| shown_and_exact(*mean)).collect();
            layers.push(value, means.iter().map(|[shown, _]| *shown));
            layers.push(variance, pixels.iter().map(|[_, variance]| *variance));
            if means.iter().any(|[_, exact]| *exact != 0.0) {
                layers.push(EXACT[c], means.iter().map(|[_, exact]| *exact));
            }
        }
        let given = attributes.iter().map(|(name, value)| {
            let name = if name.is_empty() { String::new() } else { format!("{GIVEN}{name}") };
            (name, Attribute::Text(value.clone()))
        });
        layers.attributes = given.collect();
        layers.attributes.extend([
            (RENDERINGS.to_owned(), Attribute::Number(self.renderings as f64)),
            (AREA_RENDERINGS.to_owned(), Attribute::Number(self.areas.len() as f64)),
        ]);
        if !self.areas.is_empty() {
            let packed = pack_areas(&self.areas).map_err(|error| refuse(error.to_string()))?;
            layers.attributes.push((AREA_MEANS.to_owned(), Attribute::Bytes(packed)));
        }
        if !self.hashes.is_empty() {
            layers.attributes.push((HASHES.to_owned(), Attribute::Text(self.hashes.join(" "))));
        }
        if let Some((_, value)) = layers.attributes.iter().find(|(name, _)| name.is_empty()) {
            let reason = format!("an attribute without a name, of the value {value:?}, cannot be stored");
            return Err(refuse(reason));
        }
        exr::write_small(path, &layers)
    }
}

/// For which pixels all channels are finite.
fn finite(pixels: &Grid<[f32; 3]>) -> Vec<bool> {
    pixels.pixels().iter().map(|rgb| rgb.iter().all(|c| c.is_finite())).collect()
}

/// Puts the values that half floats do not hold in their place.
fn make_exact(mean: &mut Grid<[f32; 3]>, layers: &Layers) {
    for (c, name) in EXACT.into_iter().enumerate() {
        let exact = layers.channel(name).unwrap_or_default();
        let pixels = mean.pixels_mut().iter_mut().zip(exact).filter(|(_, exact)| **exact != 0.0);
        pixels.for_each(|(pixel, exact)| pixel[c] = *exact);
    }
}

/// The variances of red, green and blue that a file holds.
fn given_variances(layers: &Layers) -> Option<Vec<[f32; 3]>> {
    let [r, g, b] = CHANNELS.map(|(_, variance)| layers.channel(variance));
    let values = r?.iter().zip(g?).zip(b?);
    Some(values.map(|((r, g), b)| [*r, *g, *b].map(|v| if v < 0.0 { 0.0 } else { v })).collect())
}

/// Variances of the channels of a pixel from that of its luminance ([`VARIANCE_CHANNEL`](crate::image::compare::Measured::VARIANCE_CHANNEL)).
fn of_luminance(rgb: [f32; 3], variance: f64) -> [f32; 3] {
    let y = luminance(rgb);
    rgb.map(|value| {
        let ratio = if y > 0.0 { (f64::from(value) / y).max(1.0) } else { 1.0 };
        (variance.max(0.0) * ratio * ratio) as f32
    })
}

/// First half of the BLAKE3 hash of size and bits, in hexadecimal digits.
fn hash(pixels: &Grid<[f32; 3]>) -> String {
    let mut hasher = blake3::Hasher::new();
    for side in [pixels.width(), pixels.height()] {
        hasher.update(&(side as u64).to_le_bytes());
    }
    for y in 0..pixels.height() {
        let row: Vec<u8> = pixels.row(y).iter().flatten().flat_map(|v| v.to_bits().to_le_bytes()).collect();
        hasher.update(&row);
    }
    hasher.finalize().to_hex().chars().take(32).collect()
}

/// The grid of these values, of which there must be as many as pixels.
fn grid(size: (usize, usize), values: Vec<[f32; 3]>) -> Result<Grid<[f32; 3]>, ImageError> {
    let rows = values.len().checked_div(size.0).unwrap_or(0);
    Grid::from_rows(size.0, size.1, values).ok_or(ImageError::Size { a: size, b: (size.0, rows) })
}

#[cfg(test)]
mod tests;
