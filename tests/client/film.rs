//! The film on the CPU: its result does not depend on threads and batches, fields are flat, sprites sum to one, the light stream has
//! the right brightness, and no sample breaks the picture.

use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{
    AdaptiveFilter, CHUNK_SAMPLES, ClientError, ColorOutput, Film, FilmSpec, Reconstruction, Settings,
    SplatFilter, VarianceForm, develop,
};
use pointillist::color::Xyz;
use pointillist::math::random::Random;
use pointillist::stream::{PathCounts, Sample};
use proptest::prelude::*;

const FILTERS: [SplatFilter; 3] = [SplatFilter::Gaussian, SplatFilter::Tent, SplatFilter::Box];
const METHODS: [Reconstruction; 4] =
    [Reconstruction::Gaussian, Reconstruction::CatmullRom, Reconstruction::Mipmap, Reconstruction::None];

fn spec(width: u32, height: u32, filter: SplatFilter) -> FilmSpec {
    FilmSpec { width, height, filter, variance: Some(VarianceForm::Product), sums: Default::default() }
}

fn film(spec: FilmSpec) -> ReferenceFilm {
    ReferenceFilm::new(spec, 2).expect("film")
}

fn settings(reconstruction: Reconstruction, vm: f32) -> Settings {
    Settings { reconstruction, vm, adaptive_filter: AdaptiveFilter::Off, ..Settings::default() }
}

/// Samples over the whole window, every fourth on the light stream.
fn mixed(spec: &FilmSpec, n: usize) -> Vec<Sample> {
    let (mut numbers, window) = (Random(11), spec.window());
    let mut at = |i: usize| window.min[i] + (window.max[i] - window.min[i]) * numbers.f32();
    let positions: Vec<[f32; 2]> = (0..n).map(|_| [at(0), at(1)]).collect();
    let mut numbers = Random(12);
    positions
        .into_iter()
        .enumerate()
        .map(|(i, uv)| Sample {
            uv,
            xyz: Xyz::new(numbers.f32(), numbers.f32() * 3.0, numbers.f32()),
            w: if i % 4 == 3 { -1.0 } else { 1.0 },
        })
        .collect()
}

/// A regular lattice of `per_texel²` samples in every padded texel, off the texel borders.
fn lattice(spec: &FilmSpec, per_texel: u32, xyz: Xyz, w: f32) -> Vec<Sample> {
    let ([pw, ph], pad) = (spec.padded_extent(), spec.pad() as f32);
    let place = |i: u32, size: u32| ((i as f32 + 0.5) / per_texel as f32 - pad) / size as f32;
    let mut samples = Vec::new();
    for y in 0..ph * per_texel {
        for x in 0..pw * per_texel {
            samples.push(Sample { uv: [place(x, spec.width), place(y, spec.height)], xyz, w });
        }
    }
    samples
}

#[test]
fn threads_leave_no_trace() {
    let spec = spec(75, 141, SplatFilter::Gaussian);
    let samples = mixed(&spec, 150_000);
    let results: Vec<_> = [1, 2, 7]
        .map(|threads| {
            let mut film = ReferenceFilm::new(spec, threads).expect("film");
            film.add(&samples).expect("add");
            film.count_paths(PathCounts { camera: 100_000, light: 40_000 });
            let pictures = METHODS.map(|m| film.display(&settings(m, 0.5)).expect("display"));
            (film.develop().expect("develop"), pictures)
        })
        .into();
    assert!(results.iter().all(|r| *r == results[0]));
    assert_eq!(results[0].0.counts.camera_samples + results[0].0.counts.light_samples, 150_000);
}

/// How the samples are cut into calls does not matter: a batch is full at exactly its capacity.
#[test]
fn calls_leave_no_trace() {
    let spec = spec(33, 20, SplatFilter::Gaussian);
    let samples = mixed(&spec, 2 * CHUNK_SAMPLES + 777);
    let mut one_call = film(spec);
    one_call.add(&samples).expect("add");
    let mut many = film(spec);
    for part in samples.chunks(4_999) {
        many.add(part).expect("add");
    }
    assert_eq!(one_call.develop().expect("develop"), many.develop().expect("develop"));

    many.clear();
    assert!(many.develop().expect("develop").camera.is_empty());
    many.add(&samples).expect("add");
    assert_eq!(one_call.develop().expect("develop"), many.develop().expect("develop"));
}

