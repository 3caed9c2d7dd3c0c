//! A thousand broken pictures of each format, and pictures that say they are larger than they are: each is read, or refused with a place.

use std::io::{Cursor, Write};

use flate2::{Compression, Crc, write::ZlibEncoder};
use image::ImageFormat;
use pointillist::image::exr::{self, Layers};
use pointillist::math::random::Random;

use crate::corrupt::corrupt;
use crate::guard::{folder, outcome, write};
use crate::messages::assert_has_place;

/// Sides that break readers.
const SIDES: &[u32] =
    &[0, 1, 255, 256, 8191, 16_384, 32_767, 32_768, 65_535, 65_536, 1 << 24, i32::MAX as u32, u32::MAX];

/// Pieces of headers in wrong places.
const PIECES: &[&str] = &[
    "-Y 65535 +X 65535\n",
    "-Y 1 +X 67108863\n",
    "PF\n65535 65535\n-1\n",
    "PF\n1 1\nnan\n",
    "#?RADIANCE\n",
    "IHDR\0\0\u{7f}\u{7f}\0\0\u{7f}\u{7f}",
    "IDAT",
    "IEND",
    "\u{7f}\u{7f}\u{7f}\u{7f}",
    "\0\0\0\0\0\0\0\0",
    "dataWindow\0box2i\0\u{10}\0\0\0",
    "channels\0chlist\0",
    "tiles\0tiledesc\0",
];

/// What a PNG file begins with.
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

const WIDTH: u32 = 24;
const HEIGHT: u32 = 16;

fn gradient() -> Vec<u8> {
    (0..WIDTH * HEIGHT * 3).map(|i| (i * 7 % 251) as u8).collect()
}

/// A valid picture of each format, with its ending; `name` is the test's.
fn pictures(name: &str) -> Vec<(&'static str, Vec<u8>)> {
    let picture =
        image::RgbImage::from_raw(WIDTH, HEIGHT, gradient()).expect("as many bytes as pixels ask for");
    let encoded = |format| {
        let mut file = Cursor::new(Vec::new());
        picture.write_to(&mut file, format).expect("encoded");
        file.into_inner()
    };
    let mut jpeg = Vec::new();
    let encoder = jpeg_encoder::Encoder::new(&mut jpeg, 80);
    encoder.encode(&gradient(), 24, 16, jpeg_encoder::ColorType::Rgb).expect("encoded");
    let mut radiance = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n").into_bytes();
    for _ in 0..HEIGHT {
        radiance.extend([2, 2, 0, WIDTH as u8]);
        (0..4).for_each(|component| radiance.extend([128 + 20, 120 + component, 4, 1, 2, 3, 129]));
    }
    let mut floats = format!("PF\n{WIDTH} {HEIGHT}\n-1.0\n").into_bytes();
    gradient().iter().for_each(|v| floats.extend((f32::from(*v) / 255.0).to_le_bytes()));
    vec![
        ("png", encoded(ImageFormat::Png)),
        ("bmp", encoded(ImageFormat::Bmp)),
        ("tga", encoded(ImageFormat::Tga)),
        ("jpg", jpeg),
        ("exr", open_exr(name)),
        ("hdr", radiance),
        ("pfm", floats),
    ]
}

fn open_exr(name: &str) -> Vec<u8> {
    let mut layers = Layers { width: WIDTH as usize, height: HEIGHT as usize, ..Layers::default() };
    for (first, name) in ["R", "G", "B"].into_iter().enumerate() {
        layers.push(name, gradient().into_iter().skip(first).step_by(3).map(f32::from));
    }
    let file = folder(&format!("open_exr_{name}")).join("a.exr");
    exr::write(&file, &layers).expect("written");
    std::fs::read(file).expect("just written")
}

/// The scene that shows a picture as a texture, or all around.
fn show(folder: &std::path::Path, ending: &str, all_around: bool) {
    let file = format!("<string name=\"filename\" value=\"picture.{ending}\"/>");
    let body = match all_around {
        true => format!("<emitter type=\"envmap\">{file}</emitter>"),
        false => format!(
            "<emitter type=\"constant\"/><bsdf type=\"diffuse\"><texture type=\"bitmap\" name=\"reflectance\">{file}</texture></bsdf>"
        ),
    };
    let scene = format!("<scene version=\"3.0.0\"><sensor type=\"perspective\"/>{body}</scene>");
    write(folder, "scene.xml", scene.as_bytes());
}

#[test]
fn a_thousand_broken_pictures_of_each_format() {
    for (ending, valid) in pictures("broken") {
        let folder = folder(&format!("broken_{ending}"));
        show(&folder, ending, false);
        write(&folder, &format!("picture.{ending}"), &valid);
        assert_eq!(outcome(&folder, ending), Ok(()), "the whole picture");
        let mut random = Random(77);
        let (mut refused, mut read) = (0, 0);
        for i in 0..1000 {
            if i == 500 {
                show(&folder, ending, true);
            }
            let mut bytes = valid.clone();
            match random.below(3) {
                // A side where a header may have one, in either order of bytes.
                0 => {
                    let side = SIDES[random.below(SIDES.len())];
                    let at = random.below(bytes.len().min(400) - 4);
                    let bytes = &mut bytes[at..at + 4];
                    bytes.copy_from_slice(&if i % 2 == 0 { side.to_le_bytes() } else { side.to_be_bytes() });
                }
                1 => {
                    let mut front: Vec<u8> = bytes.drain(..bytes.len().min(200)).collect();
                    corrupt(&mut front, &mut random, PIECES);
                    bytes.splice(0..0, front);
                }
                _ => (0..=random.below(3)).for_each(|_| corrupt(&mut bytes, &mut random, PIECES)),
            }
            if i % 2 == 0 {
                mend_checksums(&mut bytes);
            }
            write(&folder, &format!("picture.{ending}"), &bytes);
            let what = format!("{ending} {i}");
            match outcome(&folder, &what) {
                Ok(()) => read += 1,
                Err(shown) => {
                    assert_has_place(&what, &shown, &["scene.xml"]);
                    assert!(shown.contains("picture."), "{what}: no name of the picture in\n{shown}");
                    refused += 1;
                }
            }
        }
        println!("{ending}: {refused} refused, {read} read");
        assert!(refused > 100 && read > 0, "{ending}: {refused} refused, {read} read");
    }
}

