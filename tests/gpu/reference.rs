//! The Vulkan passes against their references in `client/reference`, image by image.

use crate::common::{
    Both, FILTERS, RECONSTRUCTIONS, assert_one_step, assert_silent, film, gpu, scene, settings, spec,
};
use glam::{Vec3, Vec4};
use pointillist::client::film::VulkanFilm;
use pointillist::client::lod::StreamLod;
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::reference::mips::pyramid;
use pointillist::client::reference::reconstruct::{ReconstructParameters, StreamView, reconstruct};
use pointillist::client::reference::tonemap::tonemap;
use pointillist::client::{
    Film, FilmData, FilmSpec, Reconstruction, ReconstructionKernel, ScaledFilter, Settings, SplatFilter,
    Summation, VarianceForm,
};
use pointillist::color::Xyz;
use pointillist::image::Grid;
use pointillist::math::random::Random;
use pointillist::stream::{PathCounts, Sample};

/// Largest difference, relative to the largest value of its channel.
pub fn difference<const N: usize>(a: &[[f32; N]], b: &[[f32; N]]) -> f32 {
    assert_eq!(a.len(), b.len());
    (0..N).fold(0.0, |worst, k| {
        let peak = b.iter().map(|v| v[k].abs()).fold(f32::MIN_POSITIVE, f32::max);
        let most = a.iter().zip(b).map(|(a, b)| (a[k] - b[k]).abs()).fold(0.0, f32::max);
        worst.max(most / peak)
    })
}

fn singles(values: &[f32]) -> Vec<[f32; 1]> {
    values.iter().map(|v| [*v]).collect()
}

/// Splat, fold and variance: sums of thousands of products in another order, so rounding is all that may differ.
#[test]
fn sums_equal_the_reference() {
    for filter in FILTERS {
        for variance in [VarianceForm::Product, VarianceForm::Paper] {
            compare_sums(FilmSpec { variance: Some(variance), ..spec(131, 67, filter) });
        }
    }
    for filter in [ScaledFilter::Gaussian { stddev: 500 }, ScaledFilter::Tent { radius: 1700 }] {
        compare_sums(spec(131, 67, SplatFilter::Scaled(filter)));
    }
    assert_silent(gpu());
}

/// Sums of one float, with and without a variance beside them.
#[test]
fn plain_sums_equal_the_reference() {
    for variance in [None, Some(VarianceForm::Product)] {
        compare_sums(FilmSpec { sums: Summation::Plain, variance, ..spec(131, 67, SplatFilter::Gaussian) });
    }
    assert_silent(gpu());
}

/// Sums that the processor makes for a film on the device are those of the reference, bit for bit, and so is their picture but for the
/// rounding of the passes; after a clear nothing of them is left.
#[test]
fn sums_on_the_host_are_those_of_the_reference() {
    let spec = spec(131, 67, SplatFilter::Gaussian);
    let (first, second) = (scene(&spec, 70_000, 43, 3), scene(&spec, 3_000, 44, 2));
    let mut film = VulkanFilm::summed_on_host(gpu().clone(), spec).expect("a film");
    let plain = settings(Reconstruction::Gaussian, 0.0);
    for samples in [&first, &second] {
        let mut reference = ReferenceFilm::new(spec, 1).expect("a film");
        film.clear();
        // The picture after the first call must not be what the second one shows.
        for part in samples.chunks(samples.len() / 2 + 1) {
            film.add(part).expect("add");
            reference.add(part).expect("add");
            film.flush().expect("flush");
            reference.flush().expect("flush");
            let shown = film.reconstruct(&plain, 1).expect("a picture");
            let data = film.develop_padded().expect("develop");
            let wanted = reference_picture(&data, spec, &plain);
            let off = difference(&shown, &wanted);
            assert!(off < 2e-5, "the picture is off by {off}");
        }
        assert_eq!(film.develop().expect("develop"), reference.develop().expect("develop"));
    }
    assert_silent(gpu());
}

fn compare_sums(spec: FilmSpec) {
    // Camera samples have two weights.
    let weighted = |(i, sample): (usize, Sample)| match sample.w > 0.0 && i % 2 == 0 {
        true => Sample { xyz: sample.xyz * 0.25, w: 0.25, ..sample },
        false => sample,
    };
    let samples: Vec<_> = scene(&spec, 200_000, 42, 3).into_iter().enumerate().map(weighted).collect();
    let mut reference = ReferenceFilm::new(spec, 1).expect("a film");
    reference.add(&samples).expect("add");
    let reference = reference.develop().expect("develop");
    let mut film = film(spec);
    film.add(&samples).expect("add");
    let data = film.develop().expect("develop");
    assert_eq!(data.luminance_scale, reference.luminance_scale);
    assert_eq!(data.counts, reference.counts);
    let color = difference(&data.camera, &reference.camera).max(difference(&data.light, &reference.light));
    assert!(color < 2e-6, "{spec:?}: colour differs by {color}");
    let of = |d: &FilmData| (singles(&d.camera_variance), singles(&d.light_variance));
    let ((a, b), (c, d)) = (of(&data), of(&reference));
    let variance = difference(&a, &c).max(difference(&b, &d));
    assert!(variance < 2e-5, "{spec:?}: variance differs by {variance}");
}

