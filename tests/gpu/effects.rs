//! Effects of the display on the Vulkan device: internal resolution, curves, dither, outputs, against their references.

use crate::common::{Both, assert_one_step, assert_silent, film, gpu, scene, settings, spec};
use glam::Vec3;
use pointillist::client::film::VulkanFilm;
use pointillist::client::reference::tonemap::{ToneMapper, tonemap};
use pointillist::client::{
    ColorOutput, DisplayView, Dither, Film, Masking, Reconstruction, Settings, SplatFilter, ToneCurve,
};
use pointillist::color::{Profile, TransferTable, Xyz, pq};
use pointillist::gpu::{Region, read_image};
use pointillist::image::Grid;
use pointillist::math::random::Random;
use pointillist::stream::Sample;

/// What `paint` shows at this internal resolution, its texels' bytes.
fn painted(film: &mut VulkanFilm, settings: &Settings, detail: u32) -> Vec<u8> {
    let gpu = gpu().clone();
    film.flush().expect("flush");
    let extent = [film.spec().width, film.spec().height];
    let mut frame = gpu.begin().expect("a frame");
    film.paint(&mut frame.cmd(), settings, detail, &mut []).expect("paint");
    frame.submit().expect("submit");
    // Recorded twice: the image is lent for one call.
    let mut frame = gpu.begin().expect("a frame");
    let image = film.paint(&mut frame.cmd(), settings, detail, &mut []).expect("paint");
    frame.submit().expect("submit");
    read_image(&gpu, image, 0, Region { origin: [0, 0], extent }).expect("read")
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
        let xyz = film.reconstruct(&settings, detail).expect("reconstruct");
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

/// Every combination that is compiled apart: the GPU's bytes against the reference's, from the same XYZ.
#[test]
fn tone_maps_equal_the_reference() {
    let spec = spec(70, 66, SplatFilter::Gaussian);
    let mut film = film(spec);
    film.add(&scene(&spec, 40_000, 78, 0)).expect("add");
    let base = settings(Reconstruction::Gaussian, 0.0);
    let xyz = film.reconstruct(&base, 1).expect("reconstruct");
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
                let wanted = tonemap(&grid, &settings);
                let what = format!("{curve:?} {dither:?} {}", settings.profile.name);
                assert_one_step(&shown, &wanted, 100, &what);
            }
        }
    }
    assert_silent(gpu());
}

