//! OpenEXR files: one part, layers by the channels' dotted names, lossless ZIP.
//!
//! One part rather than one per layer, because more programs support it; `R`, `G`, `B` have no layer name and are what viewers show. The
//! same picture yields the same bytes: the library keeps attributes in a hash map, so they are sorted after writing.

use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::Chromaticities;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds,
    Layer, LayerAttributes, ReadChannels, ReadLayers, Text, Vec2, WritableImage,
};
use glam::DVec2;

use crate::image::error::ImageError;
use crate::image::{Attribute, colors, write};

/// A channel: its full name, and its values `[height][width]`.
pub type Channel = (String, Vec<f32>);

/// Named channels, `[height][width]` each, with the file's attributes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Name (`R`, `camera.X`) and values of every channel.
    pub channels: Vec<Channel>,
    /// Name and value of every attribute.
    pub attributes: Vec<(String, Attribute)>,
    /// Primaries and white point of a file that was read, if they differ from those of Rec.709, which are always written.
    pub chromaticities: Option<colors::Chromaticities>,
}

impl Layers {
    /// Adds one channel of `width · height` values.
    pub fn push(&mut self, name: &str, values: impl IntoIterator<Item = f32>) {
        self.channels.push((name.to_owned(), values.into_iter().collect()));
    }

    /// The values of a channel.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(n, _)| n == name).map(|(_, v)| v.as_slice())
    }

    /// The value of an attribute.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, v)| v)
    }
}

/// Writes a picture; the name holds the old file or the whole new one. Refused by [`ImageError::Encode`] are channels of the wrong
/// length, doubled or empty names, and names of over 255 bytes.
pub fn write(path: &Path, layers: &Layers) -> Result<(), ImageError> {
    write::atomically(path, &encode(path, layers)?)
}

/// The bytes of the file; `path` only names it in errors.
fn encode(path: &Path, layers: &Layers) -> Result<Vec<u8>, ImageError> {
    let refuse = |reason: String| ImageError::Encode { path: path.to_path_buf(), reason };
    let mut channels = Vec::new();
    for (name, values) in &layers.channels {
        if values.len() != layers.width * layers.height || name.is_empty() {
            let (n, w, h) = (values.len(), layers.width, layers.height);
            return Err(refuse(format!("channel “{name}” has {n} values for {w}×{h} pixels")));
        }
        channels.push(AnyChannel::new(text(name), FlatSamples::F32(values.clone())));
    }
    let size = Vec2(layers.width, layers.height);
    let mut own = LayerAttributes::default();
    for (name, value) in &layers.attributes {
        let value = match value {
            Attribute::Text(value) => AttributeValue::Text(text(value)),
            Attribute::Number(value) => AttributeValue::F64(*value),
        };
        if own.other.insert(text(name), value).is_some() {
            return Err(refuse(format!("attribute “{name}” is given twice")));
        }
    }
    let mut shared = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    let [red, green, blue, white] = colors::REC_709.map(|xy| Vec2(xy.x as f32, xy.y as f32));
    shared.chromaticities = Some(Chromaticities { red, green, blue, white });
    // ZIP of 16 scan lines each, in increasing order.
    let layer = Layer::new(size, own, Encoding::SMALL_LOSSLESS, AnyChannels::sort(channels.into()));
    let mut bytes = Cursor::new(Vec::new());
    let image = Image::empty(shared).with_layer(layer);
    image.write().to_buffered(&mut bytes).map_err(|e| refuse(e.to_string()))?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes).ok_or_else(|| refuse("its header is not as expected".to_owned()))?;
    Ok(bytes)
}

/// OpenEXR strings are bytes; UTF-8 is what current programs expect.
fn text(s: &str) -> Text {
    Text::from_slice_unchecked(s.as_bytes())
}

/// Sorts the attributes of a one-part file by name, in place; `None` if the header is not one.
///
/// Layout: magic and version, 4 bytes each; then `name\0 type\0 size:i32 value` each; then `\0`.
fn sort_attributes(file: &mut [u8]) -> Option<()> {
    let mut at = 8;
    let mut attributes: Vec<Vec<u8>> = Vec::new();
    while *file.get(at)? != 0 {
        let start = at;
        for _ in 0..2 {
            at += file.get(at..)?.iter().position(|&b| b == 0)? + 1;
        }
        let size = i32::from_le_bytes(file.get(at..at + 4)?.try_into().ok()?);
        at += 4 + usize::try_from(size).ok()?;
        attributes.push(file.get(start..at)?.to_vec());
    }
    attributes.sort();
    file.get_mut(8..at)?.copy_from_slice(&attributes.concat());
    Some(())
}

/// Upper bound on pixel bytes per file byte: zlib compresses at most 1032 to 1, and PXR24 drops a quarter before.
const LARGEST_RATIO: u64 = 2000;

