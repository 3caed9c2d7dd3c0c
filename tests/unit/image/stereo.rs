//! Tests of `image::stereo`.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::Vec3;
use pointillist::color::profile::{TRANSFER_STEPS, rec709_from_xyz};
use pointillist::color::{Profile, TransferTable};
use pointillist::image::stereo::*;
use pointillist::image::write::FileFormat;
use pointillist::image::{Grid, ImageError};

type Encoded = Grid<[u8; 3]>;

const GLASSES: [Anaglyph; 4] =
    [Anaglyph::RedCyan, Anaglyph::GreenMagenta, Anaglyph::AmberBlue, Anaglyph::Grey];

/// A picture of greys.
fn greys(width: usize, values: &[u8]) -> Encoded {
    Grid::from_rows(width, values.len() / width, values.iter().map(|v| [*v; 3]).collect()).unwrap()
}

fn flat(rgb: [u8; 3], [width, height]: [usize; 2]) -> Encoded {
    Grid::try_filled(width, height, rgb).unwrap()
}

/// The usual display: sRGB primaries, gamma 2.2.
fn usual() -> DisplayCoding {
    DisplayCoding::new(&Profile::srgb(), 2.2)
}

/// A display whose own tone curves are a power of 2.4.
fn with_curves() -> DisplayCoding {
    let signal = |i: usize| [(i as f32 / (TRANSFER_STEPS - 1) as f32).powf(2.0 / 2.4); 3];
    let table = TransferTable((0..TRANSFER_STEPS).map(signal).collect::<Arc<[[f32; 3]]>>());
    // The gamma counts for nothing where there is a table.
    DisplayCoding::new(&Profile { transfer: Some(table), ..Profile::srgb() }, 1.0)
}

fn composed(eyes: [&Encoded; 2], layout: StereoLayout) -> (usize, Vec<u8>) {
    let picture = compose(eyes, layout, &usual()).unwrap();
    (picture.width(), picture.pixels().iter().map(|rgb| rgb[0]).collect())
}

#[test]
fn pixels_stand_where_the_layout_says() {
    let left = greys(2, &[1, 2, 3, 4]);
    let right = greys(2, &[11, 12, 13, 14]);
    for (name, width, expected) in [
        ("side-by-side", 4, &[1, 2, 11, 12, 3, 4, 13, 14][..]),
        ("cross-eyed", 4, &[11, 12, 1, 2, 13, 14, 3, 4]),
        ("over-under", 2, &[1, 2, 3, 4, 11, 12, 13, 14]),
        ("row-interlaced", 2, &[1, 2, 13, 14]),
        ("column-interlaced", 2, &[1, 12, 3, 14]),
        ("checkerboard", 2, &[1, 12, 13, 4]),
    ] {
        let layout = StereoLayout::named(name).unwrap();
        assert_eq!(composed([&left, &right], layout), (width, expected.to_vec()), "{name}");
    }
}

/// What a window shows in layers is side by side in one picture: no eye is lost.
#[test]
fn layers_are_composed_side_by_side() {
    let (left, right) = (greys(2, &[1, 2, 3, 4]), greys(2, &[11, 12, 13, 14]));
    let beside = composed([&left, &right], StereoLayout::SideBySide);
    assert_eq!(composed([&left, &right], StereoLayout::Swapchain), beside);
    assert!(StereoLayout::ALL.into_iter().all(|layout| layout.in_one_picture() == layout));
    assert_eq!(StereoLayout::Swapchain.size([2, 2]), Some([2, 2]));
}

