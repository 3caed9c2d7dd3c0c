//! ICC profiles made here, read back: matrices, curves, and every way in which a file may be damaged.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use glam::{DMat3, DVec3, Vec3};
use pointillist::color::icc::parse;
use pointillist::color::{Profile, cie};
use pointillist::image::png::{self, PngPicture, Transfer};

fn fixed(v: f64) -> [u8; 4] {
    ((v * 65536.0).round() as i32).to_be_bytes()
}

fn numbers(kind: &[u8; 4], values: &[f64]) -> Vec<u8> {
    let mut tag = [kind, &[0; 4][..]].concat();
    values.iter().for_each(|v| tag.extend(fixed(*v)));
    tag
}

/// A `para` of one kind.
fn para(kind: u16, values: &[f64]) -> Vec<u8> {
    let mut tag = [&b"para"[..], &[0; 4], &kind.to_be_bytes(), &[0; 2]].concat();
    values.iter().for_each(|v| tag.extend(fixed(*v)));
    tag
}

fn curv(values: &[u16]) -> Vec<u8> {
    let mut tag = [&b"curv"[..], &[0; 4], &(values.len() as u32).to_be_bytes()].concat();
    values.iter().for_each(|v| tag.extend(v.to_be_bytes()));
    tag
}

/// A profile file of these tags.
fn file(tags: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let mut head = vec![0u8; 128];
    head[12..24].copy_from_slice(b"mntrRGB XYZ ");
    head[36..40].copy_from_slice(b"acsp");
    head.extend((tags.len() as u32).to_be_bytes());
    let mut data = Vec::new();
    let start = head.len() + 12 * tags.len();
    for (name, tag) in tags {
        head.extend(*name);
        head.extend(((start + data.len()) as u32).to_be_bytes());
        head.extend((tag.len() as u32).to_be_bytes());
        data.extend(tag);
        data.resize(data.len().next_multiple_of(4), 0);
    }
    head.extend(data);
    let size = (head.len() as u32).to_be_bytes();
    head[..4].copy_from_slice(&size);
    head
}

/// Columns for D50 of a named profile, adapted with Bradford's matrix, and that adaptation.
fn colorants(name: &str) -> ([DVec3; 3], DMat3) {
    let cones =
        DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);
    let ratio = (cones * DVec3::new(0.9642, 1.0, 0.8249)) / (cones * cie::d65_white());
    let chad = cones.inverse() * DMat3::from_diagonal(ratio) * cones;
    let to_xyz = chad * Profile::named(name).expect("a listed name").from_xyz.as_dmat3().inverse();
    ([to_xyz.x_axis, to_xyz.y_axis, to_xyz.z_axis], chad)
}

fn profile(name: &str, curve: Vec<u8>, with_chad: bool) -> Vec<u8> {
    let ([r, g, b], chad) = colorants(name);
    let xyz = |c: DVec3| numbers(b"XYZ ", &c.to_array());
    let mut tags = vec![(b"rXYZ", xyz(r)), (b"gXYZ", xyz(g)), (b"bXYZ", xyz(b))];
    tags.extend([b"rTRC", b"gTRC", b"bTRC"].map(|name| (name, curve.clone())));
    if with_chad {
        tags.push((b"chad", numbers(b"sf32", &chad.transpose().to_cols_array())));
    }
    file(&tags)
}

#[test]
fn matrices_are_brought_to_d65() {
    for name in Profile::names() {
        for with_chad in [true, false] {
            let read = parse(&profile(name, curv(&[563]), with_chad)).expect("a profile");
            let wanted = Profile::named(name).expect("a listed name");
            // Numbers of 16 bits after the point, times the condition of the matrix.
            assert!(read.from_xyz.abs_diff_eq(wanted.from_xyz, 1e-3), "{name}: {}", read.from_xyz);
            let white = read.from_xyz * cie::d65_white().as_vec3();
            assert!((white - 1.0).abs().max_element() < 1e-5, "{name}: white is {white}");
            for (a, b) in read.primaries.into_iter().zip(wanted.primaries) {
                assert!((a - b).abs().max_element() < 1e-3, "{name}: {a} instead of {b}");
            }
        }
    }
}