#[test]
fn flat_fields_are_displayed_flat() {
    for filter in FILTERS {
        let spec = spec(21, 12, filter);
        for (per_texel, vm) in [(1, 0.0), (1, 1.0), (4, 0.5)] {
            let mut film = film(spec);
            film.add(&lattice(&spec, per_texel, Xyz::new(0.5, 0.5, 0.5), 1.0)).expect("add");
            for method in METHODS {
                let rgb = film.display(&settings(method, vm)).expect("display").rgb;
                assert!(rgb.iter().all(|c| *c == rgb[0]), "{filter:?} {method:?} Vm {vm}");
                assert!(rgb[0][1] > 0);
            }
        }
    }
}

/// One sprite adds its whole value to the sums, wherever it lies in the picture.
#[test]
fn one_sprite_sums_to_one() {
    for filter in FILTERS {
        // A picture wide enough that the whole sprite is within the cropped sums.
        let spec = spec(16, 16, filter);
        let mut film = film(spec);
        let mut numbers = Random(5);
        for _ in 0..300 {
            let uv = [0.25 + 0.5 * numbers.f32(), 0.25 + 0.5 * numbers.f32()];
            film.clear();
            film.add(&[Sample { uv, xyz: Xyz::new(1.0, 2.0, 4.0), w: 1.0 }]).expect("add");
            let data = film.develop().expect("develop");
            for (k, wanted) in [1.0, 2.0, 4.0, 1.0].into_iter().enumerate() {
                let sum: f64 = data.camera.iter().map(|c| f64::from(c[k])).sum();
                assert!((sum / wanted - 1.0).abs() < 1e-6, "{filter:?} at {uv:?}: {sum}");
            }
        }
    }
}

/// Light samples of density `value` per uv² over N paths, each one sample in the unit square: the picture
/// has radiance `value` everywhere, at every film size.
#[test]
fn light_samples_have_the_right_brightness() {
    for (width, height) in [(8, 8), (31, 17), (64, 40)] {
        for filter in FILTERS {
            let spec = spec(width, height, filter);
            let window = spec.window();
            let area = (window.max[0] - window.min[0]) * (window.max[1] - window.min[1]);
            let mut film = film(spec);
            // Uniform over the window with density 1/area: the value carries the area.
            let samples = lattice(&spec, 4, Xyz::new(0.2, 0.4, 0.6) * area, -1.0);
            film.add(&samples).expect("add");
            film.count_paths(PathCounts { camera: 0, light: samples.len() as u64 });
            for xyz in develop::linear_xyz(&film.develop().expect("develop")) {
                for (v, wanted) in xyz.into_iter().zip([0.2, 0.4, 0.6]) {
                    assert!((v / wanted - 1.0).abs() < 1e-5, "{width}×{height} {filter:?}: {xyz:?}");
                }
            }
            // The same through the display: Y' = 1 − e^−0.4, identity or real matrix alike for its luminance.
            let both = film.display(&settings(Reconstruction::None, 0.0)).expect("display");
            film.add(&lattice(&spec, 2, Xyz::BLACK, 1.0)).expect("add");
            assert_eq!(film.display(&settings(Reconstruction::None, 0.0)).expect("display"), both);
        }
    }
}

#[test]
fn streams_without_samples_have_no_image() {
    let spec = spec(4, 4, SplatFilter::Gaussian);
    let mut film = film(spec);
    let black = film.display(&settings(Reconstruction::Gaussian, 1.0)).expect("display");
    assert!(black.rgb.iter().all(|c| *c == [0; 3]));
    film.add(&lattice(&spec, 1, Xyz::new(1.0, 1.0, 1.0), 1.0)).expect("add");
    let data = film.develop().expect("develop");
    assert_eq!((data.camera.len(), data.light.len(), data.light_variance.len()), (16, 0, 0));
}

/// One sample in the whole picture, W = 0 texels, tiny and odd films, unusable samples.
#[test]
fn hard_films_stay_finite() {
    for (width, height) in [(1, 1), (1, 7), (5, 1), (3, 3), (37, 11)] {
        for filter in FILTERS {
            let spec = spec(width, height, filter);
            let mut film = film(spec);
            let one = Sample { uv: [0.5, 0.5], xyz: Xyz::new(2.0, 2.0, 2.0), w: 1.0 };
            let bad = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY].map(|x| {
                [
                    Sample { uv: [x, 0.5], ..one },
                    Sample { xyz: Xyz::new(x, 1.0, 1.0), ..one },
                    Sample { w: x, ..one },
                ]
            });
            film.add(bad.as_flattened()).expect("add");
            film.add(&[Sample { w: 0.0, ..one }, Sample { w: -0.0, ..one }]).expect("add");
            assert_eq!(film.counts().camera_samples + film.counts().light_samples, 0);
            film.add(&[Sample { uv: [1e30, -1e30], ..one }, Sample { uv: [9.0, 0.5], ..one }]).expect("add");
            for samples in [&[][..], &[one][..], &[Sample { w: -1.0, ..one }][..]] {
                film.add(samples).expect("add");
                film.count_paths(PathCounts { camera: 1, light: 1 });
                for (method, vm) in METHODS.into_iter().zip([0.0, 0.5, 1.0, f32::MAX]) {
                    let picture = film.display(&settings(method, vm)).expect("display");
                    assert_eq!(picture.rgb.len(), (width * height) as usize);
                }
            }
            let data = film.develop().expect("develop");
            assert!(develop::linear_xyz(&data).iter().flatten().all(|v| v.is_finite()));
            assert!(data.camera_variance.iter().all(|v| v.is_finite()));
            // Three camera samples of which two lie outside: LoD ≤ 1×1 level, and the blur fills the film.
            let picture = film.display(&settings(Reconstruction::Gaussian, 0.0)).expect("display");
            assert!(picture.rgb.iter().all(|c| *c != [0; 3]), "{width}×{height} {filter:?}");
        }
    }
}

