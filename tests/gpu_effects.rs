//! Effects of the display on the Vulkan device: internal resolution, curves, dither, outputs, against their twins.

mod gpu_support;

use glam::Vec3;
use gpu_support::{assert_silent, film, gpu, scene, settings, spec};
use pointillist::client::film::VulkanFilm;
use pointillist::client::reference::tonemap::{DisplayParameters, tone_curve, tonemap};
use pointillist::client::{Dither, Output, Reconstruction, Settings, SplatFilter, ToneCurve};
use pointillist::color::{Profile, TransferTable};
use pointillist::gpu::{Region, read_image};
use pointillist::image::Grid;

/// What `paint` shows at this internal resolution, its texels' bytes.
fn painted(film: &mut VulkanFilm, settings: &Settings, detail: u32) -> Vec<u8> {
    let gpu = gpu().clone();
    film.flush().expect("flush");
    let extent = [film.spec().width, film.spec().height];
    let mut frame = gpu.begin().expect("a frame");
    film.paint(&mut frame.cmd(), settings, detail).expect("paint");
    frame.submit().expect("submit");
    // Recorded twice: the image is lent for one call.
    let mut frame = gpu.begin().expect("a frame");
    let image = film.paint(&mut frame.cmd(), settings, detail).expect("paint");
    frame.submit().expect("submit");
    read_image(&gpu, image, Region { origin: [0, 0], extent }).expect("read")
}

/// Detail 1 is the picture as ever; coarser ones are close to it, smooth, and of full size.
#[test]
fn coarse_pictures_are_interpolated() {
    let spec = spec(101, 67, SplatFilter::Gaussian);
    let mut film = film(spec);
    film.add(&scene(&spec, 60_000, 5, 0)).expect("add");
    let settings = settings(Reconstruction::Gaussian, 0.0);
    let fine = painted(&mut film, &settings, 1);
    let shown = film.display(&settings).expect("display");
    assert!(fine.chunks_exact(4).zip(&shown.rgb).all(|(a, b)| a[..3] == b[..]), "paint differs from display");
    for detail in [2u32, 4] {
        let coarse = painted(&mut film, &settings, detail);
        let xyz = film.reconstruct_coarse(&settings, detail).expect("reconstruct");
        assert_eq!(xyz.len() as u32, 101u32.div_ceil(detail) * 67u32.div_ceil(detail));
        let mean = |v: &[u8]| v.iter().map(|c| f64::from(*c)).sum::<f64>() / v.len() as f64;
        assert!((mean(&coarse) / mean(&fine) - 1.0).abs() < 0.02, "detail {detail} changes the mean");
        // The edge in the middle: interpolated, it takes at least two steps; enlarged pixels would take it in one.
        let row = &coarse[101 * 4 * 30..][..101 * 4];
        let across: Vec<_> = (44..58).map(|x| row[4 * x].abs_diff(row[4 * x + 4])).collect();
        let (total, most) =
            (u32::from(row[4 * 58].abs_diff(row[4 * 44])), across.iter().max().map(|s| u32::from(*s)));
        assert!(total > 40 && most < Some(total * 6 / 10), "detail {detail}: {across:?} of {total}");
    }
    assert_silent(gpu());
}

/// Every combination that is compiled apart: the GPU's bytes against the twin's, from the same XYZ.
#[test]
fn tone_maps_equal_the_twin() {
    let spec = spec(70, 66, SplatFilter::Gaussian);
    let mut film = film(spec);
    film.add(&scene(&spec, 40_000, 78, 0)).expect("add");
    let base = settings(Reconstruction::Gaussian, 0.0);
    let xyz = film.reconstruct(&base).expect("reconstruct");
    let grid = Grid::from_rows(70, 66, xyz.iter().map(|v| Vec3::from_array(*v)).collect()).expect("a grid");
    let mut table = Profile::named("display-p3").expect("a listed name");
    let srgb = |i: usize| (i as f32 / 1023.0).powi(2).powf(1.0 / 2.4);
    table.transfer = Some(TransferTable((0..1024).map(|i| [srgb(i), srgb(i).sqrt(), srgb(i)]).collect()));
    for curve in [ToneCurve::Paper, ToneCurve::PbrNeutral, ToneCurve::AgX] {
        for dither in [Dither::None, Dither::Ordered, Dither::BlueNoise] {
            for profile in [Profile::srgb(), table.clone()] {
                let settings =
                    Settings { curve, dither, profile, exposure: 1.5, contrast: 1.2, ..base.clone() };
                let shown = film.display(&settings).expect("display");
                let wanted = tonemap(&grid, &DisplayParameters::from(&settings));
                let pairs = || shown.rgb.iter().flatten().zip(wanted.rgb.iter().flatten());
                let off = pairs().filter(|(a, b)| a != b).count();
                let what = format!("{curve:?} {dither:?} {}", settings.profile.name);
                assert!(pairs().all(|(a, b)| a.abs_diff(*b) <= 1), "{what}: more than one step apart");
                assert!(off * 100 < shown.rgb.len() * 3, "{what}: {off} channels are off by one");
            }
        }
    }
    assert_silent(gpu());
}