/// The reference's picture of the very sums that the GPU holds.
fn reference_picture(data: &FilmData, spec: FilmSpec, settings: &Settings) -> Vec<[f32; 3]> {
    coarse_reference_picture(data, spec, settings, 1)
}

/// The same of one pixel per `detail` texels and axis.
pub fn coarse_reference_picture(
    data: &FilmData,
    spec: FilmSpec,
    settings: &Settings,
    detail: u32,
) -> Vec<[f32; 3]> {
    let (w, h) = (data.width as usize, data.height as usize);
    let color = |sums: &[[f32; 4]]| {
        let grid = Grid::from_rows(w, h, sums.iter().map(|v| Vec4::from_array(*v)).collect());
        grid.and_then(pyramid)
    };
    let variance = |sums: &[f32]| Grid::from_rows(w, h, sums.to_vec()).and_then(pyramid);
    let (camera, light) = (color(&data.camera), color(&data.light));
    let camera_variance = variance(&data.camera_variance);
    let light_variance = variance(&data.light_variance);
    let view = |color: &Option<Vec<Grid<Vec4>>>, variance: &Option<Vec<Grid<f32>>>, samples, summed| {
        let color: &'static [Grid<Vec4>] = Vec::leak(color.clone()?);
        let lod = StreamLod::new((w * h) as u64, samples, color.len())?.coarsened(detail);
        let variance = variance.clone().filter(|_| settings.vm > 0.0).map(|v| &*Vec::leak(v));
        Some(StreamView { color, variance, lod, summed, filtered: false })
    };
    let p = ReconstructParameters {
        spec,
        method: settings.reconstruction,
        kernel: settings.kernel,
        vm: settings.vm,
        luminance_scale: data.luminance_scale,
        light_scale: data.counts.light_scale(spec.width, spec.height),
        detail,
    };
    let camera = view(&camera, &camera_variance, data.counts.camera_samples, false);
    let light = view(&light, &light_variance, data.counts.light_samples, true);
    let picture = reconstruct(&p, camera.as_ref(), light.as_ref()).expect("memory");
    picture.pixels().iter().map(|v| v.to_array()).collect()
}

/// Mips and reconstruction of the same sums, from one sample a picture to many a texel: every level of detail.
#[test]
fn pictures_equal_the_reference() {
    for filter in [SplatFilter::Gaussian, SplatFilter::Box] {
        let spec = spec(95, 62, filter);
        let mut film = film(spec);
        let mut added = 0;
        for (count, every_light) in [(1, 0), (30, 0), (300, 2), (4_000, 2), (20_000, 5), (60_000, 3)] {
            film.add(&scene(&spec, count, count as u64, every_light)).expect("add");
            added += count as u64;
            film.count_paths(PathCounts { camera: count as u64, light: count as u64 });
            let data = film.develop_padded().expect("develop");
            for kind in RECONSTRUCTIONS {
                for vm in [0.0, 0.5] {
                    let settings = settings(kind, vm);
                    let got = film.reconstruct(&settings, 1).expect("reconstruct");
                    let wanted = reference_picture(&data, spec, &settings);
                    // Empty texels beside full ones: XYZ/W is whatever rounding lets through from either side.
                    let sharp = filter == SplatFilter::Box && !matches!(kind, Reconstruction::Gaussian);
                    let kept = |i: &usize| !sharp || data.camera[*i][3] > 0.0;
                    let keep = |v: &[[f32; 3]]| (0..v.len()).filter(kept).map(|i| v[i]).collect::<Vec<_>>();
                    let worst = difference(&keep(&got), &keep(&wanted));
                    assert!(worst < 4e-5, "{filter:?} {kind:?} Vm {vm}, {added} samples: {worst}");
                }
            }
        }
    }
    assert_silent(gpu());
}

/// Every radius, windows that close early, late and not at all; also where the level differs from pixel to pixel.
#[test]
fn pictures_of_other_kernels_equal_the_reference() {
    let spec = spec(61, 43, SplatFilter::Gaussian);
    for count in [40, 1_500, 9_000] {
        let mut film = film(spec);
        film.add(&scene(&spec, count, 5, 3)).expect("add");
        film.count_paths(PathCounts { camera: count as u64, light: count as u64 });
        let data = film.develop_padded().expect("develop");
        for (taps, exponent) in [(2, 8), (3, 0), (4, 1), (5, 0), (5, 32), (7, 8), (8, 0)] {
            for vm in [0.0, 0.5] {
                let kernel = ReconstructionKernel { taps, exponent };
                let settings = Settings { kernel, ..settings(Reconstruction::Gaussian, vm) };
                let got = film.reconstruct(&settings, 1).expect("reconstruct");
                let worst = difference(&got, &reference_picture(&data, spec, &settings));
                assert!(worst < 4e-5, "{kernel:?}, Vm {vm}, {count} samples: {worst}");
            }
        }
    }
    assert_silent(gpu());
}