/// Pictures for HDR displays, before they are cut to a window's format.
#[test]
fn hdr_outputs_equal_the_reference() {
    let spec = spec(40, 30, SplatFilter::Gaussian);
    let mut film = film(spec);
    film.add(&scene(&spec, 20_000, 79, 0)).expect("add");
    for curve in [ToneCurve::Paper, ToneCurve::PbrNeutral, ToneCurve::AgX] {
        let base = Settings { curve, exposure: 2.0, ..settings(Reconstruction::Gaussian, 0.0) };
        let xyz = film.reconstruct(&base, 1).expect("reconstruct");
        let (scrgb, hdr10) = (ColorOutput::ScRgb, ColorOutput::Hdr10);
        for (output, peak) in [(scrgb, 1000), (hdr10, 1000), (scrgb, 400), (hdr10, 400), (hdr10, 4000)] {
            let settings = Settings { output, peak, ..base.clone() };
            let p = ToneMapper::new(&settings);
            let bytes = painted(&mut film, &settings, 1);
            let mut brightest = 0.0f32;
            for (i, xyz) in xyz.iter().enumerate() {
                let wanted = p.signal(Vec3::from_array(*xyz), [0, 0]);
                let got = match output {
                    ColorOutput::ScRgb => {
                        [0, 1, 2].map(|c| half([bytes[8 * i + 2 * c], bytes[8 * i + 2 * c + 1]]))
                    }
                    _ => {
                        let word = u32::from_le_bytes([0, 1, 2, 3].map(|b| bytes[4 * i + b]));
                        [0, 10, 20].map(|shift| ((word >> shift) & 1023) as f32 / 1023.0)
                    }
                };
                brightest = brightest.max(wanted.max_element());
                let worst = (Vec3::from(got) - wanted).abs().max_element();
                let bound = if output == ColorOutput::ScRgb {
                    1.5e-3 * wanted.max_element().max(0.1)
                } else {
                    0.6 / 1023.0
                };
                assert!(worst < bound, "{curve:?} {output:?} {peak}: {got:?} instead of {wanted}");
            }
            let top = if output == scrgb { peak as f32 / 80.0 } else { pq::encode(peak as f32 / 10_000.0) };
            assert!(brightest <= top * 1.000_01, "{curve:?} {output:?}: {brightest} above {peak} cd/m²");
            // Highlights lie above diffuse white: 203/80 in scRGB, 0.58 in PQ; AgX ends there.
            let white = if output == ColorOutput::ScRgb { 203.0 / 80.0 } else { 0.5807 };
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

/// For every curve, the whole range of floats gives finite values in range.
#[test]
fn every_number_has_a_colour() {
    let values =
        [0.0, -1.0, f32::MIN_POSITIVE / 1024.0, 1e-30, 1e-3, 1.0, 1e10, f32::MAX, f32::INFINITY, f32::NAN];
    for curve in [ToneCurve::Paper, ToneCurve::PbrNeutral, ToneCurve::AgX] {
        for output in [ColorOutput::Sdr, ColorOutput::ScRgb, ColorOutput::Hdr10] {
            for (exposure, contrast) in [(1.0, 1.0), (1e-6, 0.3), (1e6, 3.0)] {
                let settings = Settings { curve, output, exposure, contrast, ..Settings::default() };
                let p = ToneMapper::new(&settings);
                let top = if output == ColorOutput::ScRgb { p.ceiling() * 203.0 / 80.0 } else { 1.0 };
                for i in 0..values.len().pow(3) {
                    let n = values.len();
                    let xyz = Vec3::new(values[i % n], values[i / n % n], values[i / n / n]);
                    let got = p.signal(xyz, [0, 0]);
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
        let p = ToneMapper::new(&settings);
        let back = settings.profile.from_xyz.inverse();
        for (x, z) in [(0.2, 3.0), (2.0, 0.01), (1.6, 0.0), (0.5, 0.2), (0.95, 1.09)] {
            for y in [0.01, 0.3, 2.0] {
                let rgb = p.linear(Vec3::new(x, 1.0, z) * y);
                let wanted = 1.0 - (-y).exp();
                let luminance = (back * rgb).y;
                assert!((luminance - wanted).abs() < 2e-5, "{name}: {luminance} instead of {wanted}");
            }
        }
    }
}

/// Bilateral masking and the views of the variance, both streams, both ways.
#[test]
fn masking_and_views_equal_the_reference() {
    let spec = spec(72, 51, SplatFilter::Gaussian);
    let mut both = Both::new(spec);
    // Few samples: low-pass instead. Many: camera alone, then both streams.
    for (count, every_light) in [(2_000, 0), (40_000, 7), (120_000, 3)] {
        both.add_scene(count, every_light);
        let bilateral = Settings { masking: Masking::Bilateral, ..settings(Reconstruction::Gaussian, 1.0) };
        let catmull_rom = Settings { reconstruction: Reconstruction::CatmullRom, ..bilateral.clone() };
        let camera = Settings { view: DisplayView::CameraVariance, ..bilateral.clone() };
        let light = Settings { view: DisplayView::LightVariance, ..bilateral.clone() };
        let zones = Settings { view: DisplayView::FalseColor, ..settings(Reconstruction::Gaussian, 0.0) };
        let marks = Settings { view: DisplayView::Clipping, exposure: 4.0, ..zones.clone() };
        for settings in [bilateral, catmull_rom, camera, light, zones, marks] {
            let what = format!("{:?} {:?}, {count} samples", settings.view, settings.reconstruction);
            both.assert_display(&settings, 50, &what);
        }
    }
    assert_silent(gpu());
}

/// Luminances of the picture that the GPU makes of one step, 1 to 1.5, under noise of 60 %, exposed by `scale`.
fn step_edge(masking: Masking, vm: f32, scale: f32) -> Vec<f32> {
    let spec = spec(96, 96, SplatFilter::Box);
    let mut random = Random(4242);
    let samples: Vec<Sample> = (0..96 * 96 * 64)
        .map(|_| {
            let uv = [random.f32(), random.f32()];
            // Uniform noise has a deviation of width / sqrt(12).
            let noise = 1.0 + 0.6 * (random.f32() - 0.5) * 12f32.sqrt();
            let y = if uv[0] < 0.5 { 1.0 } else { 1.5 } * noise * scale;
            Sample { uv, xyz: Xyz::new(0.95, 1.0, 1.09) * y, w: 1.0 }
        })
        .collect();
    let mut film = film(spec);
    film.add(&samples).expect("add");
    let settings = Settings { masking, ..settings(Reconstruction::Gaussian, vm) };
    film.reconstruct(&settings, 1).expect("reconstruct").into_iter().map(|xyz| xyz[1]).collect()
}

/// Noise goes, the mean stays, and the edge stays, which low-pass masking of the same strength takes away.
#[test]
fn bilateral_masking_keeps_edges() {
    let statistics = |picture: &[f32]| {
        // Both flat halves, the edge's surroundings and the border left out.
        let side = |from: usize, to: usize| {
            let values: Vec<f64> = (8..88)
                .flat_map(|y| (from..to).map(move |x| (x, y)))
                .map(|(x, y)| f64::from(picture[x + 96 * y]))
                .collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64)
        };
        let column = |x: usize| (8..88).map(|y| f64::from(picture[x + 96 * y])).sum::<f64>() / 80.0;
        (side(8, 32), side(64, 88), column(48) - column(47))
    };
    let ((dark, noise), (bright, _), edge) = statistics(&step_edge(Masking::LowPass, 0.0, 1.0));
    let ((dark_b, noise_b), (bright_b, _), edge_b) = statistics(&step_edge(Masking::Bilateral, 4.0, 1.0));
    let (_, _, edge_l) = statistics(&step_edge(Masking::LowPass, 4.0, 1.0));
    println!(
        "noise {noise} -> {noise_b}; means {dark} {bright} -> {dark_b} {bright_b}; edges {edge} {edge_b} {edge_l}"
    );
    assert!(noise_b * 16.0 < noise, "variance {noise} became {noise_b}");
    // The mean of 1920 texels is known within sqrt(noise / 1920); a filter may not move it by more than the part of the
    // noise that its reach brings in from the margin: 4 of these.
    let sigma = (noise / 1920.0).sqrt();
    assert!((dark_b - dark).abs() < 4.0 * sigma, "{dark} became {dark_b}, {sigma}");
    assert!((bright_b - bright).abs() < 6.0 * sigma, "{bright} became {bright_b}, {sigma}");
    assert!(edge_b > 0.85 * edge, "the edge of {edge} became {edge_b}");
    assert!(edge_l < 0.75 * edge, "case too easy: low-pass keeps {edge_l} of {edge}");
    // All lights 2^40 times as bright: the same picture, as much brighter.
    let exposed = step_edge(Masking::Bilateral, 4.0, 2f32.powi(40));
    let plain = step_edge(Masking::Bilateral, 4.0, 1.0);
    assert!(
        exposed.iter().zip(&plain).all(|(a, b)| *a == b * 2f32.powi(40)),
        "masking depends on the exposure"
    );
    assert_silent(gpu());
}
