//! Adaptive filtering of the light stream: energy at borders, the rate of the width, consistency, hard cases.

use glam::Vec4;
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::reference::adaptive_filter::{RATE, SAMPLES, adaptive_filter, interpolation};
use pointillist::client::reference::mips::polyphase;
use pointillist::client::{AdaptiveFilter, Film, FilmSpec, Reconstruction, Settings, SplatFilter};
use pointillist::color::Xyz;
use pointillist::image::Grid;
use pointillist::math::random::Random;
use pointillist::stream::{PathCounts, Sample};

fn grid(width: usize, height: usize, texel: impl FnMut((usize, usize)) -> Vec4) -> Grid<Vec4> {
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    Grid::from_rows(width, height, places.map(texel).collect()).unwrap()
}

fn filtered(sums: &Grid<Vec4>) -> Grid<Vec4> {
    adaptive_filter(sums.clone(), 1.0, 0).unwrap()
}

/// Totals of the four channels, in double precision.
fn totals(sums: &Grid<Vec4>) -> [f64; 4] {
    let mut totals = [0.0; 4];
    for sum in sums.pixels() {
        totals.iter_mut().zip(sum.to_array()).for_each(|(total, value)| *total += f64::from(value));
    }
    totals
}

fn bits(sums: &Grid<Vec4>) -> Vec<[u32; 4]> {
    sums.pixels().iter().map(|sum| sum.to_array().map(f32::to_bits)).collect()
}

/// Interpolation is the transposed average, smoothed: a constant stays, and every coarse texel gives all that it has.
#[test]
fn interpolation_keeps_energy_and_constants() {
    for m in 1..80usize {
        let n = (m / 2).max(1);
        let (mut given, mut mean) = (vec![0.0f64; n], vec![0.0f64; n]);
        for j in 0..m {
            let (i, weights) = interpolation(m, j);
            let sum: f32 = weights.iter().sum();
            assert!((sum - 1.0).abs() < 1e-6, "{m}: texel {j} gets {sum}");
            for (k, weight) in weights.into_iter().enumerate() {
                assert!(weight >= 0.0);
                given[(i + k).saturating_sub(1).min(n - 1)] += f64::from(weight);
            }
        }
        for (i, mean) in mean.iter_mut().enumerate() {
            *mean = polyphase(m, i).1.iter().map(|w| f64::from(*w)).sum();
        }
        let share = m as f64 / n as f64;
        assert!(given.iter().all(|sum| (sum - share).abs() < 1e-5 * share), "{m}: {given:?}");
        assert!(mean.iter().all(|sum| (sum - 1.0).abs() < 1e-6), "{m}: {mean:?}");
    }
}

/// One sample in each corner, along a border, and anywhere, of even and odd sizes: the total of each channel stays.
#[test]
fn light_is_kept_at_borders_and_corners() {
    for (width, height) in [(2, 2), (3, 5), (7, 1), (1, 33), (16, 16), (37, 21), (64, 63), (129, 40)] {
        let (right, bottom) = (width - 1, height - 1);
        for place in [(0, 0), (right, 0), (0, bottom), (right, bottom), (width / 2, 0), (width / 3, bottom)] {
            let sums = grid(width, height, |at| match at == place {
                true => Vec4::new(0.3, 2.0, 7.0, 1.0),
                false => Vec4::ZERO,
            });
            let result = filtered(&sums);
            for (got, wanted) in totals(&result).into_iter().zip(totals(&sums)) {
                assert!(
                    (got / wanted - 1.0).abs() < 2e-6,
                    "{width}×{height} at {place:?}: {got} of {wanted}"
                );
            }
            // One sample spreads over all that there is. Texels of narrow pictures are counted as squares, which makes kernels smaller.
            if width.max(height) <= 2 * width.min(height) {
                assert!(result.pixels().iter().all(|sum| sum.y > 0.0), "{width}×{height} at {place:?}");
            }
        }
    }
}

/// An even field stays even up to its corners, at every density.
#[test]
fn constants_stay_constant() {
    for weight in [1e-3, 0.1, 3.0, 1e4] {
        for (width, height) in [(1, 1), (5, 3), (31, 18), (64, 64)] {
            let value = Vec4::new(0.5, 1.0, 2.0, 1.0) * weight;
            let result = filtered(&grid(width, height, |_| value));
            let off = result.pixels().iter().map(|sum| (*sum / value - 1.0).abs().max_element());
            assert!(off.fold(0.0, f32::max) < 2e-6, "{width}×{height} of {weight}");
        }
    }
}

