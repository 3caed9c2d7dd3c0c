//! Tests of `image::ktx2`: files of independent encoders against what an independent decoder makes of them.

use std::path::Path;

use pointillist::image::bitmap::Bitmap;

fn bytes(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scene/compressed");
    std::fs::read(folder.join(name)).expect("a file of the tests")
}

fn decode(name: &str, bytes: &[u8], raw: bool) -> Result<Bitmap, String> {
    Bitmap::decode(Path::new(name), bytes, raw, 1 << 20).map_err(|e| e.to_string())
}

fn read(name: &str, raw: bool) -> Bitmap {
    decode(name, &bytes(name), raw).unwrap_or_else(|e| panic!("{e}"))
}

/// The largest difference of any texel of `a` to what `expected` makes of that of `b`.
fn difference(a: &Bitmap, b: &Bitmap, expected: impl Fn([f32; 3]) -> [f32; 3]) -> f32 {
    assert_eq!((a.width(), a.height()), (b.width(), b.height()));
    let texels = (0..a.height()).flat_map(|y| (0..a.width()).map(move |x| (x, y)));
    let differ = |(x, y): (usize, usize)| {
        let (a, b) = (a.texel(x, y), expected(b.texel(x, y)));
        (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f32::max)
    };
    texels.map(differ).fold(0.0, f32::max)
}

/// The transcoder of Basis Universal makes the same texels, bit for bit.
#[test]
fn basisu_is_decoded_as_by_its_makers() {
    for (name, png) in
        [("uastc.ktx2", "uastc.png"), ("uastc-zstd.ktx2", "uastc.png"), ("etc1s.ktx2", "etc1s.png")]
    {
        for raw in [false, true] {
            assert_eq!(difference(&read(name, raw), &read(png, raw), |v| v), 0.0, "{name}");
        }
    }
    // Encoders lose little of what they were given.
    let lost = difference(&read("uastc.ktx2", true), &read("whole.png", true), |v| v);
    assert!(lost < 4.0 / 255.0, "{lost}");
}

/// The data format descriptor tells whether the curve of sRGB encodes the texels, unless they are raw.
#[test]
fn linear_files_are_not_decoded_from_srgb() {
    for (name, png) in [("uastc-linear.ktx2", "uastc.png"), ("bgra8-zstd.ktx2", "whole.png")] {
        for raw in [false, true] {
            let picture = read(name, raw);
            assert!(!picture.is_decoded());
            assert_eq!(difference(&picture, &read(png, true), |v| v), 0.0, "{name}");
        }
    }
    assert!(read("uastc.ktx2", false).is_decoded());
}

#[test]
fn plain_numbers_are_read() {
    let whole = [read("whole.png", false), read("whole.png", true)];
    assert_eq!(difference(&read("rgba8.ktx2", false), &whole[0], |v| v), 0.0);
    // One number is grey.
    assert_eq!(difference(&read("r8.ktx2", false), &whole[0], |[r, ..]| [r; 3]), 0.0);
    // Two numbers that are grey and alpha by their swizzle.
    assert!(difference(&read("rg16-swizzled.ktx2", false), &whole[1], |[r, ..]| [r; 3]) < 1e-6);
    // Halves from the lowest row; light beyond one.
    let light = |v: [f32; 3]| v.map(|v| v * 255.0 / 16.0);
    assert!(difference(&read("half-upwards.ktx2", false), &whole[1], light) < 1e-5);
    let float = |[r, g, b]: [f32; 3]| [r * 255.0 / 16.0, g * 255.0 / 16.0, b * 2550.0];
    assert!(difference(&read("float.ktx2", false), &whole[1], float) < 1e-3);
}

/// What no single picture of the formats that are read is has a message with its name.
#[test]
fn other_kinds_of_textures_are_refused_by_name() {
    let valid = bytes("rgba8.ktx2");
    let edited = |at: usize, value: u32| {
        let mut bytes = valid.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        decode("a.ktx2", &bytes, false).err().unwrap_or_else(|| panic!("{at}: {value} is read"))
    };
    for (at, value, word) in [
        (36, 6, "cube map"),
        (32, 5, "array"),
        (28, 3, "three dimensions"),
        (24, 0, "one dimension"),
        (12, 146, "BC7"),
        (12, 131, "BC1"),
        (12, 147, "ETC2"),
        (12, 157, "ASTC"),
        (12, 122, "format 122"),
        (12, 0, "colour model"),
        (44, 1, "supercompression 1"),
        (20, 23, "23×20"),
        (20, 1 << 20, "more than"),
        (40, 33, "33 levels"),
        (48, 5000, "cut short"),
        (80, 1 << 30, "cut short"),
    ] {
        let message = edited(at, value);
        assert!(message.contains(word) && message.contains("a.ktx2"), "{at}: {message}");
    }
    let mut cut = valid.clone();
    cut.truncate(valid.len() - 1);
    assert!(decode("a.ktx2", &cut, false).is_err());
    // Video of one frame.
    let mut video = bytes("etc1s.ktx2");
    let at = video.windows(9).position(|w| w == b"KTXwriter").expect("a writer");
    video[at..at + 12].copy_from_slice(b"KTXanimData\0");
    let message = decode("a.ktx2", &video, false).expect_err("a video");
    assert!(message.contains("video"), "{message}");
}

#[test]
fn colors_that_are_not_used_are_told() {
    let mut other = bytes("rgba8.ktx2");
    let descriptor = u32::from_le_bytes(other[48..52].try_into().expect("four bytes")) as usize;
    // Primaries of DCI P3, alpha premultiplied.
    other[descriptor + 13] = 10;
    other[descriptor + 15] = 1;
    let read = decode("a.ktx2", &other, false).unwrap_or_else(|e| panic!("{e}"));
    let remarks = read.remarks().join(", ");
    assert!(remarks.contains("primaries 10") && remarks.contains("premultiplied"), "{remarks}");
    assert!(decode("a.ktx2", &other, true).is_ok_and(|raw| raw.remarks().is_empty()));
}
