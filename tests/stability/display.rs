//! From sums to the screen: levels of detail, tone curve, flat fields, films with next to nothing on them.

use glam::{Mat3, Vec3};
use pointillist::client::film::VulkanFilm;
use pointillist::client::lod::{StreamLod, TARGET_RELATIVE_VARIANCE};
use pointillist::client::reference::tonemap::ToneMapper;
use pointillist::client::retained::RetainedSamples;
use pointillist::client::{Film, FilmData, FilmSpec, Reconstruction, Settings, SplatFilter};
use pointillist::color::{Profile, Xyz};
use pointillist::math::random::Random;
use pointillist::stream::{Block, DrainOrder, Epoch, MAX_VALUE, PathCounts, Sample, lanes};

use crate::Row;
use crate::sums::films;
use crate::support::device::{FILTERS, RECONSTRUCTIONS, assert_silent, gpu, scene, settings, spec};

fn grey(uv: [f32; 2], y: f32) -> Sample {
    Sample { uv, xyz: Xyz::new(y, y, y), w: 1.0 }
}

/// All lights scaled by 2^k, and the exposure back: the picture with noise masking, whose blur is the map of levels, is the same to the
/// bit, and so is the variance in units of the luminance scale. The paper's rule LoD + Vm·log4(Var) moves every level by Vm·k.
#[test]
fn p4_the_blur_does_not_depend_on_the_exposure() {
    let spec = spec(40, 30, SplatFilter::Gaussian);
    let picture = |film: &mut dyn Film, k: i32| {
        let (mut numbers, scale) = (Random(3), 2.0f32.powi(k));
        film.clear();
        // Black samples first: the scale must not be taken from them.
        for round in 0..4 {
            let samples: Vec<Sample> = (0..700)
                .map(|_| {
                    let uv = [numbers.f32(), numbers.f32()];
                    let y = if round == 0 { 0.0 } else { numbers.f32().powi(8) * 5.0 * scale };
                    Sample { uv, xyz: Xyz::new(y * 0.5, y, y * 0.25), w: 1.0 }
                })
                .collect();
            film.add(&samples).unwrap();
            film.flush().unwrap();
        }
        let settings = Settings { exposure: scale.recip(), ..settings(Reconstruction::Gaussian, 0.7) };
        (film.display(&settings).unwrap(), film.develop().unwrap())
    };
    let paper = |data: &FilmData| -> Vec<f64> {
        let scale2 = f64::from(data.luminance_scale).powi(2);
        data.camera_variance.iter().map(|v| 0.7 * 0.5 * (f64::from(*v) * scale2).log2()).collect()
    };
    for (device, mut film) in films(spec) {
        let unscaled = picture(&mut *film, 0);
        let (mut differing, mut moved) = (0, 0);
        for k in (-60..=60).step_by(12).filter(|k| *k != 0) {
            let scaled = picture(&mut *film, k);
            let channels = |p: &pointillist::client::DisplayImage| p.rgb.as_flattened().to_vec();
            differing +=
                channels(&scaled.0).iter().zip(channels(&unscaled.0)).filter(|(a, b)| **a != *b).count();
            let variances = scaled.1.camera_variance.iter().zip(&unscaled.1.camera_variance);
            differing += variances.filter(|(a, b)| a.to_bits() != b.to_bits()).count();
            let levels = paper(&scaled.1).into_iter().zip(paper(&unscaled.1));
            moved += levels.filter(|(a, b)| (a - b).abs() > 0.01).count();
        }
        Row {
            case: &format!("P4 lights scaled by 2^-60 to 2^60, {device}"),
            measure: "channels and variances that differ",
            figure: differing as f64,
            naive: ("LoD + Vm·log4(Var): levels that differ", moved as f64),
            bound: 0.0,
        }
        .check();
    }
    assert_silent(gpu());
}