/// Reads all channels and attributes of a file; of several parts those of every part, with the part's name before the channel's.
/// Refused by [`ImageError::Decode`] is anything that is no flat EXR file or whose parts differ in size.
pub fn read(path: &Path) -> Result<Layers, ImageError> {
    let file = std::fs::File::open(path).map_err(ImageError::read(path))?;
    decode_layers(path, BufReader::new(file))
}

/// Rejects a file whose headers promise more pixels than its bytes can hold, because the decoder allocates accordingly. Rewinds the file.
fn check_ratio(file: &mut (impl Read + Seek)) -> Result<(), String> {
    let length = file.seek(SeekFrom::End(0)).map_err(|e| e.to_string())?;
    file.rewind().map_err(|e| e.to_string())?;
    let meta = MetaData::read_from_buffered(&mut *file, false).map_err(|e| e.to_string())?;
    file.rewind().map_err(|e| e.to_string())?;
    let bytes = promised(&meta);
    match bytes > length.saturating_mul(LARGEST_RATIO) {
        true => Err(format!("its header promises {bytes} bytes of pixels, which {length} bytes cannot hold")),
        false => Ok(()),
    }
}

/// Reads the bytes of a file as [`read`] does; `path` only names it in errors.
pub(super) fn decode_layers(path: &Path, mut file: impl Read + Seek) -> Result<Layers, ImageError> {
    let refuse = ImageError::decode(path);
    check_ratio(&mut file).map_err(refuse)?;
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(file)
        .map_err(|e| refuse(e.to_string()))?;
    let xy = |Vec2(x, y): Vec2<f32>| DVec2::new(x.into(), y.into());
    let given = image.attributes.chromaticities;
    let chromaticities = given
        .map(|Chromaticities { red, green, blue, white }| [red, green, blue, white].map(xy))
        .filter(|given| !colors::are_rec709(given));
    let mut layers = Layers { chromaticities, ..Layers::default() };
    for (i, layer) in image.layer_data.iter().enumerate() {
        if i == 0 {
            (layers.width, layers.height) = (layer.size.0, layer.size.1);
        } else if (layers.width, layers.height) != (layer.size.0, layer.size.1) {
            return Err(refuse("its parts differ in size".to_owned()));
        }
        let part = layer.attributes.layer_name.as_ref().map(|n| format!("{n}.")).unwrap_or_default();
        for channel in &layer.channel_data.list {
            layers.push(&format!("{part}{}", channel.name), channel.sample_data.values_as_f32());
        }
        for (name, value) in &layer.attributes.other {
            let value = match value {
                AttributeValue::Text(t) => Attribute::Text(decode(t)),
                AttributeValue::F64(x) => Attribute::Number(*x),
                AttributeValue::F32(x) => Attribute::Number(f64::from(*x)),
                AttributeValue::I32(x) => Attribute::Number(f64::from(*x)),
                _ => continue,
            };
            layers.attributes.push((decode(name), value));
        }
    }
    layers.attributes.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(layers)
}

fn decode(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// Checks the size in the header against `most` pixels, before anything of that size is allocated; returns the bytes of all channels.
pub(super) fn check_size(bytes: &[u8], most: usize) -> Result<u64, String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|e| e.to_string())?;
    for header in &meta.headers {
        check_pixels(header.layer_size.0, header.layer_size.1, most)?;
    }
    Ok(promised(&meta))
}

/// A picture may exceed [`INFLATED_FREE`] bytes only up to this multiple of its file's size: more than real pictures compress to, and less
/// than a decompression bomb.
const INFLATION: u64 = 100;

/// Pixel bytes allowed for any file size: 8192 × 8192 in one colour.
const INFLATED_FREE: u64 = 192 << 20;

/// Rejects a file whose `pixels` bytes are implausible for its size.
pub(super) fn check_inflation(pixels: u64, file: usize) -> Result<(), String> {
    match pixels > INFLATED_FREE.max((file as u64).saturating_mul(INFLATION)) {
        true => Err(format!(
            "its header promises {pixels} bytes of pixels, more than {INFLATION} times its {file} bytes"
        )),
        false => Ok(()),
    }
}

/// Pixel bytes according to the headers.
fn promised(meta: &MetaData) -> u64 {
    meta.headers.iter().fold(0, |sum, header| {
        let pixels = header.layer_size.0 as u64 * header.layer_size.1 as u64;
        sum.saturating_add(pixels.saturating_mul(header.channels.bytes_per_pixel as u64))
    })
}

/// Rejects empty pictures and those of more than `most` pixels.
pub(super) fn check_pixels(width: usize, height: usize, most: usize) -> Result<(), String> {
    match width.checked_mul(height) {
        Some(0) => Err("it has no pixels".to_owned()),
        Some(n) if n <= most => Ok(()),
        _ => Err(format!("{width}×{height} pixels are more than {most}")),
    }
}

/// The error for a missing channel.
pub(super) fn no_channel(path: &Path, layers: &Layers, name: &str) -> ImageError {
    ImageError::Channel {
        path: path.to_path_buf(),
        channel: name.to_owned(),
        found: layers.channels.iter().map(|(n, _)| n.as_str()).collect::<Vec<_>>().join(", "),
    }
}
