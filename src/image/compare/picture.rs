//! Pictures to compare, from EXR files of any program.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use super::{Measured, is_finite, luminance};
use crate::image::error::ImageError;
use crate::image::exr::{self, Layers};
use crate::image::grid::Grid;
use crate::image::{layer, views};

/// Most pixels that are read: the largest picture of `pointillist render`.
const MOST_PIXELS: usize = 16_384 * 16_384;

/// First bytes of an OpenEXR file.
const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Bit 11 of the version field: some part is deep.
const HAS_DEEP_DATA: u8 = 1 << 3;

/// One layer of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// The file.
    pub path: PathBuf,
    /// Name of the layer that was read; empty for the one without a name.
    pub layer: String,
    /// Scene-linear R, G, B, taken to be Rec.709 whatever the file's chromaticities say.
    pub rgb: Grid<[f32; 3]>,
    /// Luminance and its variance or, if missing, the names of the existing channels.
    measured: Result<Measured, String>,
}

impl Picture {
    /// Reads the data window of a file: scan lines or tiles (the largest resolution), channels of half, float or
    /// integers, one part or several; which layer is [`layer::main`]'s choice without a name.
    ///
    /// # Errors
    /// [`ImageError::Read`] when the system refuses, [`ImageError::Decode`] for anything that is no flat EXR file, is
    /// damaged, holds subsampled channels, or parts of different sizes; [`ImageError::Layer`] where no layer has that
    /// name, or, without one, where none or several come into question.
    pub fn read(path: &Path, layer: Option<&str>) -> Result<Self, ImageError> {
        let bytes = std::fs::read(path).map_err(ImageError::read(path))?;
        check(&bytes).map_err(ImageError::decode(path))?;
        Self::choose(path, &exr::decode_layers(path, Cursor::new(bytes))?, layer)
    }

    /// The picture among the channels of a file: the layer of this name, or [`layer::main`]'s choice; `path` only names it in errors.
    ///
    /// # Errors
    /// [`ImageError::Layer`] as for [`read`](Self::read), [`ImageError::Decode`] for a channel of another length.
    pub fn choose(path: &Path, layers: &Layers, wanted: Option<&str>) -> Result<Self, ImageError> {
        let chosen = match wanted {
            Some(name) => layer::named(layers, name),
            None => layer::main(layers),
        };
        let Some(chosen) = chosen else {
            return Err(ImageError::Layer { path: path.to_path_buf(), reason: refusal(layers, wanted) });
        };
        let (width, height) = (layers.width, layers.height);
        let cut = || ImageError::decode(path)("a channel is cut short".to_owned());
        let rgb = Grid::from_rows(width, height, chosen.pixels()).ok_or_else(cut)?;
        // The variance of the picture itself, in the view that was chosen.
        let variance = match chosen.name {
            "" => layers.channel(Measured::VARIANCE_CHANNEL),
            view if layers.views.iter().any(|known| known == view) => {
                layers.channel(&views::insert(view, Measured::VARIANCE_CHANNEL))
            }
            _ => None,
        };
        let measured = variance.map(|variance| Measured {
            width,
            height,
            mean: rgb.pixels().iter().map(|&rgb| luminance(rgb)).collect(),
            variance: variance.iter().map(|&v| f64::from(v)).collect(),
        });
        let measured = measured.ok_or_else(|| channels(layers, chosen.name));
        Ok(Self { path: path.to_path_buf(), layer: chosen.name.to_owned(), rgb, measured })
    }

    /// Luminance and variance of every pixel.
    ///
    /// # Errors
    /// [`ImageError::Channel`] where the file has no [`Measured::VARIANCE_CHANNEL`], or the layer a name that is not a view's: the variance is
    /// that of the layer without.
    pub fn measured(&self) -> Result<&Measured, ImageError> {
        self.measured.as_ref().map_err(|found| ImageError::Channel {
            path: self.path.clone(),
            channel: Measured::VARIANCE_CHANNEL.to_owned(),
            found: found.clone(),
        })
    }

    /// Number of pixels with a channel that is not finite.
    pub fn not_finite(&self) -> usize {
        self.rgb.pixels().iter().filter(|rgb| !is_finite(**rgb)).count()
    }
}

/// Rejects unsupported files before anything is allocated according to their headers.
fn check(bytes: &[u8]) -> Result<(), String> {
    if !bytes.starts_with(&MAGIC) {
        return Err("it is not an OpenEXR file".to_owned());
    }
    // The version field follows: 32 bits, little endian.
    if bytes.get(5).is_some_and(|flags| flags & HAS_DEEP_DATA != 0) {
        return Err("deep pixels are not read: flatten it".to_owned());
    }
    exr::check_size(bytes, MOST_PIXELS).map(|_| ())
}

/// Explains why no layer was chosen, and lists the existing ones.
fn refusal(layers: &Layers, wanted: Option<&str>) -> String {
    let quoted = |name: &str| {
        if name.is_empty() { "the one without a name".to_owned() } else { format!("“{name}”") }
    };
    let names: Vec<String> = layer::all(layers).iter().map(|layer| quoted(layer.name)).collect();
    if names.is_empty() {
        return format!("no layer has R, G, B, nor Y alone; its channels are {}", channels(layers, ""));
    }
    let names = names.join(", ");
    let views = match &layers.views[..] {
        [] => String::new(),
        views => format!(" (of the views {}, the first of which has no name here)", views.join(", ")),
    };
    match wanted {
        Some(name) => format!("it has no layer {}; its layers are {names}{views}", quoted(name)),
        None => format!("its layers are {names}{views}"),
    }
}

/// Names of the channels of a layer, or of all layers.
fn channels(layers: &Layers, layer: &str) -> String {
    let names = layers.channels.iter().map(|(name, _)| name.as_str());
    names.filter(|name| name.starts_with(layer)).collect::<Vec<_>>().join(", ")
}