/// No sample, more samples than texels, no variance or one that overflowed, any strength: always a level that exists.
#[test]
fn p4_levels_are_always_there() {
    let (mut bad, mut naive) = (0, 0);
    for samples in [0, 1, 5, 1 << 20, u64::MAX] {
        for texels in [1, 6, 1 << 18, u64::MAX] {
            for r in [0.0, 1e-30, TARGET_RELATIVE_VARIANCE, 1.0, f32::MAX, f32::INFINITY, f32::NAN] {
                for vm in [0.0, 0.5, 1e30, -1.0, f32::NAN] {
                    let levels = -1.0f32..=4.0;
                    let level = (0.5 * (texels as f32 / samples as f32).log2()) + vm * 0.5 * r.log2();
                    naive += usize::from(!levels.contains(&level));
                    match StreamLod::new(texels, samples, 5) {
                        Some(lod) => bad += usize::from(!levels.contains(&lod.masked(r, vm))),
                        None => assert_eq!(samples, 0),
                    }
                }
            }
        }
    }
    Row {
        case: "P4 no samples, more samples than texels, no variance",
        measure: "levels that do not exist",
        figure: bad as f64,
        naive: ("log4(P/S) + Vm·log4(Var)", naive as f64),
        bound: 0.0,
    }
    .check();
}

/// Every 997th f32 from the least denormal to the largest number, rising, infinity, and what is not above 0.
fn floats() -> impl Iterator<Item = f32> {
    let positive = (1..=f32::MAX.to_bits()).step_by(997).map(f32::from_bits);
    positive.chain([f32::MAX, f32::INFINITY, 0.0, -0.0, -1e-45, -1.0, f32::MIN, f32::NEG_INFINITY, f32::NAN])
}

/// A display whose R, G and B are X, Y and Z.
fn identity(exposure: f32, contrast: f32) -> Settings {
    let profile = Profile { from_xyz: Mat3::IDENTITY, ..Profile::srgb() };
    Settings { exposure, contrast, profile, ..Settings::default() }
}

/// The paper's curve as it is printed, X and Z by the factor Y'/Y.
fn naive_curve(xyz: Vec3, exposure: f32, contrast: f32) -> Vec3 {
    let toned = 1.0 - (-(exposure * xyz.y).powf(contrast)).exp();
    let factor = toned / xyz.y;
    Vec3::new(xyz.x * factor, toned, xyz.z * factor)
}

/// The curve in `f64`; 0 for what is not above 0.
fn exact_curve(y: f32, exposure: f32, contrast: f32) -> f64 {
    if y > 0.0 { -(-(f64::from(exposure) * f64::from(y)).powf(f64::from(contrast))).exp_m1() } else { 0.0 }
}

/// The whole range of f32 with its denormals, negative luminance, contrast below 1: every channel is a number in [0, 1], and the
/// luminance is that of `f64`, relative to itself or to what one in ten thousand of 8 bits shows.
#[test]
fn p5_the_tone_curve_over_all_floats() {
    for (exposure, contrast) in [(1.0f32, 1.0f32), (8.0, 0.5), (0.01, 1.7), (1e30, 1.0), (1.0, 0.01)] {
        let settings = identity(exposure, contrast);
        let mapper = ToneMapper::new(&settings);
        let mut worst = [0.0f64; 2];
        let mut least = 0.0f32;
        for y in floats() {
            let xyz = Vec3::new(1.1, 1.0, 0.9) * y;
            let exact = exact_curve(y, exposure, contrast);
            let shown = [mapper.linear(xyz), naive_curve(xyz, exposure, contrast)];
            for (worst, rgb) in worst.iter_mut().zip(shown) {
                let inside = rgb.to_array().iter().all(|c| (0.0..=1.0).contains(c));
                let error = (f64::from(rgb.y) - exact).abs() / exact.max(1e-7);
                *worst = if inside { worst.max(error) } else { f64::INFINITY };
            }
            if y > 0.0 {
                // Library functions may step back by a rounding; never by what 8 bits could show.
                assert!(shown[0].y >= least - 1.2e-7, "falls at {y:e}");
                least = least.max(shown[0].y);
            }
        }
        Row {
            case: &format!("P5 all f32 as luminance, B = {exposure:e}, C = {contrast}"),
            measure: "error of the displayed luminance",
            figure: worst[0],
            naive: ("1 − exp(−(B·Y)^C), X·(Y'/Y)", worst[1]),
            bound: 1e-3,
        }
        .check();
    }
}

/// sRGB's matrix with rows that sum to 1, so that equal X, Y and Z are grey and the test does not hang on what the profile holds.
fn srgb() -> Settings {
    let rows = [
        Vec3::new(3.240_454_2, -1.537_138_5, -0.498_531_4),
        Vec3::new(-0.969_266, 1.876_010_8, 0.041_556),
        Vec3::new(0.055_643_4, -0.204_025_9, 1.057_225_2),
    ]
    .map(|row| row / row.element_sum());
    let from_xyz = Mat3::from_cols(rows[0], rows[1], rows[2]).transpose();
    Settings { profile: Profile { from_xyz, ..Profile::srgb() }, ..Settings::default() }
}

