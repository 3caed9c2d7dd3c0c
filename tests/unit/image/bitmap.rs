//! Tests of `image::bitmap`.

use pointillist::color::srgb;
use pointillist::image::Grid;
use pointillist::image::bitmap::Bitmap;
use pointillist::image::error::ImageError;
use pointillist::image::exr;
use pointillist::image::exr::Layers;
use pointillist::math::random::Random;
use std::io::Cursor;
use std::path::Path;

use image::ImageFormat;

/// The picture as light.
fn decode(path: &Path, bytes: &[u8], most: usize) -> Result<Grid<[f32; 3]>, ImageError> {
    Bitmap::decode(path, bytes, false, most).map(Bitmap::into_linear)
}

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

/// The attribute of an EXR file with its primaries and white.
const CHROMATICITIES: &[u8] = b"chromaticities\0chromaticities\0\x20\0\0\0";

#[test]
fn exr_files_of_other_primaries_are_converted() {
    let mut layers = Layers { width: 1, height: 1, ..Layers::default() };
    ["B", "G", "R"].into_iter().zip([0.1, 0.1, 0.8]).for_each(|(name, value)| layers.push(name, [value]));
    let path = std::env::temp_dir().join(format!("{}-primaries.exr", std::process::id()));
    exr::write(&path, &layers).expect("written");
    let mut bytes = std::fs::read(&path).expect("just written");
    std::fs::remove_file(&path).expect("just written");
    assert_eq!(decode(Path::new("a.exr"), &bytes, 1).expect("a picture").at(0, 0), [0.8, 0.1, 0.1]);
    let place = bytes.windows(CHROMATICITIES.len()).position(|w| w == CHROMATICITIES).expect("it is written");
    let mut set = |xy: [f32; 8]| {
        let at = place + CHROMATICITIES.len();
        xy.iter()
            .zip(bytes[at..at + 32].chunks_mut(4))
            .for_each(|(v, to)| to.copy_from_slice(&v.to_le_bytes()));
        bytes.clone()
    };
    let aces = set([0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767]);
    let [r, g, b] = decode(Path::new("a.exr"), &aces, 1).expect("a picture").at(0, 0);
    assert!((r - 1.89).abs() < 0.01 && (g + 0.10).abs() < 0.01 && (b - 0.08).abs() < 0.01, "{r} {g} {b}");
    // Numbers that are no colours stay as they are.
    let raw = Bitmap::decode(Path::new("a.exr"), &aces, true, 1).expect("a picture");
    assert_eq!(raw.texel(0, 0), [0.8, 0.1, 0.1]);
    let error = decode(Path::new("a.exr"), &set([0.0; 8]), 1).expect_err("no colours").to_string();
    assert!(error.contains("chromaticities"), "{error}");
}

#[test]
fn what_is_said_of_colours_and_not_used_is_told() {
    let remarks = |name: &str, bytes: &[u8], raw| {
        Bitmap::decode(Path::new(name), bytes, raw, 9).expect("a picture").remarks().join(" ")
    };
    let hdr = |lines: &str| format!("#?RADIANCE\n{lines}\n-Y 1 +X 1\n\u{3}\u{3}\u{3}\u{3}").into_bytes();
    let other =
        "EXPOSURE=2\nEXPOSURE=1.0\nCOLORCORR=1 1 2\nPRIMARIES=.6 .3 .3 .6 .1 .1 .3 .3\nCOLORCORR= 1 1 1\n";
    let told = remarks("a.hdr", &hdr(other), false);
    assert!(["`EXPOSURE=2`", "`COLORCORR=1 1 2`", "PRIMARIES"].iter().all(|w| told.contains(w)), "{told}");
    assert_eq!(told.matches("line").count(), 3, "{told}");
    assert_eq!(remarks("a.hdr", &hdr("EXPOSURE=1\nVIEW=no colour\n"), false), "");
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_source_gamma(png::ScaledFloat::new(1.0));
    let mut writer = encoder.write_header().expect("a header");
    writer.write_image_data(&[0, 255]).expect("pixels");
    writer.finish().expect("an end");
    assert!(remarks("a.png", &bytes, false).contains("gamma 1.000"));
    assert_eq!(remarks("a.png", &bytes, true), "", "raw texels have no colours");
}