/// Samples of different weights, as those that two eyes share: the variance that pixels state of their mean is that of the means of many pixels.
#[test]
fn the_variance_counts_samples_by_their_weights() {
    let spec = spec(96, 96, SplatFilter::Box);
    let (mut film, mut random) = (film(spec), Random(31));
    // A quarter of the samples has the weight 1; without the weights the variance would be four times as large.
    let weights: Vec<f32> = (0..16).map(|i| if i % 4 == 0 { 1.0 } else { 0.25 }).collect();
    for weight in weights {
        let samples = (0..96 * 96).map(|i| {
            let uv = [(i % 96) as f32 + 0.5, (i / 96) as f32 + 0.5].map(|at| at / 96.0);
            Sample { uv, xyz: Xyz::new(1.0, 0.5 + random.f32(), 1.0) * weight, w: weight }
        });
        film.add(&samples.collect::<Vec<_>>()).expect("add");
        film.flush().expect("flush");
    }
    let data = film.develop().expect("develop");
    let means: Vec<f64> = data.camera.iter().map(|sum| f64::from(sum[1] / sum[3])).collect();
    let mean = means.iter().sum::<f64>() / means.len() as f64;
    let real = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / means.len() as f64;
    let stated = develop::mean_variance(&data, spec.filter.energy());
    let stated = stated.iter().map(|v| f64::from(*v)).sum::<f64>() / stated.len() as f64;
    assert!((stated / real - 1.0).abs() < 0.2, "{stated:e} of {real:e}");
}

/// Sums at the end of the range: no NaN, and 8-bit output for any brightness.
#[test]
fn extreme_values_do_not_spread() {
    let spec = spec(9, 9, SplatFilter::Gaussian);
    for value in [1e-45, 1e-38, 1e30] {
        let huge = Sample { uv: [0.5, 0.5], xyz: Xyz::new(f32::MAX, f32::MAX, f32::MAX), w: 1.0 };
        let mut film = film(spec);
        let samples = lattice(&spec, 2, Xyz::new(value, value, value), 1.0);
        // Two of these would be infinite, and the blur would carry that to every pixel.
        assert_eq!(huge.xyz.x + huge.xyz.x, f32::INFINITY);
        film.add(&[huge, huge]).expect("add");
        for _ in 0..3 {
            film.add(&samples).expect("add");
            film.flush().expect("flush");
        }
        for method in METHODS {
            let rgb = film.display(&settings(method, 0.5)).expect("display").rgb;
            let wanted = if value > 1.0 { 200..=255 } else { 0..=1 };
            assert!(rgb.iter().flatten().all(|c| wanted.contains(c)), "{value:e} {method:?} {:?}", rgb[40]);
        }
    }
}

/// Any bits as samples, any size, any settings: no panic, every pixel finite.
#[test]
fn any_bits_are_survived() {
    let mut state = Random(21);
    let mut bits = || (state.f32().to_bits() << 9) ^ (state.f32() * 16_777_216.0) as u32;
    for round in 0..150 {
        let filter = FILTERS[round % 3];
        let spec = spec(1 + bits() % 40, 1 + bits() % 40, filter);
        let mut film = film(spec);
        for _ in 0..3 {
            let samples: Vec<Sample> = (0..bits() % 300)
                .map(|i| {
                    let mut any = || f32::from_bits(bits());
                    let mut s = Sample { uv: [any(), any()], xyz: Xyz::new(any(), any(), any()), w: any() };
                    // Most of them where they hit the film.
                    if i % 4 > 0 {
                        s.uv = [any().rem_euclid(1.0), any().rem_euclid(1.0)];
                    }
                    s
                })
                .collect();
            film.add(&samples).expect("add");
            film.count_paths(PathCounts { camera: u64::MAX, light: u64::from(bits()) << 31 });
            let vm = f32::from_bits(bits());
            let settings = Settings {
                vm: if round % 2 == 0 { vm } else { 0.5 },
                exposure: f32::from_bits(bits()),
                contrast: f32::from_bits(bits()),
                gamma: f32::from_bits(bits()),
                ..settings(METHODS[round % 4], 0.0)
            };
            let picture = film.display(&settings).expect("display");
            assert_eq!(picture.rgb.len(), (spec.width * spec.height) as usize);
        }
        let data = film.develop().expect("develop");
        assert!(data.camera.iter().flatten().chain(data.light.iter().flatten()).all(|v| v.is_finite()));
    }
}

