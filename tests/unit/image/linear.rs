//! Tests of `image::linear`.

use pointillist::color::srgb;
use pointillist::image::error::ImageError;
use pointillist::image::exr;
use pointillist::image::exr::Layers;
use pointillist::image::linear::*;
use std::path::Path;

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
        assert!(close(grid.at(0, 0), [1.0, middle, 0.0]) && close(grid.at(1, 0), [middle; 3]), "{grid:?}");
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
    assert_eq!(read(&["beauty.R", "beauty.G", "beauty.B"], 2).expect("a picture").at(0, 0), [1.0, 2.0, 3.0]);
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