/// Gives each chunk of a PNG file the checksum of what it holds now, so that the decoder looks inside. Other files stay as they are.
pub fn mend_checksums(bytes: &mut [u8]) {
    if !bytes.starts_with(SIGNATURE) {
        return;
    }
    let mut at = SIGNATURE.len();
    while let Some(length) = bytes.get(at..at + 4) {
        let length = length.iter().fold(0, |n, b| n << 8 | usize::from(*b));
        let Some(chunk) = bytes.get(at + 4..at + 8 + length) else { return };
        let mut crc = Crc::new();
        crc.update(chunk);
        let Some(sum) = bytes.get_mut(at + 8 + length..at + 12 + length) else { return };
        sum.copy_from_slice(&crc.sum().to_be_bytes());
        at += 12 + length;
    }
}

fn chunk(file: &mut Vec<u8>, kind: &[u8; 4], data: &[u8]) {
    file.extend((data.len() as u32).to_be_bytes());
    file.extend(kind);
    file.extend(data);
    file.extend([0; 4]);
}

/// A PNG file of zeros that is as large as it says.
fn png_bomb(width: u32, height: u32, depth: u8) -> Vec<u8> {
    let mut zeros = ZlibEncoder::new(Vec::new(), Compression::best());
    // Pixels of four components, and before each row the number of its filter.
    let row = vec![0; 1 + width as usize * 4 * usize::from(depth / 8)];
    (0..height).for_each(|_| zeros.write_all(&row).expect("memory"));
    let mut file = SIGNATURE.to_vec();
    let head = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[depth, 6, 0, 0, 0]].concat();
    chunk(&mut file, b"IHDR", &head);
    chunk(&mut file, b"IDAT", &zeros.finish().expect("memory"));
    chunk(&mut file, b"IEND", &[]);
    mend_checksums(&mut file);
    file
}

/// Small files that say that they are large, and some that are when they are unpacked: refused before they fill the memory.
#[test]
fn lying_sizes_and_bombs_are_refused() {
    let side = |file: &[u8], at: usize, value: &[u8]| {
        let mut file = file.to_vec();
        file[at..at + value.len()].copy_from_slice(value);
        mend_checksums(&mut file);
        file
    };
    let valid: std::collections::BTreeMap<_, _> = pictures("lying").into_iter().collect();
    let text = |head: &str| head.as_bytes().to_vec();
    let all = 65_535_u16;
    let (le, be) = ([all.to_le_bytes(); 2].concat(), [u32::from(all).to_be_bytes(); 2].concat());
    let frame = valid["jpg"].windows(2).position(|w| w == [0xff, 0xc0]).expect("a frame");
    let window = valid["exr"].windows(10).position(|w| w == b"dataWindow").expect("a window") + 21;
    let corner = |last: i32| [0, 0, last, last].map(i32::to_le_bytes).concat();
    // To the reader a bomb is a header that promises a hundred times the file, and not so much that no file could keep it.
    let bomb = [side(&valid["exr"], window, &corner(4199)), vec![0; 150_000]].concat();
    let cases = [
        ("png", "size", side(&valid["png"], 16, &be)),
        ("bmp", "size", side(&valid["bmp"], 18, &[u32::from(all).to_le_bytes(); 2].concat())),
        ("tga", "size", side(&valid["tga"], 12, &le)),
        ("jpg", "size", side(&valid["jpg"], frame + 5, &[all.to_be_bytes(); 2].concat())),
        ("exr", "size", side(&valid["exr"], window, &corner(65_534))),
        ("hdr", "size", text("#?RADIANCE\n\n-Y 65535 +X 65535\n\u{1}\u{1}\u{1}\u{1}")),
        ("hdr", "a long row", text("#?RADIANCE\n\n-Y 1 +X 67108863\n\u{1}\u{1}\u{1}\u{1}")),
        ("pfm", "size", text("PF\n65535 65535\n-1\n0123456789ab")),
        ("pfm", "overflow", text("PF\n4294967296 4294967296\n-1\n0123456789ab")),
        ("png", "bomb", png_bomb(8000, 8000, 8)),
        ("png", "a bomb of 16 bits", png_bomb(5000, 6000, 16)),
        ("exr", "bomb", bomb),
    ];
    for (ending, what, bytes) in cases {
        let folder = folder(&format!("lying_{ending}"));
        write(&folder, &format!("picture.{ending}"), &bytes);
        for all_around in [false, true] {
            show(&folder, ending, all_around);
            let what = format!("{ending}, {what}");
            let shown = outcome(&folder, &what).expect_err(&what);
            assert_has_place(&what, &shown, &["scene.xml"]);
            assert!(shown.contains(&format!("picture.{ending}")), "{what}: {shown}");
        }
    }
}