#[test]
fn impossible_films_are_refused() {
    for (width, height) in [(0, 1), (1, 0), (u32::MAX, 1), (16_384, 1)] {
        let error = ReferenceFilm::new(spec(width, height, SplatFilter::Gaussian), 1).err().expect("refused");
        assert!(matches!(error, ClientError::Extent { .. }) && error.to_string().contains("--size"));
    }
    assert!(ReferenceFilm::new(spec(16_384, 1, SplatFilter::Box), 0).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    /// Light scaled by a power of two gives the same sums times that power, to the bit, and the same variance in units of its own scale;
    /// cut into calls and batches anywhere.
    #[test]
    fn scaled_light_gives_scaled_sums(exponent in -60..60i32, n in 1..4000usize, cut in 1..500usize) {
        let spec = spec(16, 11, SplatFilter::Gaussian);
        let (samples, scale) = (mixed(&spec, n), 2f32.powi(exponent));
        let bright: Vec<Sample> = samples.iter().map(|s| Sample { xyz: Xyz::new(s.xyz.x * scale, s.xyz.y * scale, s.xyz.z * scale), ..*s }).collect();
        let (mut plain, mut scaled) = (film(spec), film(spec));
        plain.add(&samples).expect("add");
        bright.chunks(cut).for_each(|part| scaled.add(part).expect("add"));
        let (plain, scaled) = (plain.develop().expect("develop"), scaled.develop().expect("develop"));
        for (a, b) in [(&plain.camera, &scaled.camera), (&plain.light, &scaled.light)] {
            let expected: Vec<_> = a.iter().map(|[x, y, z, w]| [x * scale, y * scale, z * scale, *w]).collect();
            prop_assert_eq!(&expected, b);
        }
        let relative = scaled.luminance_scale / plain.luminance_scale;
        let expected: Vec<_> = plain.camera_variance.iter().map(|v| v * (scale / relative).powi(2)).collect();
        prop_assert_eq!(expected, scaled.camera_variance);
    }

    /// Another order of the samples changes sums and deviations only by their last digits: merging batches is associative.
    #[test]
    fn order_does_not_matter(seed in any::<u64>(), n in 2..6000usize, cut in 1..2000usize) {
        let spec = spec(9, 7, SplatFilter::Tent);
        let mut samples = mixed(&spec, n);
        let add = |samples: &[Sample]| {
            let mut film = film(spec);
            for part in samples.chunks(cut) {
                film.add(part).expect("add");
                // Each part is a batch of its own.
                film.flush().expect("flush");
            }
            film.develop().expect("develop")
        };
        let in_order = add(&samples);
        let mut random = Random(seed);
        (1..n).rev().for_each(|i| samples.swap(i, random.below(i + 1)));
        let shuffled = add(&samples);
        let close = |a: f32, b: f32, most: f32| (a - b).abs() <= most * a.abs().max(b.abs()).max(1e-3);
        for (a, b) in in_order.camera.iter().zip(&shuffled.camera) {
            prop_assert!((0..4).all(|i| close(a[i], b[i], 3e-6)), "{:?} {:?}", a, b);
        }
        // Each variance is in units of the film's own luminance scale, which follows from the samples that came first.
        let units = (shuffled.luminance_scale / in_order.luminance_scale).powi(2);
        for (a, b) in in_order.camera_variance.iter().zip(&shuffled.camera_variance) {
            prop_assert!(close(*a, b * units, 1e-4), "variances {} {}", a, b * units);
        }
    }
}

/// The film on the CPU knows no output but that of 8 bits, whatever it is asked for.
#[test]
fn pictures_have_eight_bits_for_any_output() {
    let spec = spec(9, 7, SplatFilter::Box);
    let mut film = film(spec);
    film.add(&mixed(&spec, 2000)).expect("add");
    let mut shown = |output| film.display(&Settings { output, ..Settings::default() }).expect("display").rgb;
    assert_eq!(shown(ColorOutput::ScRgb), shown(ColorOutput::Sdr));
}
