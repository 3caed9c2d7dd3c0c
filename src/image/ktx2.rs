//! KTX2 (Khronos Texture 2.0): the largest level of a picture in BasisU (ETC1S, UASTC, UASTC HDR 4 × 4) or of plain numbers.
//!
//! Header, lengths and data format descriptor are validated here, so that they bound the memory of the decoders. Zstandard and zlib are
//! decompressed to exactly the bytes of the texels.

use std::io::Read;

use basisu::{DecodeFlags, TargetFormat, Transcoder};
use half::f16;

use super::exr::{check_inflation, check_pixels};

/// Signature of KTX2 files.
pub(super) const SIGNATURE: &[u8] = b"\xabKTX 20\xbb\r\n\x1a\n";

/// Bytes of the header; the level index follows.
const HEADER: usize = 80;

/// Decoded texels, row-major from the top.
pub(super) struct Ktx2Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) texels: Ktx2Texels,
    /// Whether integers are sRGB-encoded, according to the data format descriptor.
    pub(super) is_srgb: bool,
    /// Colour metadata of the file that is not used.
    pub(super) remarks: Vec<String>,
}

/// R, G, B, A of each texel.
pub(super) enum Ktx2Texels {
    Eight(Vec<[u8; 4]>),
    Sixteen(Vec<[u16; 4]>),
    Float(Vec<[f32; 4]>),
}

/// Storage format of a level.
#[derive(Clone, Copy, PartialEq)]
enum Ktx2Format {
    /// ETC1S behind BasisLZ.
    Etc1s,
    /// Blocks of 4 × 4 texels, 16 bytes each.
    Uastc,
    UastcHdr,
    /// Uncompressed numbers per texel; blue before red if `bgr`.
    Plain {
        channels: usize,
        number: NumberFormat,
        bgr: bool,
    },
}

#[derive(Clone, Copy, PartialEq)]
enum NumberFormat {
    Byte,
    Short,
    Half,
    Float,
}

/// Header fields that determine how the largest level is decoded.
struct Ktx2Header<'a> {
    width: usize,
    height: usize,
    format: Ktx2Format,
    /// Supercompression: 0 none, 1 BasisLZ, 2 Zstandard, 3 zlib.
    packing: u32,
    level: &'a [u8],
    transfer: u8,
    primaries: u8,
    premultiplied: bool,
    /// Value of `KTXorientation`, if present: `r` or `l`, then `d` or `u`.
    orientation: &'a [u8],
    /// `KTXswizzle`.
    swizzle: &'a [u8],
}

fn short(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes)
}

fn long(bytes: &[u8], at: usize) -> Option<usize> {
    usize::try_from(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?)).ok()
}

/// A range of the file; an empty one may have any offset.
fn part(bytes: &[u8], offset: usize, length: usize) -> Result<&[u8], String> {
    if length == 0 {
        return Ok(&[]);
    }
    let end = offset.checked_add(length).filter(|_| offset >= HEADER);
    end.and_then(|end| bytes.get(offset..end)).ok_or_else(|| "it is cut short".to_owned())
}

impl<'a> Ktx2Header<'a> {
    /// Parses the header; rejects files that are not a single picture.
    fn read(bytes: &'a [u8], most: usize) -> Result<Self, String> {
        let number = |at: usize| short(bytes, at).ok_or_else(|| "it is cut short".to_owned());
        let format = number(12)?;
        let [width, height, depth, layers, faces, levels, packing] =
            [number(20)?, number(24)?, number(28)?, number(32)?, number(36)?, number(40)?, number(44)?];
        let refused = match (height, depth, layers, faces) {
            (0, ..) => "a picture of one dimension",
            (_, 1.., ..) => "a picture of three dimensions",
            (_, _, 2.., _) => "an array of pictures",
            (_, _, _, 6) => "a cube map",
            _ => "",
        };
        if !refused.is_empty() {
            return Err(format!("it is {refused}: one picture of two dimensions is read"));
        }
        if faces != 1 || levels > 32 {
            return Err(format!("its header says {faces} faces and {levels} levels"));
        }
        let (width, height) = (width as usize, height as usize);
        check_pixels(width, height, most)?;
        let descriptor = part(bytes, number(48)? as usize, number(52)? as usize)?;
        let values = part(bytes, number(56)? as usize, number(60)? as usize)?;
        let long = |at: usize| long(bytes, at).ok_or_else(|| "it is cut short".to_owned());
        part(bytes, long(64)?, long(72)?)?;
        let colors = short(descriptor, 12).ok_or("it has no data format descriptor")?.to_le_bytes();
        let [model, primaries, transfer, flags] = colors;
        // All levels are checked, because the BasisU decoder accesses each.
        for at in (0..levels.max(1) as usize).map(|i| HEADER + 24 * i) {
            part(bytes, long(at)?, long(at + 8)?)?;
        }
        let level = part(bytes, long(HEADER)?, long(HEADER + 8)?)?;
        if value(values, b"KTXanimData").is_some() {
            return Err("it is a video: one picture is read".to_owned());
        }
        let orientation = value(values, b"KTXorientation").unwrap_or(b"rd");
        let swizzle = value(values, b"KTXswizzle").unwrap_or(b"rgba");
        let format = texel_format(format, model)?;
        let premultiplied = flags & 1 != 0;
        let header = Self {
            width,
            height,
            format,
            packing,
            level,
            transfer,
            primaries,
            premultiplied,
            orientation,
            swizzle,
        };
        header.check_packing(long(HEADER + 16)?, bytes.len())?;
        Ok(header)
    }

