//! OpenEXR files: one part, layers by the channels' dotted names, lossless ZIP; or lossless PIZ with half floats where those are exact, which
//! is smaller for noise ([`write_small`]).
//!
//! One part rather than one per layer, because more programs support it; `R`, `G`, `B` have no layer name and are what viewers show. The
//! same picture yields the same bytes: the library keeps attributes in a hash map, so they are sorted after writing.
//!
//! Several views, as those of both eyes, are one part each with the attribute `view`: so the OpenEXR project recommends it, channels keep
//! their names, and each view has attributes of its own. The older form, one part with the attribute `multiView`, is read as well.
//! In memory both are one set of channels, named as in the older form ([`Layers::views`]).

use std::io::{BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::Chromaticities;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Compression, Encoding, FlatSamples, Image, ImageAttributes,
    IntegerBounds, Layer, LayerAttributes, ReadChannels, ReadLayers, Text, Vec2, WritableImage,
};
use glam::DVec2;
use half::f16;

use crate::image::error::ImageError;
use crate::image::{Attribute, colors, views, write};

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
    /// Names of the views, the default one first; empty where the file does not speak of views. Channels of others have their view's name before
    /// the last part of their own (`right.R`, `camera.right.X`), and attributes that differ from the default view's before it
    /// (`right.cameraPaths`).
    pub views: Vec<String>,
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

    /// The pictures of several views as one; the first is the default view.
    ///
    /// # Errors
    ///
    /// A sentence, for no views, views of different sizes, and names that OpenEXR does not permit: doubled, empty, or with a dot or a blank.
    pub fn of_views(pictures: Vec<(&str, Self)>) -> Result<Self, String> {
        let mut all =
            Self { views: pictures.iter().map(|(name, _)| (*name).to_owned()).collect(), ..Self::default() };
        for (i, name) in all.views.iter().enumerate() {
            if name.is_empty() || name.contains(['.', ' ']) || all.views[..i].contains(name) {
                return Err(format!("“{name}” cannot be the name of a view, or is that of two"));
            }
        }
        for (i, (view, picture)) in pictures.into_iter().enumerate() {
            if i == 0 {
                (all.width, all.height) = (picture.width, picture.height);
            } else if (all.width, all.height) != (picture.width, picture.height) {
                return Err(format!(
                    "its views are of {}×{} and {}×{} pixels",
                    all.width, all.height, picture.width, picture.height
                ));
            }
            for (name, values) in picture.channels {
                all.channels.push((all.outer_name(view, &name), values));
            }
            all.add_attributes(view, picture.attributes);
        }
        if all.views.is_empty() { Err("it has no views".to_owned()) } else { Ok(all) }
    }

    /// The name of a view's channel among those of all views.
    fn outer_name(&self, view: &str, channel: &str) -> String {
        if self.is_default(view) { channel.to_owned() } else { views::insert(view, channel) }
    }

    fn is_default(&self, view: &str) -> bool {
        self.views.first().is_some_and(|first| first == view)
    }

    /// Adds a view's attributes: of other views than the default one those that differ from its, with the view's name before theirs.
    fn add_attributes(&mut self, view: &str, attributes: Vec<(String, Attribute)>) {
        for (name, value) in attributes {
            if self.is_default(view) {
                self.attributes.push((name, value));
            } else if self.attribute(&name) != Some(&value) {
                self.attributes.push((format!("{view}.{name}"), value));
            }
        }
    }

    /// The attributes of a view by their own names.
    fn attributes_of(&self, view: &str) -> Vec<(String, Attribute)> {
        let is_view = |name: &str| self.views.iter().any(|known| known == name);
        let mut found: Vec<(String, Attribute)> = Vec::new();
        for (name, value) in &self.attributes {
            match name.split_once('.').filter(|(before, _)| is_view(before)) {
                None => found.push((name.clone(), value.clone())),
                Some((of, name)) if of == view => {
                    found.retain(|(shared, _)| shared != name);
                    found.push((name.to_owned(), value.clone()));
                }
                Some(_) => {}
            }
        }
        found
    }

    /// The picture of one view by itself, its channels without its name; `None` for a view that it does not have.
    pub fn view(&self, name: &str) -> Option<Self> {
        self.views.iter().find(|view| *view == name)?;
        let of_view = self.channels_of(name).map(|(channel, values)| (channel, values.to_vec()));
        Some(Self {
            channels: of_view.collect(),
            attributes: self.attributes_of(name),
            views: Vec::new(),
            ..*self
        })
    }

    /// Channels of a view by their own names.
    fn channels_of<'a>(&'a self, view: &'a str) -> impl Iterator<Item = (String, &'a [f32])> {
        self.channels.iter().filter_map(move |(name, values)| {
            let of = views::told(&self.views, name);
            let is_its = of.map_or(self.is_default(view), |of| of == view);
            is_its.then(|| (views::remove(view, name), values.as_slice()))
        })
    }

    /// The value of an attribute.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|(n, _)| n == name).map(|(_, v)| v)
    }
}