/// The second moment of the kernel falls with the density at the stated rate.
///
/// X of one texel does not influence widths, which follow Y: the result in X is the kernel there.
#[test]
fn the_width_falls_at_the_stated_rate() {
    let size = 256;
    let moment = |density: f32| {
        let mut sum = 0.0;
        // Kernels are centred on texels of the pyramid: an average over all offsets from these, along both axes.
        let places: Vec<_> = (0..32).map(|k| (112 + k * 11 % 32, 112 + k * 19 % 32)).collect();
        for &place in &places {
            let x = |at| if at == place { 1.0 } else { 0.0 };
            let sums = grid(size, size, |at| Vec4::new(x(at), density, 0.0, density));
            for (i, texel) in filtered(&sums).pixels().iter().enumerate() {
                let d = [(i % size) as f64 - place.0 as f64, (i / size) as f64 - place.1 as f64];
                sum += f64::from(texel.x) * (d[0] * d[0] + d[1] * d[1]);
            }
        }
        sum / places.len() as f64
    };
    let densities = [0.02f32, 0.08, 0.32, 1.28];
    let moments = densities.map(moment);
    for (pair, density) in moments.windows(2).zip(densities) {
        let rate = (pair[0] / pair[1]).log(4.0);
        assert!((rate - f64::from(RATE)).abs() < 0.15, "at {density}: {rate}, {moments:?}");
    }
    // From here on a texel is as it was.
    assert_eq!(moment(SAMPLES.powf(RATE.recip()) * 1.01), 0.0);
}

/// Where there are enough samples everywhere, noise and edges included, the sums stay bit for bit; so they do in the displayed picture.
#[test]
fn dense_sums_stay_as_they_are() {
    let mut random = Random(5);
    let sums = grid(61, 40, |(x, y)| {
        let weight = if x > 30 { 160.0 } else { 3000.0 } * (0.9 + 0.2 * random.f32());
        Vec4::new(0.2 * weight, weight * (1.0 + y as f32), weight, weight)
    });
    assert_eq!(bits(&filtered(&sums)), bits(&sums));

    let spec = FilmSpec {
        width: 24,
        height: 17,
        filter: SplatFilter::Gaussian,
        variance: None,
        sums: Default::default(),
    };
    let mut film = ReferenceFilm::new(spec, 1).unwrap();
    let window = spec.window();
    let samples: Vec<Sample> = (0..300_000)
        .map(|_| {
            let uv = [0, 1].map(|i| window.min[i] + (window.max[i] - window.min[i]) * random.f32());
            Sample { uv, xyz: Xyz::new(0.3, 0.2 + random.f32(), 0.1), w: -1.0 }
        })
        .collect();
    film.add(&samples).unwrap();
    film.count_paths(PathCounts { camera: 0, light: 300_000 });
    let settings = |adaptive_filter| Settings { adaptive_filter, ..Settings::default() };
    let before = film.develop().unwrap();
    let shown = film.display(&settings(AdaptiveFilter::Light)).unwrap();
    assert_eq!(shown, film.display(&settings(AdaptiveFilter::Off)).unwrap());
    // Files hold the sums, which no display changes.
    assert_eq!(before, film.develop().unwrap());
}

/// A picture of the camera stream does not know the filter, nor does one whose texels are to be shown as they are.
#[test]
fn other_pictures_do_not_change() {
    let spec = FilmSpec {
        width: 40,
        height: 30,
        filter: SplatFilter::Gaussian,
        variance: None,
        sums: Default::default(),
    };
    for (weight, reconstruction, changes) in [
        (1.0, Reconstruction::Gaussian, false),
        (-1.0, Reconstruction::None, false),
        (-1.0, Reconstruction::Gaussian, true),
    ] {
        let (mut film, mut random) = (ReferenceFilm::new(spec, 2).unwrap(), Random(8));
        let samples: Vec<Sample> = (0..500)
            .map(|_| Sample {
                uv: [random.f32(), random.f32() * 0.7],
                xyz: Xyz::new(1.0, random.f32(), 0.5),
                w: weight,
            })
            .collect();
        film.add(&samples).unwrap();
        film.count_paths(PathCounts { camera: 500, light: 500 });
        let settings = |adaptive_filter| Settings { adaptive_filter, reconstruction, ..Settings::default() };
        let [on, off] = [AdaptiveFilter::Light, AdaptiveFilter::Off]
            .map(|filter| film.display(&settings(filter)).unwrap());
        assert_eq!(on != off, changes, "{weight} {reconstruction:?}");
    }
}