/// The hue of a colour from 1e-45 to 1e-2 is that of the same colour at 1e-2. Y'/Y taken first overflows, and is rounded away where
/// Y' is 1 − exp.
#[test]
fn p5_the_hue_of_dark_colours() {
    let settings = srgb();
    let color = Vec3::new(1.1, 1.0, 0.9);
    let wanted = settings.profile.from_xyz * color;
    let mut worst = [0.0f64; 2];
    for exponent in -37..-2 {
        let xyz = color * 10.0f32.powi(exponent);
        let naive = settings.profile.from_xyz * naive_curve(xyz, 1.0, 1.0);
        for (worst, rgb) in worst.iter_mut().zip([ToneMapper::new(&settings).linear(xyz), naive]) {
            let error = (rgb / rgb.y * wanted.y / wanted - 1.0).abs().max_element();
            *worst = worst.max(if error.is_finite() { f64::from(error) } else { f64::INFINITY });
        }
    }
    Row {
        case: "P5 one colour from 1e-37 to 1e-3",
        measure: "change of its hue",
        figure: worst[0],
        naive: ("1 − exp(−Y), X·(Y'/Y)", worst[1]),
        bound: 1e-3,
    }
    .check();
}

/// Any three numbers give a colour in the display's gamut, of the luminance that the curve says.
#[test]
fn p5_any_colour_can_be_shown() {
    let settings = srgb();
    let weights = settings.profile.from_xyz.inverse().row(1);
    let values =
        [0.0, 1e-45, 1e-38, 1e-6, 0.3, 1.0, 7.0, 1e20, f32::MAX, f32::INFINITY, f32::NAN, -1.0, f32::MIN];
    let mut worst = [0.0f64; 2];
    for x in values {
        for y in values {
            for z in values {
                let xyz = Vec3::new(x, y, z);
                let naive = settings.profile.from_xyz * naive_curve(xyz, 1.0, 1.0);
                for (worst, rgb) in worst.iter_mut().zip([ToneMapper::new(&settings).linear(xyz), naive]) {
                    let inside = rgb.to_array().iter().all(|c| (0.0..=1.0).contains(c));
                    let error = (f64::from(weights.dot(rgb)) - exact_curve(y, 1.0, 1.0)).abs();
                    *worst = if inside { worst.max(error) } else { f64::INFINITY };
                }
            }
        }
    }
    Row {
        case: "P5 X, Y and Z of any size and sign, NaN, infinite",
        measure: "error of the displayed luminance, of 1",
        figure: worst[0],
        naive: ("1 − exp(−Y), X·(Y'/Y)", worst[1]),
        bound: 2e-3,
    }
    .check();
}

/// From the film to 8 bits, on the device and on the CPU: texels of 2^-126 to 2^99 and negative ones. One step of 255 is a value at a
/// rounding edge. Denormals are not in it: a device may flush them to 0, which is black at any contrast above 0.1.
#[test]
fn p5_the_way_to_the_screen() {
    let spec = FilmSpec { variance: None, ..spec(16, 16, SplatFilter::Box) };
    let luminance =
        |i: u32| if i < 226 { 2.0f32.powi(i as i32 - 126) } else { -(2.0f32.powi(i as i32 - 240)) };
    let samples: Vec<Sample> = (0..256)
        .map(|i| grey([(i % 16) as f32 / 16.0 + 0.03, (i / 16) as f32 / 16.0 + 0.03], luminance(i)))
        .collect();
    assert!(samples.iter().all(|s| s.xyz.y.abs() <= MAX_VALUE));
    for (device, mut film) in films(spec) {
        film.add(&samples).unwrap();
        let mut worst = [0.0f64; 2];
        for (exposure, contrast) in [(1.0f32, 1.0f32), (8.0, 0.5), (0.01, 1.7), (1e30, 1.0), (1.0, 0.01)] {
            let settings = Settings { reconstruction: Reconstruction::None, ..identity(exposure, contrast) };
            let shown = film.display(&settings).unwrap();
            for (i, rgb) in shown.rgb.iter().enumerate() {
                let y = luminance(i as u32);
                let encoded = |linear: f64| linear.powf(1.0 / f64::from(settings.gamma)) * 255.0;
                let wanted = encoded(exact_curve(y, exposure, contrast));
                let naive = encoded(f64::from(naive_curve(Vec3::splat(y), exposure, contrast).x));
                let off = |v: f64| if v.is_finite() { (v - wanted).abs() } else { 255.0 };
                worst[0] = rgb.iter().map(|c| off(f64::from(*c))).fold(worst[0], f64::max);
                worst[1] = worst[1].max(off(naive));
            }
        }
        Row {
            case: &format!("P5 film of 2^-126 to 2^99 and below 0, to 8 bits, {device}"),
            measure: "error, steps of 255",
            figure: worst[0],
            naive: ("1 − exp(−(B·Y)^C), X·(Y'/Y)", worst[1]),
            bound: 1.0,
        }
        .check();
    }
}