    /// Bytes of the decompressed texels; `None` for formats without a fixed size.
    fn size(&self) -> Option<usize> {
        match self.format {
            Ktx2Format::Etc1s => None,
            Ktx2Format::Uastc | Ktx2Format::UastcHdr => {
                Some(16 * self.width.div_ceil(4) * self.height.div_ceil(4))
            }
            Ktx2Format::Plain { channels, number, .. } => {
                Some(self.width * self.height * channels * number.size())
            }
        }
    }

    /// Rejects a level of the wrong size. `unpacked`: decompressed size according to the file; `file`: length of the file in bytes.
    fn check_packing(&self, unpacked: usize, file: usize) -> Result<(), String> {
        let fits = match (self.packing, self.size()) {
            (0, Some(size)) => self.level.len() == size,
            (1, None) => true,
            (2, Some(size)) => unpacked == size,
            (3, Some(size)) => unpacked == size && matches!(self.format, Ktx2Format::Plain { .. }),
            _ => false,
        };
        if !fits {
            let [length, packing] = [self.level.len(), self.packing as usize];
            return Err(format!(
                "{length} bytes with the supercompression {packing} are not its {}×{} texels",
                self.width, self.height
            ));
        }
        let texel = if self.format == Ktx2Format::UastcHdr { 8 } else { 4 };
        let promised = self.size().unwrap_or(0).max(texel * self.width * self.height);
        check_inflation(promised as u64, file)
    }

    /// Decompressed texels, as bytes of their format.
    fn unpacked(&self) -> Result<Vec<u8>, String> {
        let size = self.size().unwrap_or(0);
        let mut out = vec![0; size];
        match self.packing {
            2 => {
                let wrong = |e: &dyn std::fmt::Display| format!("its Zstandard data are damaged: {e}");
                let mut reader = ruzstd::StreamingDecoder::new(self.level).map_err(|e| wrong(&e))?;
                reader.read_exact(&mut out).map_err(|e| wrong(&e))?;
            }
            3 => flate2::read::ZlibDecoder::new(self.level)
                .read_exact(&mut out)
                .map_err(|e| format!("its zlib data are damaged: {e}"))?,
            _ => out.copy_from_slice(self.level.get(..size).ok_or("it is cut short")?),
        }
        Ok(out)
    }

    /// Whether integers are sRGB-encoded; other curves are approximated by it.
    fn is_srgb(&self) -> bool {
        self.transfer != LINEAR
    }

    fn remarks(&self) -> Vec<String> {
        let mut remarks = Vec::new();
        if !matches!(self.transfer, 0 | LINEAR | SRGB) {
            remarks.push(format!("transfer function {} of its data format descriptor", self.transfer));
        }
        // 0: unspecified; 1: Rec.709.
        if self.primaries > 1 {
            remarks.push(format!("primaries {} of its data format descriptor", self.primaries));
        }
        if self.premultiplied {
            remarks.push("colours premultiplied by alpha".to_owned());
        }
        remarks
    }
}

/// Transfer functions of data format descriptors.
const LINEAR: u8 = 1;
const SRGB: u8 = 2;

impl NumberFormat {
    /// Size in bytes.
    fn size(self) -> usize {
        match self {
            Self::Byte => 1,
            Self::Short | Self::Half => 2,
            Self::Float => 4,
        }
    }
}