/// Pictures for HDR displays, before they are cut to a window's format.
#[test]
fn hdr_outputs_equal_the_twin() {
    let spec = spec(40, 30, SplatFilter::Gaussian);
    let mut film = film(spec);
    film.add(&scene(&spec, 20_000, 79, 0)).expect("add");
    for curve in [ToneCurve::Paper, ToneCurve::PbrNeutral, ToneCurve::AgX] {
        let base = Settings { curve, exposure: 2.0, ..settings(Reconstruction::Gaussian, 0.0) };
        let xyz = film.reconstruct(&base).expect("reconstruct");
        for output in [Output::ScRgb, Output::Hdr10] {
            let settings = Settings { output, ..base.clone() };
            let p = DisplayParameters::from(&settings);
            let bytes = painted(&mut film, &settings, 1);
            let mut brightest = 0.0f32;
            for (i, xyz) in xyz.iter().enumerate() {
                let wanted = p.signal(Vec3::from_array(*xyz));
                let got = match output {
                    Output::ScRgb => {
                        [0, 1, 2].map(|c| half([bytes[8 * i + 2 * c], bytes[8 * i + 2 * c + 1]]))
                    }
                    _ => {
                        let word = u32::from_le_bytes([0, 1, 2, 3].map(|b| bytes[4 * i + b]));
                        [0, 10, 20].map(|shift| ((word >> shift) & 1023) as f32 / 1023.0)
                    }
                };
                brightest = brightest.max(wanted.max_element());
                let worst = (Vec3::from(got) - wanted).abs().max_element();
                let bound = if output == Output::ScRgb {
                    1.5e-3 * wanted.max_element().max(0.1)
                } else {
                    0.6 / 1023.0
                };
                assert!(worst < bound, "{curve:?} {output:?}: {got:?} instead of {wanted}");
            }
            // Highlights lie above diffuse white: 203/80 in scRGB, 0.58 in PQ; AgX ends there.
            let white = if output == Output::ScRgb { 203.0 / 80.0 } else { 0.5807 };
            assert_eq!(
                brightest > white + 1e-3,
                curve != ToneCurve::AgX,
                "{curve:?} {output:?}: {brightest}"
            );
        }
    }
    assert_silent(gpu());
}

/// A half float, of normal range.
fn half(bytes: [u8; 2]) -> f32 {
    let bits = u32::from(u16::from_le_bytes(bytes));
    let (exponent, fraction) = ((bits >> 10) & 31, bits & 1023);
    match exponent {
        0 => fraction as f32 / 16_777_216.0,
        _ => f32::from_bits(((exponent + 112) << 23) | (fraction << 13)),
    }
}

/// P5 for every curve: the whole range of floats gives finite values in range.
#[test]
fn every_number_has_a_colour() {
    let values =
        [0.0, -1.0, f32::MIN_POSITIVE / 1024.0, 1e-30, 1e-3, 1.0, 1e10, f32::MAX, f32::INFINITY, f32::NAN];
    for curve in [ToneCurve::Paper, ToneCurve::PbrNeutral, ToneCurve::AgX] {
        for output in [Output::Sdr, Output::ScRgb, Output::Hdr10] {
            for (exposure, contrast) in [(1.0, 1.0), (1e-6, 0.3), (1e6, 3.0)] {
                let settings = Settings { curve, output, exposure, contrast, ..Settings::default() };
                let p = DisplayParameters::from(&settings);
                let top = if output == Output::ScRgb { p.ceiling() * 203.0 / 80.0 } else { 1.0 };
                for i in 0..values.len().pow(3) {
                    let n = values.len();
                    let xyz = Vec3::new(values[i % n], values[i / n % n], values[i / n / n]);
                    let got = p.signal(xyz);
                    assert!(
                        got.to_array().iter().all(|c| (0.0..=top * 1.000_01).contains(c)),
                        "{curve:?} {output:?}: {xyz} became {got}"
                    );
                }
            }
        }
    }
}

/// Gamut mapping leaves luminance alone, whatever the primaries.
#[test]
fn desaturation_keeps_luminance() {
    for name in Profile::names() {
        let settings =
            Settings { profile: Profile::named(name).expect("a listed name"), ..Settings::default() };
        let p = DisplayParameters::from(&settings);
        let back = settings.profile.from_xyz.inverse();
        for (x, z) in [(0.2, 3.0), (2.0, 0.01), (1.6, 0.0), (0.5, 0.2), (0.95, 1.09)] {
            for y in [0.01, 0.3, 2.0] {
                let rgb = p.linear(Vec3::new(x, 1.0, z) * y);
                let wanted = tone_curve(y, 1.0, 1.0);
                let luminance = (back * rgb).y;
                assert!((luminance - wanted).abs() < 2e-5, "{name}: {luminance} instead of {wanted}");
            }
        }
    }
}