#[test]
fn other_files_are_refused_by_name() {
    for (bytes, word) in [
        (&b"#?RADIANCE\n"[..], "EOF in header"),
        (b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n    ", "32-bit_rle_xyze"),
        (b"#?RADIANCE\n\n+X 1 -Y 1\n    ", "Orientation"),
        (b"#?RADIANCE\n\n-Y 65535 +X 65535\n", "more than"),
        (b"#?RADIANCE\n\n-Y 1 +X 2\n    ", "cut short"),
        (b"#?RADIANCE\n\n-Y 1 +X 2\n\x01\x01\x01\x01", "run length"),
        (b"#?RADIANCE\n\n-Y 1 +X 9\n\x02\x02\x00\x09\x8a\x01", "scanline"),
        (b"#?RADIANCE\n\n-Y 1 +X 9\n\x02\x02\x00\x09\x00", "cut short"),
        (b"PF\n65535 65535 -1\n", "more than"),
        (b"PF\n1 1 -1\n", "cut short"),
        (b"PF\n1 nan -1\n    ", "no pixels"),
        (b"PF\n1 1 0\n0123456789ab", "scale"),
        (b"PF\n1 1", "does not end"),
        (b"\xff\xd8\xff\xe0", "no picture"),
        (b"", "neither"),
        (b"\x89PNG\r\n\x1a\n", "no picture"),
        (b"\x76\x2f\x31\x01\x02\0\0\0", "no picture"),
    ] {
        let error = decode(Path::new("sky.hdr"), bytes, 10).expect_err("no picture").to_string();
        assert!(error.contains("sky.hdr") && error.contains(word), "{error}");
    }
}

/// The same three pixels in every coding that the format has: as they are, in old runs, in new runs and lists.
#[test]
fn radiance_in_old_and_new_coding() {
    let file = |size: &str, data: &[u8]| {
        let head = format!("EXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n{size}\n");
        // A comment in Latin-1.
        decode(Path::new("sky.hdr"), &[b"#?RGBE\n# caf\xe9\n", head.as_bytes(), data].concat(), 1000)
    };
    let plain =
        file("-Y 2 +X 2", &[128, 64, 0, 129, 0, 0, 0, 0, 1, 2, 3, 120, 255, 255, 255, 255]).expect("valid");
    let top = 255.0 * 2f32.powi(119);
    let small = [1.0, 2.0, 3.0].map(|v| v * 2f32.powi(-16));
    assert_eq!(plain.pixels(), [[1.0, 0.5, 0.0], [0.0; 3], small, [top; 3]]);
    // A count of two bytes, lowest first: 1 + (255 + 256) pixels.
    let old = [[128, 64, 0, 129], [1, 1, 1, 255], [1, 1, 1, 1]].concat();
    let old = file("-Y 1 +X 512", &old).expect("valid");
    assert!(old.pixels().iter().all(|p| *p == [1.0, 0.5, 0.0]) && old.width() == 512);
    // Nine pixels: red a run, green a list, blue of two runs, the exponent a run.
    let new = [&[2, 2, 0, 9, 137, 128, 9, 0, 1, 2, 3, 4, 5, 6, 7, 8, 132, 7, 133, 9, 137, 136][..]].concat();
    let new = file("-Y 1 +X 9", &new).expect("valid");
    let expected = |x: usize| [128.0, x as f32, if x < 4 { 7.0 } else { 9.0 }];
    (0..9).for_each(|x| assert_eq!(new.at(x, 0), expected(x)));
    // Rows of other widths than they say are in the old coding.
    assert!(file("-Y 1 +X 10", &[2, 2, 0, 9, 137, 128]).is_err());
}

#[test]
fn float_maps_of_both_orders_from_the_bottom() {
    let read = |head: &str, data: &[u8]| decode(Path::new("a.pfm"), &[head.as_bytes(), data].concat(), 9);
    let floats = |write: fn(f32) -> [u8; 4]| (0..6).flat_map(|i| write(i as f32)).collect::<Vec<u8>>();
    let rows = [[3.0, 4.0, 5.0], [0.0, 1.0, 2.0]];
    assert_eq!(read("PF\n1 2\n-1.0\n", &floats(f32::to_le_bytes)).expect("valid").pixels(), rows);
    assert_eq!(read("PF 1 2 1 ", &floats(f32::to_be_bytes)).expect("valid").pixels(), rows);
    let grey = read("Pf\n2 1\n-2\n", &floats(f32::to_le_bytes)).expect("valid");
    assert_eq!(grey.pixels(), [[0.0; 3], [2.0; 3]]);
}

#[test]
fn jpeg_is_decoded_from_srgb_and_refused_when_cut() {
    let mut bytes = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut bytes, 100);
    encoder.encode(&[188; 16 * 16 * 3], 16, 16, jpeg_encoder::ColorType::Rgb).expect("encoded");
    let grid = decode(Path::new("a.jpg"), &bytes, 256).expect("a picture");
    assert_eq!((grid.width(), grid.height()), (16, 16));
    assert!(grid.pixels().iter().flatten().all(|v| (v - 0.5029).abs() < 1e-2), "{:?}", grid.at(0, 0));
    assert!(decode(Path::new("a.jpg"), &bytes, 255).is_err());
    let cut = decode(Path::new("a.jpg"), &bytes[..bytes.len() - 2], 256).expect_err("no end");
    assert!(cut.to_string().contains("cut short"), "{cut}");
}