/// Black and white make the value of half the light, 0.5^(1/2.2) of 255, and not the 128 of half the signal; nothing is dropped.
#[test]
fn half_layouts_average_light() {
    let (left, right) = (greys(4, &[0, 255, 90, 90]), greys(4, &[255, 255, 255, 0]));
    assert_eq!(composed([&left, &right], StereoLayout::SideBySideHalf), (4, vec![186, 90, 255, 186]));
    let (left, right) = (greys(1, &[0, 255, 90, 90]), greys(1, &[255, 255, 255, 0]));
    assert_eq!(composed([&left, &right], StereoLayout::OverUnderHalf), (1, vec![186, 90, 255, 186]));
    // The last pixel of three stands alone.
    let (left, right) = (greys(3, &[0, 255, 7]), greys(3, &[255, 0, 8]));
    assert_eq!(composed([&left, &right], StereoLayout::SideBySideHalf), (4, vec![186, 7, 186, 8]));
    let half = compose([&left, &right], StereoLayout::SideBySideHalf, &with_curves()).unwrap();
    assert_eq!(half.at(0, 0), [191; 3], "0.5^(1/2.4)");
}

#[test]
fn values_survive_decoding_and_encoding() {
    for (name, coding) in [("gamma", usual()), ("sRGB", DisplayCoding::srgb()), ("curves", with_curves())] {
        for value in 0..=255u8 {
            assert_eq!(coding.encode(coding.decode([value; 3])), [value; 3], "{name}");
        }
        assert_eq!(coding.encode(Vec3::new(-1.0, 2.0, f32::NAN)), [0, 255, 0], "{name}");
    }
}

/// Equal greys of both eyes stay what they are, through all glasses and on all displays.
#[test]
fn anaglyphs_keep_greys() {
    let values: Vec<u8> = (0..=255).collect();
    let ramp = greys(256, &values);
    for profile in Profile::names() {
        let coding = DisplayCoding::new(&Profile::named(profile).unwrap(), 2.2);
        for glasses in GLASSES {
            let mixed = compose([&ramp, &ramp], StereoLayout::Anaglyph(glasses), &coding).unwrap();
            assert_eq!(mixed, ramp, "{glasses:?} on {profile}");
        }
    }
}

/// Rows of the published matrices sum to 1 within their rounding: of the copies with other signs that are in circulation none does.
#[test]
fn dubois_matrices_keep_white() {
    for glasses in GLASSES {
        let [left, right] = glasses.matrices();
        for c in 0..3 {
            let sum: f32 = left[c].iter().chain(&right[c]).sum();
            assert!((sum - 1.0).abs() < 1.5e-3, "{glasses:?} row {c}: {sum}");
        }
    }
}

/// A white left eye is the colour of the left filter and a white right eye that of the right one; primaries go by the published numbers.
#[test]
fn anaglyphs_are_the_published_products() {
    let of = |glasses, left: [u8; 3], right: [u8; 3]| {
        let eyes = [flat(left, [1, 1]), flat(right, [1, 1])];
        compose([&eyes[0], &eyes[1]], StereoLayout::Anaglyph(glasses), &usual()).unwrap().at(0, 0)
    };
    // The value of a linear number.
    let value = |linear: f64| (255.0 * linear.clamp(0.0, 1.0).powf(1.0 / 2.2)).round() as u8;
    let (white, black) = ([255; 3], [0; 3]);
    assert_eq!(of(Anaglyph::RedCyan, white, black), [255, 0, 0]);
    assert_eq!(of(Anaglyph::RedCyan, black, white), [0, 255, 255]);
    assert_eq!(of(Anaglyph::GreenMagenta, white, black), [0, 255, 0]);
    assert_eq!(of(Anaglyph::GreenMagenta, black, white), [255, 0, 255]);
    assert_eq!(of(Anaglyph::AmberBlue, white, black), [255, value(0.950), 0]);
    assert_eq!(of(Anaglyph::AmberBlue, black, white), [0, value(0.051), 255]);
    assert_eq!(of(Anaglyph::RedCyan, [255, 0, 0], black), [value(0.437), 0, 0]);
    assert_eq!(
        of(Anaglyph::RedCyan, [0, 0, 255], [0, 255, 0]),
        [value(0.164 - 0.032), value(0.761 - 0.024), 0]
    );
    assert_eq!(of(Anaglyph::Grey, [0, 255, 0], [255, 0, 0]), [value(0.7152), value(0.2126), value(0.2126)]);
}

