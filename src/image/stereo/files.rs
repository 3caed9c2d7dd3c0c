//! Files of stereo pictures: pairs of PNG files by their names, and JPEG files of both eyes.
//!
//! JPEG values are read as sRGB, so the display's values are converted; pictures of wider primaries are refused.

use std::path::{Path, PathBuf};

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

use super::{DisplayCoding, Eye, StereoError, StereoLayout, compose};
use crate::image::Grid;
use crate::image::error::ImageError;
use crate::image::write::{self, FileFormat};

/// Encoded R, G, B `[height][width]`, rows from the top.
type Encoded = Grid<[u8; 3]>;

/// JPEG quality of 100; chroma is kept at full resolution, or the eyes would see each other's colours at edges.
const QUALITY: u8 = 95;

/// Formats that a stereo picture can be written in, told by the end of the name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StereoFormat {
    /// OpenEXR or PNG.
    Plain(FileFormat),
    /// One JPEG of both eyes, cross-eyed.
    Jps,
    /// Two JPEGs in one file.
    Mpo,
}

impl StereoFormat {
    /// The format that a name asks for, by its end in any case; other names are refused by [`ImageError::Encode`].
    pub fn of(path: &Path) -> Result<Self, ImageError> {
        let extension = path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
        match extension.as_deref() {
            Some("jps") => Ok(Self::Jps),
            Some("mpo") => Ok(Self::Mpo),
            _ => FileFormat::of(path).map(Self::Plain).map_err(|_| {
                refuse(path, "the name of a stereo picture must end in .exr, .png, .jps or .mpo".to_owned())
            }),
        }
    }
}

/// The names of a pair of files, of the left eye and the right: `NAME_left.png` and `NAME_right.png` of `NAME.png`.
pub fn pair_paths(path: &Path) -> [PathBuf; 2] {
    let stem = path.file_stem().unwrap_or_default();
    Eye::BOTH.map(|eye| {
        let mut name = stem.to_owned();
        name.push("_");
        name.push(eye.name());
        if let Some(extension) = path.extension() {
            name.push(".");
            name.push(extension);
        }
        path.with_file_name(name)
    })
}

/// Writes a JPS file: a JPEG of both eyes side by side, the right one at the left, with VRex's descriptor in an APP3 segment.
///
/// # Errors
///
/// [`ImageError::Encode`] for pictures of different sizes, pictures that JPEG cannot hold (65535 pixels along a side, both eyes together),
/// and primaries other than those of sRGB; [`ImageError::Write`] where the system refuses.
pub fn write_jps(path: &Path, eyes: [&Encoded; 2], coding: &DisplayCoding) -> Result<(), ImageError> {
    let composed = compose(eyes, StereoLayout::CrossEyed, coding).map_err(|e| refuse(path, e.to_string()))?;
    // The name; the length of what follows; separation 0, flags without “left field first”, layout 2 (side by side), type 1 (stereo);
    // a comment of no bytes.
    let descriptor = [&b"_JPSJPS_"[..], &[0, 4], &[0, 0, 2, 1], &[0, 0]].concat();
    write::atomically(path, &encode(path, &composed, coding, (3, descriptor))?)
}

/// Writes an MPO file (CIPA DC-007-2009): a JPEG of the left eye, followed by one of the right. An APP2 segment of the first tells where both
/// are, and that they are of the type “multi-frame disparity”; one in each tells the viewpoint. The length of the base line is
/// given as unknown, since it is not in metres.
///
/// # Errors
///
/// As [`write_jps`], each eye by itself.
pub fn write_mpo(path: &Path, eyes: [&Encoded; 2], coding: &DisplayCoding) -> Result<(), ImageError> {
    let [left, right] = eyes.map(|eye| [eye.width(), eye.height()]);
    if left != right {
        return Err(refuse(path, StereoError::Size { left, right }.to_string()));
    }
    let jpeg = |eye: Eye, index: Option<[u32; 3]>| {
        encode(path, eyes[eye as usize], coding, (2, multi_picture_segment(eye, index)))
    };
    let second = jpeg(Eye::Right, None)?;
    // The index has the same length whatever it says, so that a first attempt tells where it is.
    let mut first = jpeg(Eye::Left, Some([0; 3]))?;
    let header = first.windows(4).position(|bytes| bytes == MPF).unwrap_or_default() + MPF.len();
    let number =
        |n: usize| u32::try_from(n).map_err(|_| refuse(path, "its JPEGs have more than 4 GB".to_owned()));
    let index = [number(first.len())?, number(second.len())?, number(first.len() - header)?];
    let segment = multi_picture_segment(Eye::Left, Some(index));
    first[header - MPF.len()..][..segment.len()].copy_from_slice(&segment);
    first.extend(second);
    write::atomically(path, &first)
}

