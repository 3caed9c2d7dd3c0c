//! Pictures as light: linear Rec.709 from OpenEXR and PNG files.

use std::io::Cursor;
use std::path::Path;

use crate::color::srgb;
use crate::image::error::ImageError;
use crate::image::exr;
use crate::image::grid::Grid;
use crate::image::layer::{self, Layer};

/// Linear R, G, B of the file with these `bytes`; `path` only names it in errors. The first bytes tell the format: OpenEXR
/// (the main layer, see [`layer::main`]), or PNG of any kind, which is decoded by the curve of sRGB (IEC 61966-2-1)
/// with alpha ignored.
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
        [b'#', b'?', ..] => return Err(refuse("Radiance RGBE is not read, only OpenEXR and PNG".to_owned())),
        _ => return Err(refuse("it is neither OpenEXR nor PNG".to_owned())),
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
    let curve: Vec<f32> = (0..=255u8).map(|v| srgb::decode(f32::from(v) / 255.0)).collect();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::exr::Layers;

    fn encoded(color: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(data).expect("pixels");
        writer.finish().expect("an end");
        bytes
    }

    #[test]
    fn png_of_every_kind_is_decoded_from_srgb() {
        use png::{BitDepth::*, ColorType::*};
        let middle = srgb::decode(188.0 / 255.0);
        assert!((middle - 0.5029).abs() < 1e-3, "{middle}");
        for (color, depth, data) in [
            (Rgb, Eight, &[255, 188, 0, 188, 188, 188][..]),
            (Rgba, Eight, &[255, 188, 0, 7, 188, 188, 188, 255]),
            (Rgb, Sixteen, &[255, 255, 188, 188, 0, 0, 188, 188, 188, 188, 188, 188]),
        ] {
            let grid = decode(Path::new("a.png"), &encoded(color, depth, data), 2).expect("a picture");
            let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4);
            assert!(
                close(grid.at(0, 0), [1.0, middle, 0.0]) && close(grid.at(1, 0), [middle; 3]),
                "{grid:?}"
            );
        }
        let grey = decode(Path::new("a.png"), &encoded(Grayscale, Eight, &[0, 255]), 2).expect("a picture");
        assert_eq!((grey.at(0, 0), grey.at(1, 0)), ([0.0; 3], [1.0; 3]));
    }

    #[test]
    fn exr_files_by_their_channels() {
        let bytes = |names: &[&str]| {
            let mut layers = Layers { width: 2, height: 1, ..Layers::default() };
            names.iter().zip(1..).for_each(|(n, i)| layers.push(n, [i as f32, 0.5]));
            let path = std::env::temp_dir().join(format!("{}-{}.exr", std::process::id(), names.len()));
            exr::write(&path, &layers).expect("written");
            let bytes = std::fs::read(&path).expect("just written");
            std::fs::remove_file(&path).expect("just written");
            bytes
        };
        let read = |names: &[&str], most| decode(Path::new("a.exr"), &bytes(names), most);
        // Channels are numbered in the order given here; the file sorts them.
        assert_eq!(read(&["R", "G", "B", "A"], 2).expect("a picture").at(0, 0), [1.0, 2.0, 3.0]);
        assert_eq!(
            read(&["beauty.R", "beauty.G", "beauty.B"], 2).expect("a picture").at(0, 0),
            [1.0, 2.0, 3.0]
        );
        assert_eq!(read(&["Y"], 2).expect("a picture").pixels(), [[1.0; 3], [0.5; 3]]);
        assert!(matches!(read(&["Z", "A"], 2), Err(ImageError::Channel { .. })));
        assert!(matches!(read(&["Y"], 1), Err(ImageError::Decode { .. })));
    }

    #[test]
    fn other_files_are_refused_by_name() {
        for (bytes, word) in [
            (&b"#?RADIANCE\n"[..], "Radiance"),
            (b"\xff\xd8\xff\xe0", "neither"),
            (b"", "neither"),
            (b"\x89PNG\r\n\x1a\n", "no picture"),
            (b"\x76\x2f\x31\x01\x02\0\0\0", "no picture"),
        ] {
            let error = decode(Path::new("sky.hdr"), bytes, 10).expect_err("no picture").to_string();
            assert!(error.contains("sky.hdr") && error.contains(word), "{error}");
        }
    }
}