/// The same light on a display of wider primaries gives an anaglyph of the same light; the matrices on its own numbers would not.
#[test]
fn anaglyphs_do_not_depend_on_the_primaries() {
    let lights = [Vec3::new(0.8, 0.1, 0.1), Vec3::new(0.1, 0.7, 0.2)];
    let [of_left, of_right] = Anaglyph::RedCyan.matrices();
    let products = |[left, right]: [Vec3; 2]| {
        Vec3::from([0, 1, 2].map(|c| Vec3::from(of_left[c]).dot(left) + Vec3::from(of_right[c]).dot(right)))
            .clamp(Vec3::ZERO, Vec3::ONE)
    };
    let expected = products(lights);
    for profile in ["display-p3", "rec2020"].map(|name| Profile::named(name).unwrap()) {
        let coding = DisplayCoding::new(&profile, 2.2);
        assert!(!coding.is_rec709());
        let to_own = profile.from_xyz * rec709_from_xyz().inverse();
        let eyes = lights.map(|light| flat(coding.encode(to_own * light), [1, 1]));
        let mixed = compose([&eyes[0], &eyes[1]], StereoLayout::Anaglyph(Anaglyph::RedCyan), &coding);
        let seen = to_own.inverse() * coding.decode(mixed.unwrap().at(0, 0));
        let naive = to_own.inverse() * products(lights.map(|light| to_own * light));
        assert!((seen - expected).abs().max_element() < 0.012, "{}: {seen} for {expected}", profile.name);
        assert!((naive - expected).abs().max_element() > 0.05, "{}: {naive} for {expected}", profile.name);
    }
}

#[test]
fn layouts_are_known_by_their_names() {
    for (i, layout) in StereoLayout::ALL.into_iter().enumerate() {
        assert_eq!(StereoLayout::named(layout.name()), Some(layout));
        let others = &StereoLayout::ALL[..i];
        assert!(others.iter().all(|other| other.name() != layout.name() && other.label() != layout.label()));
    }
    assert_eq!(StereoLayout::named("toed-in"), None);
    assert_eq!(StereoLayout::named(StereoLayout::Swapchain.name()), None, "it is no picture");
}

#[test]
fn eyes_of_different_sizes_are_refused() {
    let (left, right) = (flat([0; 3], [3, 2]), flat([0; 3], [2, 3]));
    for layout in StereoLayout::ALL {
        let error = compose([&left, &right], layout, &usual()).unwrap_err();
        assert_eq!(error, StereoError::Size { left: [3, 2], right: [2, 3] });
        assert!(error.to_string().contains("3×2") && error.to_string().contains("2×3"), "{error}");
        let none = flat([0; 3], [0, 0]);
        assert!(compose([&none, &none], layout, &usual()).unwrap().pixels().is_empty());
        let grows = layout.name().starts_with("side") || layout.name().starts_with("over");
        assert_eq!(layout.size([usize::MAX; 2]).is_none(), grows || layout == StereoLayout::CrossEyed);
    }
}

/// The folder that files of these tests are written to; they stay there for other readers to be tried on.
fn folder() -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("stereo");
    fs::create_dir_all(&folder).unwrap();
    folder
}

/// Colours that JPEG keeps apart, with a bright column that tells left from right.
fn eyes() -> [Encoded; 2] {
    [[200, 40, 30], [30, 60, 200]].map(|rgb| {
        let mut eye = flat(rgb, [48, 32]);
        (0..32).for_each(|y| eye.row_mut(y)[..8].fill([240; 3]));
        eye
    })
}