/// Value of a key in the key/value data, without the terminating zero.
fn value<'a>(mut data: &'a [u8], key: &[u8]) -> Option<&'a [u8]> {
    while let Some(length) = short(data, 0) {
        let length = length as usize;
        let pair = data.get(4..)?.get(..length)?;
        let end = pair.iter().position(|byte| *byte == 0)?;
        if pair[..end] == *key {
            let value = &pair[end + 1..];
            return Some(value.strip_suffix(b"\0").unwrap_or(value));
        }
        data = data.get(4 + length.next_multiple_of(4)..)?;
    }
    None
}

/// Format by its Vulkan code, or by the BasisU colour model.
fn texel_format(code: u32, model: u8) -> Result<Ktx2Format, String> {
    use NumberFormat::{Byte, Float, Half, Short};
    const ETC1S: u8 = 163;
    const UASTC: u8 = 166;
    const UASTC_HDR: u8 = 167;
    const ASTC_4X4_FLOAT: u32 = 1_000_066_000;
    let plain = |channels, number, bgr| -> Result<Ktx2Format, String> {
        Ok(Ktx2Format::Plain { channels, number, bgr })
    };
    let name = match code {
        0 if model == ETC1S => return Ok(Ktx2Format::Etc1s),
        0 if model == UASTC => return Ok(Ktx2Format::Uastc),
        ASTC_4X4_FLOAT if model == UASTC_HDR => return Ok(Ktx2Format::UastcHdr),
        // UNORM and SRGB variants.
        9 | 15 => return plain(1, Byte, false),
        16 | 22 => return plain(2, Byte, false),
        23 | 29 => return plain(3, Byte, false),
        30 | 36 => return plain(3, Byte, true),
        37 | 43 => return plain(4, Byte, false),
        44 | 50 => return plain(4, Byte, true),
        70 => return plain(1, Short, false),
        76 => return plain(1, Half, false),
        77 => return plain(2, Short, false),
        83 => return plain(2, Half, false),
        84 => return plain(3, Short, false),
        90 => return plain(3, Half, false),
        91 => return plain(4, Short, false),
        97 => return plain(4, Half, false),
        100 => return plain(1, Float, false),
        103 => return plain(2, Float, false),
        106 => return plain(3, Float, false),
        109 => return plain(4, Float, false),
        131..=138 => "BC1 to BC3",
        139..=142 => "BC4 and BC5",
        143 | 144 => "BC6H",
        145 | 146 => "BC7",
        147..=152 => "ETC2",
        153..=156 => "EAC",
        157..=184 | ASTC_4X4_FLOAT..=1_000_066_013 => "ASTC",
        0 => return Err(format!("its colour model {model} is not read: encode it as ETC1S or UASTC")),
        code => return Err(format!("its format {code} of Vulkan is not read: encode it as ETC1S or UASTC")),
    };
    Err(format!("its texels are compressed as {name}, which is not read: encode it as ETC1S or UASTC"))
}

/// Decodes the largest level of a file, of at most `most` pixels.
pub(super) fn decode(bytes: &[u8], most: usize) -> Result<Ktx2Picture, String> {
    let header = Ktx2Header::read(bytes, most)?;
    let texels = match header.format {
        Ktx2Format::Plain { channels, number, bgr } => {
            plain_texels(&header.unpacked()?, [header.width, header.height], channels, number, bgr)
        }
        Ktx2Format::Etc1s | Ktx2Format::Uastc => {
            let bytes = transcoded(bytes, TargetFormat::Rgba32)?;
            Ktx2Texels::Eight(bytes.as_chunks::<4>().0.to_vec())
        }
        Ktx2Format::UastcHdr => {
            let bytes = transcoded(bytes, TargetFormat::RgbaHalf)?;
            let float = |[a, b]: [u8; 2]| f16::from_le_bytes([a, b]).to_f32();
            let texels = bytes.as_chunks::<2>().0.as_chunks::<4>().0;
            Ktx2Texels::Float(texels.iter().map(|texel| texel.map(float)).collect())
        }
    };
    let mut picture = Ktx2Picture {
        width: header.width,
        height: header.height,
        texels,
        is_srgb: header.is_srgb(),
        remarks: header.remarks(),
    };
    picture.turn(header.orientation);
    picture.exchange(header.swizzle);
    Ok(picture)
}

/// Whether the data format descriptor of a KTX2 file declares linear integers.
pub(crate) fn is_linear(bytes: &[u8]) -> bool {
    let offset = short(bytes, 48).map_or(0, |offset| offset as usize);
    bytes.starts_with(SIGNATURE)
        && bytes.get(offset..).and_then(|descriptor| descriptor.get(14)).is_some_and(|v| *v == LINEAR)
}