fn refuse(path: &Path, reason: String) -> ImageError {
    ImageError::Encode { path: path.to_path_buf(), reason }
}

/// A JPEG in sRGB with an application segment: its number and its bytes.
fn encode(
    path: &Path,
    picture: &Encoded,
    coding: &DisplayCoding,
    (number, segment): (u8, Vec<u8>),
) -> Result<Vec<u8>, ImageError> {
    if !coding.is_rec709() {
        let reason = "JPEG values are read as sRGB, and this picture has wider primaries: \
                      render with --profile srgb, or to a .png or .exr file";
        return Err(refuse(path, reason.to_owned()));
    }
    let (width, height) = (picture.width(), picture.height());
    let [w, h] = [width, height].map(|side| u16::try_from(side).ok());
    let (w, h) = w.zip(h).ok_or_else(|| {
        refuse(path, format!("{width}×{height} pixels are more than the 65535 that JPEG has along a side"))
    })?;
    let srgb = DisplayCoding::srgb();
    let values: Vec<[u8; 3]> = picture.pixels().iter().map(|rgb| srgb.encode(coding.decode(*rgb))).collect();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::F_1_1);
    let encoded = encoder
        .add_app_segment(number, segment)
        .and_then(|()| encoder.encode(values.as_flattened(), w, h, ColorType::Rgb));
    encoded.map_err(|e| refuse(path, e.to_string()))?;
    Ok(bytes)
}

/// The name of segments of the multi-picture format.
const MPF: &[u8] = b"MPF\0";

/// Byte order (little endian), and the offset of the first directory; offsets count from here (DC-007, 5.2.2).
const MP_HEADER: &[u8] = b"II\x2a\0\x08\0\0\0";

/// Types of directory entries (TIFF 6.0).
const LONG: u16 = 4;
const RATIONAL: u16 = 5;
const UNDEFINED: u16 = 7;
const SIGNED_RATIONAL: u16 = 10;

/// A directory entry: tag, type, number of values, and the values.
type Entry = (u16, u16, u32, Vec<u8>);

/// The APP2 segment of one eye's JPEG. Of the first it has an index: the sizes of both, and the offset of the second from the header.
fn multi_picture_segment(eye: Eye, index: Option<[u32; 3]>) -> Vec<u8> {
    let long = |n: u32| n.to_le_bytes().to_vec();
    let version: Entry = (0xb000, UNDEFINED, 4, b"0100".to_vec());
    // DC-007, tables 3 and 5: the first image is the representative one; its offset is 0.
    let list = index.map(|[first, second, offset]| {
        let [attribute, representative] = [0x0002_0002, 1 << 29];
        let images =
            [attribute | representative, first, 0, 0, attribute, second, offset, 0].map(u32::to_le_bytes);
        let entries = vec![
            version.clone(),
            (0xb001, LONG, 1, long(2)),
            (0xb002, UNDEFINED, 32, images.as_flattened().to_vec()),
        ];
        directory(MP_HEADER.len(), entries, true)
    });
    // DC-007, table 8: the number of this image, which counts viewpoints from the left; the base viewpoint; the angle of its axis to that
    // of the base, 0 because the axes of both eyes are parallel; the length of the base line.
    let mut viewpoint: Vec<Entry> = vec![
        (0xb101, LONG, 1, long(eye as u32 + 1)),
        (0xb204, LONG, 1, long(1)),
        (0xb205, SIGNED_RATIONAL, 1, [long(0), long(1)].concat()),
        (0xb206, RATIONAL, 1, [long(u32::MAX), long(u32::MAX)].concat()),
    ];
    if list.is_none() {
        viewpoint.insert(0, version);
    }
    let list = list.unwrap_or_default();
    let viewpoint = directory(MP_HEADER.len() + list.len(), viewpoint, false);
    [MPF, MP_HEADER, &list, &viewpoint].concat()
}

/// A directory (TIFF 6.0, section 2) that begins `at` bytes after the header, with the values that are longer than four bytes behind it; `more`
/// if another one follows.
fn directory(at: usize, entries: Vec<Entry>, more: bool) -> Vec<u8> {
    let long = |n: usize| (n as u32).to_le_bytes();
    let fixed = 2 + 12 * entries.len() + 4;
    let mut table = (entries.len() as u16).to_le_bytes().to_vec();
    let mut values = Vec::new();
    for (tag, kind, count, mut value) in entries {
        table.extend(tag.to_le_bytes());
        table.extend(kind.to_le_bytes());
        table.extend(count.to_le_bytes());
        if value.len() > 4 {
            table.extend(long(at + fixed + values.len()));
            values.extend(value);
        } else {
            value.resize(4, 0);
            table.extend(value);
        }
    }
    table.extend(long(if more { at + fixed + values.len() } else { 0 }));
    table.extend(values);
    table
}