/// The application segments of a JPEG: number, place of the bytes, and the bytes.
fn segments(jpeg: &[u8]) -> Vec<(u8, usize, Vec<u8>)> {
    assert_eq!(jpeg[..2], [0xff, 0xd8]);
    let (mut at, mut found) = (2, Vec::new());
    while jpeg[at + 1] != 0xda {
        assert_eq!(jpeg[at], 0xff);
        let length = usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
        if let number @ 0xe0..=0xef = jpeg[at + 1] {
            found.push((number - 0xe0, at + 4, jpeg[at + 4..at + 2 + length].to_vec()));
        }
        at += 2 + length;
    }
    found
}

fn is_near(found: [u8; 3], wanted: [u8; 3]) -> bool {
    found.iter().zip(wanted).all(|(a, b)| a.abs_diff(b) <= 6)
}

#[test]
fn jps_files_are_cross_eyed_and_say_so() {
    let path = folder().join("pair.jps");
    let [left, right] = eyes();
    write_jps(&path, [&left, &right], &DisplayCoding::srgb()).unwrap();
    let bytes = fs::read(&path).unwrap();
    let segments = segments(&bytes);
    let (_, _, descriptor) = segments.iter().find(|(number, ..)| *number == 3).unwrap();
    // Length 4 of: no separation, no flag that the left eye comes first, side by side, stereo. Then an empty comment.
    assert_eq!(descriptor[..], *b"_JPSJPS_\0\x04\0\0\x02\x01\0\0");
    let picture = image::load_from_memory_with_format(&bytes, image::ImageFormat::Jpeg).unwrap().into_rgb8();
    assert_eq!(picture.dimensions(), (96, 32));
    assert!(is_near(picture.get_pixel(30, 16).0, [30, 60, 200]), "the right eye is at the left");
    assert!(is_near(picture.get_pixel(78, 16).0, [200, 40, 30]), "the left eye is at the right");
}

/// A value of a directory of the multi-picture format, by its tag: its bytes, wherever they are.
fn entry(header: &[u8], directory: usize, tag: u16) -> Vec<u8> {
    let u16_at = |at: usize| u16::from_le_bytes([header[at], header[at + 1]]);
    let u32_at = |at: usize| u32::from_le_bytes(header[at..at + 4].try_into().unwrap()) as usize;
    let tags: Vec<u16> =
        (0..usize::from(u16_at(directory))).map(|i| u16_at(directory + 2 + 12 * i)).collect();
    assert!(tags.is_sorted(), "{tags:x?}");
    let at = directory + 2 + 12 * tags.iter().position(|known| *known == tag).unwrap();
    let size = u32_at(at + 4) * [0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8][usize::from(u16_at(at + 2))];
    let value = if size > 4 { u32_at(at + 8) } else { at + 8 };
    header[value..value + size].to_vec()
}

#[test]
fn mpo_files_tell_where_both_eyes_are() {
    let path = folder().join("pair.mpo");
    let [left, right] = eyes();
    write_mpo(&path, [&left, &right], &DisplayCoding::srgb()).unwrap();
    let bytes = fs::read(&path).unwrap();
    let mpf = |jpeg: &[u8]| segments(jpeg).into_iter().find(|(number, ..)| *number == 2).unwrap();
    let (_, at, segment) = mpf(&bytes);
    assert_eq!(segment[..12], *b"MPF\0II\x2a\0\x08\0\0\0");
    let header = &segment[4..];
    assert_eq!((entry(header, 8, 0xb000), entry(header, 8, 0xb001)), (b"0100".to_vec(), vec![2, 0, 0, 0]));
    let images = entry(header, 8, 0xb002);
    let number = |i: usize| u32::from_le_bytes(images[4 * i..4 * i + 4].try_into().unwrap()) as usize;
    // Representative, JPEG, multi-frame disparity.
    assert_eq!((number(0), number(4)), (0x2002_0002, 0x0002_0002));
    assert_eq!((number(2), number(1) + number(5)), (0, bytes.len()));
    let second = at + 4 + number(6);
    assert_eq!(second, number(1));
    for (jpeg, rgb) in [(&bytes[..second], [200, 40, 30]), (&bytes[second..], [30, 60, 200])] {
        assert_eq!(jpeg[jpeg.len() - 2..], [0xff, 0xd9]);
        let picture =
            image::load_from_memory_with_format(jpeg, image::ImageFormat::Jpeg).unwrap().into_rgb8();
        assert!(picture.dimensions() == (48, 32) && is_near(picture.get_pixel(30, 16).0, rgb));
    }
    // Viewpoints count from the left; the base is the first.
    let next = 8 + 2 + 12 * 3;
    let next = u32::from_le_bytes(header[next..next + 4].try_into().unwrap()) as usize;
    let (_, _, of_second) = mpf(&bytes[second..]);
    for (header, directory, viewpoint) in [(header, next, 1), (&of_second[4..], 8, 2)] {
        assert_eq!(entry(header, directory, 0xb101), [viewpoint, 0, 0, 0]);
        assert_eq!(entry(header, directory, 0xb204), [1, 0, 0, 0]);
        assert_eq!(entry(header, directory, 0xb205), [0, 0, 0, 0, 1, 0, 0, 0]);
        assert_eq!(entry(header, directory, 0xb206), [0xff; 8]);
    }
}