/// Pixels of the largest level, according to the header of a KTX2 file.
pub(crate) fn pixels(bytes: &[u8]) -> usize {
    let side = |at| short(bytes, at).unwrap_or(0) as usize;
    side(20).saturating_mul(side(24))
}

/// Whether a file is KTX2, by its first bytes.
pub(crate) fn is_ktx2(bytes: &[u8]) -> bool {
    bytes.starts_with(SIGNATURE)
}

/// Transcodes the largest level of a BasisU file.
fn transcoded(bytes: &[u8], target: TargetFormat) -> Result<Vec<u8>, String> {
    let wrong = |_: basisu::Error| "its BasisU data are damaged".to_owned();
    Transcoder::new(bytes).and_then(|file| file.transcode(0, target, DecodeFlags::NONE)).map_err(wrong)
}

/// Texels of uncompressed numbers. Without a swizzle a single number is grey, and the second of two is green.
fn plain_texels(
    bytes: &[u8],
    size: [usize; 2],
    channels: usize,
    number: NumberFormat,
    bgr: bool,
) -> Ktx2Texels {
    let width = number.size();
    let texels = bytes.chunks_exact(channels * width).take(size[0] * size[1]);
    let place = |channel: usize| match (channels, channel) {
        (1, 0..3) => Some(0),
        (_, 0..3) if bgr => Some(2 - channel),
        (_, channel) => Some(channel).filter(|channel| *channel < channels),
    };
    let places: [Option<usize>; 4] = std::array::from_fn(place);
    // Missing alpha is one, missing colours are zero.
    macro_rules! collected {
        ($texel:expr, $zero:expr, $one:expr) => {{
            let texel = |texel: &[u8]| {
                std::array::from_fn(|i| match places[i] {
                    Some(at) => $texel(&texel[at * width..(at + 1) * width]),
                    None if i < 3 => $zero,
                    None => $one,
                })
            };
            texels.map(texel).collect()
        }};
    }
    let pair = |b: &[u8]| [b[0], b[1]];
    match number {
        NumberFormat::Byte => Ktx2Texels::Eight(collected!(|b: &[u8]| b[0], 0, u8::MAX)),
        NumberFormat::Short => {
            Ktx2Texels::Sixteen(collected!(|b: &[u8]| u16::from_le_bytes(pair(b)), 0, u16::MAX))
        }
        NumberFormat::Half => {
            Ktx2Texels::Float(collected!(|b: &[u8]| f16::from_le_bytes(pair(b)).to_f32(), 0.0, 1.0))
        }
        NumberFormat::Float => {
            Ktx2Texels::Float(collected!(|b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]), 0.0, 1.0))
        }
    }
}

impl Ktx2Picture {
    /// Flips rows stored from the bottom and columns stored from the right.
    fn turn(&mut self, orientation: &[u8]) {
        fn turn<T>(texels: &mut [T], width: usize, left: bool, up: bool) {
            if up {
                texels.reverse();
            }
            // Reversing the whole array flips both axes.
            if left != up {
                texels.chunks_exact_mut(width).for_each(<[T]>::reverse);
            }
        }
        let [left, up] = [orientation.first() == Some(&b'l'), orientation.get(1) == Some(&b'u')];
        match &mut self.texels {
            Ktx2Texels::Eight(texels) => turn(texels, self.width, left, up),
            Ktx2Texels::Sixteen(texels) => turn(texels, self.width, left, up),
            Ktx2Texels::Float(texels) => turn(texels, self.width, left, up),
        }
    }

    /// Applies a swizzle to R, G, B, A.
    fn exchange(&mut self, swizzle: &[u8]) {
        fn exchange<T: Copy>(texels: &mut [[T; 4]], swizzle: &[u8], zero: T, one: T) {
            for texel in texels {
                let old = *texel;
                for (new, letter) in texel.iter_mut().zip(swizzle) {
                    *new = match letter {
                        b'r' => old[0],
                        b'g' => old[1],
                        b'b' => old[2],
                        b'a' => old[3],
                        b'1' => one,
                        _ => zero,
                    };
                }
            }
        }
        if swizzle.len() != 4 || swizzle == b"rgba" {
            return;
        }
        match &mut self.texels {
            Ktx2Texels::Eight(texels) => exchange(texels, swizzle, 0, u8::MAX),
            Ktx2Texels::Sixteen(texels) => exchange(texels, swizzle, 0, u16::MAX),
            Ktx2Texels::Float(texels) => exchange(texels, swizzle, 0.0, 1.0),
        }
    }
}