/// Samples on a regular grid over the window, with the overscan or without: every texel, corners included, has the same value in both
/// streams. 1e-6 is the rounding of 576 additions.
#[test]
fn p7_a_flat_field() {
    const PER_TEXEL: u32 = 4;
    for filter in FILTERS {
        let spec = spec(37, 23, filter);
        let lattice = |pad: u32, w: f32| -> Vec<Sample> {
            let at = |i: u32, n: u32| {
                ((f64::from(i) + 0.5) / f64::from(PER_TEXEL) - f64::from(pad)) / f64::from(n)
            };
            let [columns, rows] = [37, 23].map(|n| (n + 2 * pad) * PER_TEXEL);
            (0..rows * columns)
                .map(|i| {
                    let uv = [at(i % columns, 37) as f32, at(i / columns, 23) as f32];
                    Sample { uv, xyz: Xyz::new(0.5, 1.0, 2.0), w }
                })
                .collect()
        };
        let worst = |film: &mut dyn Film, pad: u32| {
            film.clear();
            [1.0, -1.0].into_iter().for_each(|w| film.add(&lattice(pad, w)).unwrap());
            let data = film.develop().unwrap();
            let texels = data.camera.iter().chain(&data.light);
            let values = texels.flat_map(|t| t.iter().zip([0.5, 1.0, 2.0, 1.0]));
            let whole = (PER_TEXEL * PER_TEXEL) as f32;
            values.map(|(v, each)| f64::from(v / (each * whole) - 1.0).abs()).fold(0.0, f64::max)
        };
        for (device, mut film) in films(spec) {
            let (figure, naive) = (worst(&mut *film, spec.pad()), worst(&mut *film, 0));
            // A box reaches no neighbour and needs no overscan.
            let naive = if filter == SplatFilter::Box { f64::NAN } else { naive };
            Row {
                case: &format!("P7 flat field, {filter:?}, {device}"),
                measure: "largest relative error of a texel",
                figure,
                naive: ("samples of the picture alone", naive),
                bound: 2e-6,
            }
            .check();
            // And as it is shown.
            film.clear();
            film.add(&lattice(spec.pad(), 1.0)).unwrap();
            for kind in RECONSTRUCTIONS {
                let shown = film.display(&settings(kind, 0.5)).unwrap();
                assert!(shown.rgb.iter().all(|rgb| *rgb == shown.rgb[0]), "{filter:?} {kind:?} {device}");
            }
        }
    }
    assert_silent(gpu());
}

/// An all-NaN batch, then one sample in the whole picture, on films down to 1×1 and of odd extents: every value of the picture is a
/// number, and the one sample is seen everywhere. Sums over weights that are 0 are not.
#[test]
fn n23_next_to_nothing_on_the_film() {
    let sizes = [(1, 1), (1, 7), (5, 1), (3, 3), (37, 11), (129, 63)];
    let mut worst = [0; 2];
    let mut naive = 0;
    for (width, height) in sizes {
        for filter in FILTERS {
            let spec = spec(width, height, filter);
            let one = grey([0.5, 0.5], 2.0);
            let nan = [
                Sample { uv: [f32::NAN; 2], ..one },
                Sample { xyz: Xyz::new(f32::NAN, f32::NAN, f32::NAN), ..one },
                Sample { w: f32::NAN, ..one },
            ];
            let nan: Vec<Sample> = nan.into_iter().cycle().take(70_000).collect();
            for (worst, (_, mut film)) in worst.iter_mut().zip(films(spec)) {
                film.add(&nan).unwrap();
                film.display(&settings(Reconstruction::Gaussian, 0.5)).unwrap();
                assert_eq!(film.counts().camera_samples, 0);
                film.add(&[one]).unwrap();
                let data = film.develop().unwrap();
                let values = data.camera.iter().flatten().chain(&data.camera_variance);
                *worst += values.filter(|v| !v.is_finite()).count();
                naive += data.camera.iter().filter(|s| !(s[1] / s[3]).is_finite()).count();
                for kind in [Reconstruction::Gaussian, Reconstruction::Mipmap] {
                    let shown = film.display(&settings(kind, 0.5)).unwrap();
                    *worst += shown.rgb.iter().filter(|rgb| **rgb == [0; 3]).count();
                }
            }
            let mut device = VulkanFilm::new(gpu().clone(), spec).unwrap();
            device.add(&[one]).unwrap();
            for kind in RECONSTRUCTIONS {
                for vm in [0.0, 0.7, f32::MAX] {
                    let picture = device.reconstruct(&settings(kind, vm), 1).unwrap();
                    worst[0] += picture.iter().flatten().filter(|v| !v.is_finite()).count();
                }
            }
        }
    }
    for (device, figure) in ["GPU", "CPU"].into_iter().zip(worst) {
        Row {
            case: &format!("N23 a batch of NaN, then one sample, films of 1×1 to 129×63, {device}"),
            measure: "values that are no number, pixels that are black",
            figure: figure as f64,
            naive: ("XYZ/W", naive as f64),
            bound: 0.0,
        }
        .check();
    }
    assert_silent(gpu());
}

