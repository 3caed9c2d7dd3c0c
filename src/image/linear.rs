//! Pictures as light: linear Rec.709 from OpenEXR, Radiance, PFM, PNG and JPEG files.

use std::io::Cursor;
use std::path::Path;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::color::srgb;
use crate::image::error::ImageError;
use crate::image::exr;
use crate::image::grid::Grid;
use crate::image::layer::{self, Layer};
use crate::image::{pfm, radiance};

/// Linear R, G, B of the file with these `bytes`; `path` only names it in errors. The first bytes tell the format: OpenEXR
/// (the main layer, see [`layer::main`]), Radiance RGBE, PFM, or PNG and JPEG of any kind, which are decoded by the curve of sRGB
/// (IEC 61966-2-1) with alpha ignored.
///
/// # Errors
/// [`ImageError::Decode`] for other formats, damaged files, and more than `most` pixels; [`ImageError::Channel`] for an
/// EXR file without a main layer.
pub fn decode(path: &Path, bytes: &[u8], most: usize) -> Result<Grid<[f32; 3]>, ImageError> {
    let refuse = ImageError::decode(path);
    let (width, height, pixels) = match bytes {
        [0x76, 0x2f, 0x31, 0x01, ..] => {
            exr::check_size(bytes, most).map_err(refuse)?;
            let layers = exr::decode_layers(path, Cursor::new(bytes))?;
            let main = layer::main(&layers).as_ref().map(Layer::pixels);
            let pixels = main.ok_or_else(|| exr::no_channel(path, &layers, "R"))?;
            (layers.width, layers.height, pixels)
        }
        [0x89, b'P', b'N', b'G', ..] => png(bytes, most).map_err(refuse)?,
        [b'#', b'?', ..] => radiance::decode(bytes, most).map_err(refuse)?,
        [b'P', b'F' | b'f', b'\n' | b'\r' | b' ', ..] => pfm::decode(bytes, most).map_err(refuse)?,
        [0xff, 0xd8, 0xff, ..] => jpeg(bytes, most).map_err(refuse)?,
        _ => return Err(refuse("it is neither OpenEXR, Radiance, PFM, PNG nor JPEG".to_owned())),
    };
    Grid::from_rows(width, height, pixels).ok_or_else(|| refuse("it is cut short".to_owned()))
}

/// Width, height and pixels of a PNG file.
fn png(bytes: &[u8], most: usize) -> Result<(usize, usize, Vec<[f32; 3]>), String> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(|e| e.to_string())?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    exr::check_pixels(width, height, most)?;
    let (color, depth) = reader.output_color_type();
    let samples = color.samples();
    let wide = depth == png::BitDepth::Sixteen;
    let mut data = vec![0; reader.output_buffer_size().unwrap_or_default()];
    reader.next_frame(&mut data).map_err(|e| e.to_string())?;
    let curve = curve();
    let value = |i: usize| match wide {
        true => srgb::decode(f32::from(u16::from_be_bytes([data[2 * i], data[2 * i + 1]])) / 65_535.0),
        false => curve[usize::from(data[i])],
    };
    let pixel = |i: usize| {
        let first = i * samples;
        if samples < 3 { [value(first); 3] } else { [0, 1, 2].map(|c| value(first + c)) }
    };
    Ok((width, height, (0..width * height).map(pixel).collect()))
}

/// Width, height and pixels of a JPEG file.
fn jpeg(bytes: &[u8], most: usize) -> Result<(usize, usize, Vec<[f32; 3]>), String> {
    let rgb = DecoderOptions::default()
        .jpeg_set_out_colorspace(ColorSpace::RGB)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX));
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), rgb);
    decoder.decode_headers().map_err(|e| e.to_string())?;
    let (width, height) = decoder.dimensions().ok_or("it tells no size")?;
    exr::check_pixels(width, height, most)?;
    // Each block of 8 × 8 pixels, or of 16 × 16 with halved colours, takes at least three bits.
    if width * height / 1024 > bytes.len() {
        return Err(format!(
            "its header promises {width}×{height} pixels, which {} bytes cannot hold",
            bytes.len()
        ));
    }
    // The decoder fills what is missing. Neither marker can stand within pixels, and a thumbnail ends before they begin.
    let last = |marker: [u8; 2]| bytes.windows(2).rposition(|pair| pair == marker);
    if last([0xff, 0xd9]) < last([0xff, 0xda]) {
        return Err("it is cut short".to_owned());
    }
    let data = decoder.decode().map_err(|e| e.to_string())?;
    let curve = curve();
    let pixels = data.as_chunks().0.iter().map(|rgb: &[u8; 3]| rgb.map(|v| curve[usize::from(v)]));
    Ok((width, height, pixels.collect()))
}

/// The value of each byte by the curve of sRGB.
fn curve() -> Vec<f32> {
    (0..=255u8).map(|v| srgb::decode(f32::from(v) / 255.0)).collect()
}