/// Light of a known density with an edge: where samples are few the filter takes most of the error away, and where they are many it adds
/// none. Both pictures are of the same samples, many times over.
#[test]
fn errors_fall_early_and_are_those_of_the_sums_late() {
    let (width, height) = (64, 48);
    let truth = |x: usize, y: usize| {
        let smooth = 1.0 + 0.5 * (x as f64 / 9.0).sin() + 0.01 * y as f64;
        if (20..30).contains(&y) && x > 12 { 6.0 * smooth } else { 0.5 * smooth }
    };
    let mut random = Random(77);
    let mut errors = |mean: f64, runs: usize| {
        let [mut plain, mut adaptive] = [0.0, 0.0];
        for _ in 0..runs {
            let sums =
                grid(width, height, |(x, y)| Vec4::splat(poisson(mean * truth(x, y), &mut random) as f32));
            for (sums, error) in [(&sums, &mut plain), (&filtered(&sums), &mut adaptive)] {
                for (i, sum) in sums.pixels().iter().enumerate() {
                    let wanted = truth(i % width, i / width);
                    *error += (f64::from(sum.y) / mean - wanted).powi(2) / (wanted * wanted + 0.01);
                }
            }
        }
        adaptive / plain
    };
    let early = errors(0.3, 8);
    assert!(early < 0.25, "few samples: {early} of the error");
    for mean in [60.0, 250.0, 4000.0] {
        let late = errors(mean, 4);
        assert!(late < 1.02, "{mean} samples per texel: {late} of the error");
    }
}

/// A number of Poisson's distribution; a normal one rounded, where it is large.
fn poisson(mean: f64, random: &mut Random) -> f64 {
    if mean > 200.0 {
        let normal: f64 = (0..12).map(|_| f64::from(random.f32())).sum::<f64>() - 6.0;
        return (mean + mean.sqrt() * normal).round().max(0.0);
    }
    let (limit, mut product, mut count) = ((-mean).exp(), f64::from(random.f32()), 0.0);
    while product > limit {
        product *= f64::from(random.f32());
        count += 1.0;
    }
    count
}

/// Nothing, one pixel, everything in one pixel, light without luminance, and the brightest values: all finite, none negative, none lost.
#[test]
fn hard_cases() {
    let empty = grid(9, 6, |_| Vec4::ZERO);
    assert_eq!(filtered(&empty), empty);
    let single = grid(1, 1, |_| Vec4::new(1.0, 2.0, 3.0, 4.0));
    assert_eq!(filtered(&single), single);
    for value in [
        Vec4::new(1e6, 2e6, 1e6, 1e6),
        Vec4::new(1e30, 1e30, 1e30, 1.0),
        Vec4::new(3.0, 0.0, 1.0, 2.0),
        Vec4::new(1e-30, 1e-30, 1e-30, 1e-9),
    ] {
        for place in [(0, 0), (5, 8), (16, 12)] {
            let sums = grid(17, 13, |at| if at == place { value } else { Vec4::ZERO });
            let result = filtered(&sums);
            assert!(result.pixels().iter().all(|sum| sum.is_finite() && sum.min_element() >= 0.0), "{value}");
            for (got, wanted) in totals(&result).into_iter().zip(totals(&sums)) {
                assert!((got - wanted).abs() <= 1e-5 * wanted, "{value} at {place:?}: {got} of {wanted}");
            }
        }
    }
    // Samples outside of the picture, and none: the film shows black.
    let spec = FilmSpec {
        width: 1,
        height: 1,
        filter: SplatFilter::Gaussian,
        variance: None,
        sums: Default::default(),
    };
    let mut film = ReferenceFilm::new(spec, 1).unwrap();
    film.count_paths(PathCounts { camera: 0, light: 9 });
    film.add(&[Sample { uv: [40.0, -3.0], xyz: Xyz::new(1.0, 1.0, 1.0), w: -1.0 }]).unwrap();
    assert_eq!(film.display(&Settings::default()).unwrap().rgb, [[0; 3]]);
}