/// A render through a ring of two blocks that wraps a thousand times, in which an epoch begins and the film is replaced by one of
/// another size in mid-frame: the picture is that of an undisturbed film, and no sample is lost.
#[test]
fn n23_ring_wrap_resize_and_epoch() {
    let (old, new) = (spec(31, 17, SplatFilter::Gaussian), spec(53, 29, SplatFilter::Gaussian));
    let samples = scene(&new, 64_000, 5, 3);
    for (i, device) in ["GPU", "CPU"].into_iter().enumerate() {
        let make = |spec: FilmSpec| {
            let [device, reference] = films(spec).map(|(_, film)| film);
            if i == 0 { device } else { reference }
        };
        let (mut writers, mut lanes) = lanes(1, 2);
        let (mut kept, mut film) = (RetainedSamples::default(), make(old));
        let mut naive = make(new);
        let mut block = Box::<Block>::default();
        for (epoch, range) in [(Epoch(1), 0..9_600), (Epoch(2), 0..samples.len())] {
            lanes.hub().run(Some(epoch));
            lanes.follow(epoch, DrainOrder::Arrival);
            film.clear();
            kept.clear();
            for (k, part) in samples[range].chunks(64).enumerate() {
                block.restart(epoch, 64 * k as u64);
                part.iter().for_each(|sample| assert!(block.push(*sample)));
                block.header.index_count = 64;
                block.header.paths = PathCounts { camera: 64, light: 64 };
                assert!(writers[0].send(&mut block));
                // The frame of the end of epoch 1 leaves a block in the ring.
                if epoch == Epoch(1) && k == 149 {
                    break;
                }
                lanes.drain(usize::MAX, |block| {
                    kept.push(block);
                    film.add(block.samples()).unwrap();
                    naive.add(block.samples()).unwrap();
                    naive.count_paths(block.header.paths);
                    film.count_paths(block.header.paths);
                });
                if epoch == Epoch(2) && k == 500 {
                    film = make(new);
                    kept.rewind();
                    while let Some(([samples, _], _, paths)) = kept.feed() {
                        film.add(samples).unwrap();
                        film.count_paths(paths);
                    }
                }
            }
        }
        assert_eq!(lanes.stale_blocks(), 1);
        let mut undisturbed = make(new);
        undisturbed.add(&samples).unwrap();
        undisturbed.count_paths(PathCounts { camera: 64_000, light: 64_000 });
        assert_eq!(film.counts(), undisturbed.counts());
        let shown = |film: &mut dyn Film| film.display(&settings(Reconstruction::Gaussian, 0.5)).unwrap().rgb;
        let wanted = shown(&mut *undisturbed);
        let differing = |rgb: Vec<[u8; 3]>| rgb.iter().zip(&wanted).filter(|(a, b)| a != b).count() as f64;
        Row {
            case: &format!("N23 ring of two blocks, epoch and resize in mid-frame, {device}"),
            measure: "pixels that differ from an undisturbed film",
            figure: differing(shown(&mut *film)),
            naive: ("samples of both epochs", differing(shown(&mut *naive))),
            bound: 0.0,
        }
        .check();
    }
    assert_silent(gpu());
}