/// A thousand broken files of each format: each is read within its limits or refused, whatever its header promises.
#[test]
fn broken_pictures_are_refused_or_read() {
    let mut jpeg = Vec::new();
    let gradient: Vec<u8> = (0..24 * 16 * 3).map(|i| (i * 7 % 251) as u8).collect();
    let encoder = jpeg_encoder::Encoder::new(&mut jpeg, 80);
    encoder.encode(&gradient, 24, 16, jpeg_encoder::ColorType::Rgb).expect("encoded");
    let mut runs = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 9\n".to_vec();
    (0..4).for_each(|_| {
        runs.extend([2, 2, 0, 9, 137, 128, 9, 0, 1, 2, 3, 4, 5, 6, 7, 8, 132, 7, 133, 9, 137, 136])
    });
    let mut old = b"#?RADIANCE\n\n-Y 2 +X 257\n".to_vec();
    (0..2).for_each(|_| old.extend([128, 64, 0, 129, 1, 1, 1, 255, 1, 1, 1, 0, 3, 3, 3, 130]));
    let floats = [&b"PF\n3 4\n-1.0\n"[..], &[63; 3 * 4 * 12]].concat();
    let picture = image::RgbImage::from_raw(24, 16, gradient).expect("as many bytes as pixels ask for");
    let written = |format| {
        let mut file = Cursor::new(Vec::new());
        picture.write_to(&mut file, format).expect("encoded");
        file.into_inner()
    };
    let [png, bmp, tga] = [ImageFormat::Png, ImageFormat::Bmp, ImageFormat::Tga].map(written);
    let (most, mut random) = (1 << 16, Random(21));
    let files = [("a.jpg", jpeg), ("new.hdr", runs), ("old.hdr", old), ("a.pfm", floats)];
    for (name, valid) in files.into_iter().chain([("a.png", png), ("a.bmp", bmp), ("a.tga", tga)]) {
        let (mut read, mut refused) = (0, 0);
        for _ in 0..1000 {
            let mut bytes = valid.clone();
            for _ in 0..=random.below(4) {
                let at = random.below(bytes.len());
                match random.below(5) {
                    0 => bytes.truncate(at.max(4)),
                    1 => bytes.insert(at, b'9'),
                    2 => drop(bytes.remove(at)),
                    _ => bytes[at] = (random.f64() * 256.0) as u8,
                }
            }
            match decode(Path::new(name), &bytes, most) {
                Ok(grid) => {
                    assert!((1..=most).contains(&grid.pixels().len()));
                    read += 1;
                }
                Err(error) => {
                    assert!(error.to_string().contains(name), "{error}");
                    refused += 1;
                }
            }
        }
        assert!(read > 0 && refused > 100, "{name}: {read} read, {refused} refused");
    }
}

/// Textures keep what the file holds: raw integers are not decoded.
#[test]
fn raw_integers_are_linear() {
    let file = encoded(png::ColorType::Rgb, png::BitDepth::Eight, &[255, 188, 0, 188, 188, 188]);
    let raw = Bitmap::decode(Path::new("a.png"), &file, true, 2).expect("a picture");
    assert_eq!(raw.texel(0, 0), [1.0, 188.0 / 255.0, 0.0]);
    let wide = encoded(png::ColorType::Grayscale, png::BitDepth::Sixteen, &[128, 0, 255, 255]);
    let wide = Bitmap::decode(Path::new("a.png"), &wide, true, 2).expect("a picture");
    assert_eq!((wide.texel(0, 0), wide.texel(1, 0)), ([32_768.0 / 65_535.0; 3], [1.0; 3]));
}