/// The coarse pictures that are shown while there is no time for fine ones, sizes that do not divide included.
#[test]
fn coarse_pictures_equal_the_reference() {
    let spec = spec(83, 61, SplatFilter::Gaussian);
    for count in [30, 3_000, 100_000] {
        let mut film = film(spec);
        film.add(&scene(&spec, count, 3, 4)).expect("add");
        film.count_paths(PathCounts { camera: count as u64, light: count as u64 });
        let data = film.develop_padded().expect("develop");
        for detail in [2, 4] {
            for vm in [0.0, 0.5] {
                let settings = settings(Reconstruction::Gaussian, vm);
                let got = film.reconstruct(&settings, detail).expect("reconstruct");
                let worst = difference(&got, &coarse_reference_picture(&data, spec, &settings, detail));
                assert!(worst < 4e-5, "detail {detail}, Vm {vm}, {count} samples: {worst}");
            }
        }
    }
    assert_silent(gpu());
}

/// Light samples of one brightness: their number is the noise. Taken for a mean, the sum would look clean, and no masking
/// would set in.
#[test]
fn the_number_of_light_samples_is_noise() {
    let spec = spec(96, 64, SplatFilter::Gaussian);
    let mut random = Random(17);
    let window = spec.window();
    let size = [0, 1].map(|k| window.max[k] - window.min[k]);
    let [width, height] = spec.padded_extent();
    let count = width * height;
    let samples: Vec<Sample> = (0..count)
        .map(|_| {
            let uv = [0, 1].map(|k| window.min[k] + size[k] * random.f32());
            Sample { uv, xyz: Xyz::new(1.0, 1.0, 1.0) * (size[0] * size[1]), w: -1.0 }
        })
        .collect();
    let mut film = film(spec);
    film.add(&samples).expect("add");
    film.count_paths(PathCounts { camera: 0, light: u64::from(count) });
    let data = film.develop_padded().expect("develop");
    let mut error = |vm: f32| {
        let settings = settings(Reconstruction::Gaussian, vm);
        let got = film.reconstruct(&settings, 1).expect("reconstruct");
        assert!(difference(&got, &reference_picture(&data, spec, &settings)) < 4e-5);
        let squares: f32 = got.iter().map(|c| (c[1] - 1.0).powi(2)).sum();
        (squares / got.len() as f32).sqrt()
    };
    // A sample a texel through the filter is 8 at once: 1/√8 = 35 %, a little less by the basic blur; masking aims at 5 %.
    let (plain, masked) = (error(0.0), error(1.0));
    assert!(plain > 0.2 && masked < 0.08, "without masking {plain}, with {masked}");
    assert_silent(gpu());
}

/// The tone map: at most one step of 255, where a value lies at a rounding edge; and the whole way to the screen.
#[test]
fn tone_map_equals_the_reference() {
    let spec = spec(64, 48, SplatFilter::Gaussian);
    let mut film = film(spec);
    film.add(&scene(&spec, 40_000, 77, 0)).expect("add");
    for (exposure, contrast, gamma) in [(1.0, 1.0, 2.2), (0.01, 0.5, 1.0), (30.0, 2.0, 2.4)] {
        let base = settings(Reconstruction::Gaussian, 0.5);
        let settings = Settings { exposure, contrast, gamma, ..base };
        let shown = film.display(&settings).expect("display");
        let xyz = film.reconstruct(&settings, 1).expect("reconstruct");
        let grid = Grid::from_rows(64, 48, xyz.iter().map(|v| Vec3::from_array(*v)).collect());
        let wanted = tonemap(&grid.expect("as many pixels"), &settings);
        assert_one_step(&shown, &wanted, 200, &format!("B {exposure} C {contrast} G {gamma}"));
    }
    assert_silent(gpu());
}

/// From samples to the encoded picture, both ways on their own: at most one step of 255 apart.
#[test]
fn displays_equal_the_reference() {
    let spec = spec(90, 61, SplatFilter::Gaussian);
    let mut both = Both::new(spec);
    for (count, every_light) in [(50, 0), (2_000, 3), (90_000, 4)] {
        both.add_scene(count, every_light);
        for kind in RECONSTRUCTIONS {
            for vm in [0.0, 0.5] {
                let what = format!("{kind:?} Vm {vm}, {count} samples");
                both.assert_display(&settings(kind, vm), 100, &what);
            }
        }
    }
    assert_silent(gpu());
}