/// Writes a picture, with views as one part each; the name holds the old file or the whole new one. Refused by [`ImageError::Encode`] are
/// channels of the wrong length, doubled or empty names, and names of over 255 bytes.
pub fn write(path: &Path, layers: &Layers) -> Result<(), ImageError> {
    write::atomically(path, &encode(path, layers, Packing::Usual)?)
}

/// Writes the same values as [`write()`], smaller where they are noise that was rounded: the samples of channels that half floats hold exactly
/// are half floats, and all are compressed by PIZ.
///
/// # Errors
/// Those of [`write()`].
pub fn write_small(path: &Path, layers: &Layers) -> Result<(), ImageError> {
    write::atomically(path, &encode(path, layers, Packing::Small)?)
}

/// How samples are stored, without loss.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Packing {
    /// Single-precision floats, ZIP of 16 scan lines each.
    Usual,
    /// Half floats where these are exact, PIZ: a wavelet transform and Huffman codes, of 32 scan lines each.
    Small,
}

impl Packing {
    fn samples(self, values: &[f32]) -> FlatSamples {
        let is_half = |v: &f32| f16::from_f32(*v).to_f32().to_bits() == v.to_bits();
        match self == Self::Small && values.iter().all(is_half) {
            true => FlatSamples::F16(values.iter().map(|v| f16::from_f32(*v)).collect()),
            false => FlatSamples::F32(values.to_vec()),
        }
    }

    /// Scan lines in increasing order.
    fn encoding(self) -> Encoding {
        match self {
            Self::Usual => Encoding::SMALL_LOSSLESS,
            Self::Small => Encoding { compression: Compression::PIZ, ..Encoding::SMALL_LOSSLESS },
        }
    }
}

/// The bytes of the file; `path` only names it in errors.
fn encode(path: &Path, layers: &Layers, packing: Packing) -> Result<Vec<u8>, ImageError> {
    let refuse = |reason: String| ImageError::Encode { path: path.to_path_buf(), reason };
    let size = Vec2(layers.width, layers.height);
    let parts = match &layers.views[..] {
        [] => {
            let channels = layers.channels.iter().map(|(name, values)| (name.clone(), values.as_slice()));
            vec![part(size, channels, &layers.attributes, None, packing).map_err(refuse)?]
        }
        views => views
            .iter()
            .map(|view| {
                part(size, layers.channels_of(view), &layers.attributes_of(view), Some(view), packing)
            })
            .collect::<Result<_, _>>()
            .map_err(refuse)?,
    };
    let mut shared = ImageAttributes::new(IntegerBounds::from_dimensions(size));
    let [red, green, blue, white] = colors::REC_709.map(|xy| Vec2(xy.x as f32, xy.y as f32));
    shared.chromaticities = Some(Chromaticities { red, green, blue, white });
    let mut bytes = Cursor::new(Vec::new());
    let image = Image::from_layers(shared, parts);
    image.write().to_buffered(&mut bytes).map_err(|e| refuse(e.to_string()))?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes).ok_or_else(|| refuse("its header is not as expected".to_owned()))?;
    Ok(bytes)
}

/// A part of a file, with the name of its view if it is one of several.
fn part<'a>(
    size: Vec2<usize>,
    given: impl Iterator<Item = (String, &'a [f32])>,
    attributes: &[(String, Attribute)],
    view: Option<&String>,
    packing: Packing,
) -> Result<Layer<AnyChannels<FlatSamples>>, String> {
    let mut channels = Vec::new();
    for (name, values) in given {
        if values.len() != size.0 * size.1 || name.is_empty() {
            return Err(format!(
                "channel “{name}” has {} values for {}×{} pixels",
                values.len(),
                size.0,
                size.1
            ));
        }
        channels.push(AnyChannel::new(text(&name), packing.samples(values)));
    }
    // The name of a part says nothing to readers, but each must have another one.
    let name = view.map(|view| text(view));
    let mut own = LayerAttributes { layer_name: name.clone(), view_name: name, ..LayerAttributes::default() };
    for (name, value) in attributes {
        let value = match value {
            Attribute::Text(value) => AttributeValue::Text(text(value)),
            Attribute::Number(value) => AttributeValue::F64(*value),
            Attribute::Bytes(value) => {
                AttributeValue::Bytes { type_hint: Text::default(), bytes: value.clone().into() }
            }
        };
        if own.other.insert(text(name), value).is_some() {
            return Err(format!("attribute “{name}” is given twice"));
        }
    }
    Ok(Layer::new(size, own, packing.encoding(), AnyChannels::sort(channels.into())))
}