/// JPEG values are read as sRGB: those of another power are converted, and wider primaries refused.
#[test]
fn jpeg_files_show_the_same_light() {
    let path = folder().join("gamma.mpo");
    let eye = flat([100, 150, 200], [16, 16]);
    let coding = DisplayCoding::new(&Profile::srgb(), 1.6);
    write_mpo(&path, [&eye, &eye], &coding).unwrap();
    let bytes = fs::read(&path).unwrap();
    let picture = image::load_from_memory_with_format(&bytes, image::ImageFormat::Jpeg).unwrap().into_rgb8();
    let expected = DisplayCoding::srgb().encode(coding.decode([100, 150, 200]));
    assert!(!is_near(expected, [100, 150, 200]) && is_near(picture.get_pixel(8, 8).0, expected));
    let refused = |written: Result<(), ImageError>, part: &str| {
        let error = written.unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("none."), "{error}");
    };
    let [jps, mpo] = ["none.jps", "none.mpo"].map(|name| folder().join(name));
    let wide = DisplayCoding::new(&Profile::rec2020(), 2.2);
    refused(write_jps(&jps, [&eye, &eye], &wide), "wider primaries");
    refused(write_mpo(&mpo, [&eye, &eye], &wide), "wider primaries");
    let other = flat([0; 3], [16, 15]);
    refused(write_jps(&jps, [&eye, &other], &coding), "16×15");
    refused(write_mpo(&mpo, [&eye, &other], &coding), "16×15");
    let long = flat([0; 3], [40_000, 1]);
    refused(write_jps(&jps, [&long, &long], &coding), "80000×1");
    let none = flat([0; 3], [0, 0]);
    assert!(
        write_jps(&jps, [&none, &none], &coding).is_err()
            && write_mpo(&mpo, [&none, &none], &coding).is_err()
    );
    assert!(!jps.exists() && !mpo.exists());
}

#[test]
fn formats_and_pairs_go_by_the_name() {
    for (name, format) in [
        ("a.exr", StereoFormat::Plain(FileFormat::Exr)),
        ("a.PNG", StereoFormat::Plain(FileFormat::Png)),
        ("a.JPS", StereoFormat::Jps),
        ("b/a.mpo", StereoFormat::Mpo),
    ] {
        assert_eq!(StereoFormat::of(Path::new(name)).unwrap(), format);
    }
    for name in ["a", "a.jpg", "mpo"] {
        let error = StereoFormat::of(Path::new(name)).unwrap_err().to_string();
        assert!(error.contains(".jps or .mpo"), "{error}");
    }
    let pair = pair_paths(Path::new("b/a.b.png"));
    assert_eq!(pair, ["b/a.b_left.png", "b/a.b_right.png"].map(PathBuf::from));
}