/// Signal to luminance.
type ToLinear<'a> = &'a dyn Fn(f64) -> f64;

#[test]
fn curves_are_inverted() {
    let srgb = |x: f64| if x < 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
    let samples: Vec<u16> =
        (0..1024).map(|i| (srgb(f64::from(i) / 1023.0) * 65535.0).round() as u16).collect();
    let parameters = [2.4, 1.0 / 1.055, 0.055 / 1.055, 1.0 / 12.92, 0.04045];
    let cases: [(&str, Vec<u8>, ToLinear<'_>); 5] = [
        ("sRGB by parameters", para(3, &parameters), &srgb),
        ("sRGB by samples", curv(&samples), &srgb),
        ("gamma 2.2", curv(&[563]), &|x: f64| x.powf(563.0 / 256.0)),
        ("gamma 1.8", para(0, &[1.8]), &|x: f64| x.powf(1.8)),
        ("linear", curv(&[]), &|x: f64| x),
    ];
    for (what, curve, to_linear) in cases {
        let table = parse(&profile("srgb", curve, true)).expect("a profile").transfer.expect("a table");
        for i in 0..=255 {
            let signal = f64::from(i) / 255.0;
            let got = f64::from(table.apply(Vec3::splat(to_linear(signal) as f32)).x);
            // A quarter of a step of 8 bits.
            assert!((got - signal).abs() < 1e-3, "{what}: {signal} came back as {got}");
        }
    }
}

/// A PNG file of values that a profile has encoded holds that profile, byte by byte, and no power or primaries that would say something else.
#[test]
fn pictures_hold_the_profile_that_encoded_them() {
    let bytes = profile("display-p3", para(0, &[1.8]), true);
    let read = parse(&bytes).expect("a profile");
    assert_eq!(Transfer::of(&read, 2.2), Transfer::Icc(&bytes));
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("profile.png");
    for profile in [read, Profile::named("display-p3").expect("a listed name")] {
        let (transfer, primaries) = (Transfer::of(&profile, 2.2), profile.primaries);
        let picture =
            PngPicture { width: 2, height: 1, rgb: &[[10, 20, 30], [40, 50, 60]], transfer, primaries };
        png::write(&path, picture, &[]).expect("write");
        let file = BufReader::new(File::open(&path).expect("a file"));
        let reader = ::png::Decoder::new(file).read_info().expect("a PNG file");
        let info = reader.info();
        assert_eq!(info.icc_profile.as_deref(), profile.icc.as_deref());
        assert_eq!(info.icc_profile.as_deref().is_some_and(|held| held == bytes), profile.icc.is_some());
        let has_power = profile.icc.is_none();
        assert_eq!((info.gama_chunk.is_some(), info.chrm_chunk.is_some()), (has_power, has_power));
        assert!(info.srgb.is_none());
        let shown = image::open(&path).expect("a picture").into_rgb8();
        assert_eq!(shown.as_raw()[..], [10, 20, 30, 40, 50, 60]);
    }
}

#[test]
fn bad_files_are_refused() {
    let good = profile("srgb", curv(&[563]), true);
    // Cut anywhere, with any byte changed: an answer, never a panic.
    for end in 0..good.len() {
        let _ = parse(&good[..end]);
    }
    for at in (0..good.len()).step_by(3) {
        for value in [0, 0xff] {
            let mut bad = good.clone();
            bad[at] = value;
            if let Ok(profile) = parse(&bad) {
                let table = profile.transfer.expect("a table");
                assert!(profile.from_xyz.is_finite());
                assert!(table.0.iter().flatten().all(|v| (0.0..=1.0).contains(v)));
            }
        }
    }
    let message = |bytes: &[u8]| parse(bytes).expect_err("a bad profile was taken").to_string();
    assert!(message(b"a text").contains("no ICC profile"));
    assert!(message(&good[..300]).contains("ends before"));
    assert!(message(&file(&[])).contains("rXYZ"));
    assert!(message(&file(&[(b"A2B0", vec![0; 40])])).contains("table of colours"));
    assert!(message(&profile("srgb", curv(&[65535, 0]), true)).contains("rise"));
}