/// OpenEXR strings are bytes; UTF-8 is what current programs expect.
fn text(s: &str) -> Text {
    Text::from_slice_unchecked(s.as_bytes())
}

/// The bit of the version's second byte that says that the file has several parts.
const SEVERAL_PARTS: u8 = 1 << 4;

/// Sorts the attributes of each part by name, in place; `None` if a header is not one.
///
/// Layout: magic and version, 4 bytes each; for each part `name\0 type\0 size:i32 value` each, then `\0`; after several parts another `\0`.
fn sort_attributes(file: &mut [u8]) -> Option<()> {
    let several = file.get(5)? & SEVERAL_PARTS != 0;
    let mut at = 8;
    loop {
        let first = at;
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
        file.get_mut(first..at)?.copy_from_slice(&attributes.concat());
        at += 1;
        if !several || *file.get(at)? == 0 {
            return Some(());
        }
    }
}

/// Upper bound on pixel bytes per file byte: zlib compresses at most 1032 to 1, and PXR24 drops a quarter before.
const LARGEST_RATIO: u64 = 2000;

/// Reads all channels and attributes of a file; of several parts those of every part, named by its view ([`Layers::views`]) or, where it has
/// none, with the part's name before the channel's. Refused by [`ImageError::Decode`] is anything that is no flat EXR file or whose parts differ in size.
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
    let mut layers = Layers { chromaticities, views: views_of(&image.layer_data), ..Layers::default() };
    let several = image.layer_data.len() > 1;
    for (i, layer) in image.layer_data.iter().enumerate() {
        if i == 0 {
            (layers.width, layers.height) = (layer.size.0, layer.size.1);
        } else if (layers.width, layers.height) != (layer.size.0, layer.size.1) {
            return Err(refuse("its parts differ in size".to_owned()));
        }
        let view = layer.attributes.view_name.as_ref().filter(|_| several).map(decode);
        let part = layer.attributes.layer_name.as_ref().map(|n| format!("{n}.")).unwrap_or_default();
        for channel in &layer.channel_data.list {
            let name = decode(&channel.name);
            let name = match (&view, views::told(&layers.views, &name)) {
                (Some(view), _) => layers.outer_name(view, &name),
                (None, Some(told)) if layers.is_default(told) => views::remove(told, &name),
                (None, _) => format!("{part}{name}"),
            };
            layers.push(&name, channel.sample_data.values_as_f32());
        }
        let attributes = layer.attributes.other.iter().filter_map(|(name, value)| {
            let value = match value {
                AttributeValue::Text(t) => Attribute::Text(decode(t)),
                AttributeValue::F64(x) => Attribute::Number(*x),
                AttributeValue::F32(x) => Attribute::Number(f64::from(*x)),
                AttributeValue::I32(x) => Attribute::Number(f64::from(*x)),
                AttributeValue::Bytes { bytes, .. } => Attribute::Bytes(bytes.to_vec()),
                _ => return None,
            };
            Some((decode(name), value))
        });
        match view {
            Some(view) => layers.add_attributes(&view, attributes.collect()),
            None => layers.attributes.extend(attributes),
        }
    }
    layers.attributes.sort_by(|a, b| a.0.cmp(&b.0));
    Ok(layers)
}

/// The names of the views that the parts of a file are of, or that its only part lists.
fn views_of(parts: &[Layer<AnyChannels<FlatSamples>>]) -> Vec<String> {
    let mut views: Vec<String> = Vec::new();
    let listed = match parts {
        [only] => only.attributes.multi_view_names.iter().flatten().collect::<Vec<_>>(),
        parts => parts.iter().filter_map(|part| part.attributes.view_name.as_ref()).collect(),
    };
    for view in listed.into_iter().map(decode) {
        if !views.contains(&view) {
            views.push(view);
        }
    }
    views
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
