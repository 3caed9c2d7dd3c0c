//! The noise filter of the display: what it keeps, what it removes, what it does not spread.

use glam::{Vec3, Vec4};
use pointillist::client::wavelet::{Filtered, HalfPicture, PixelFeatures, WaveletFilter};
use pointillist::image::Grid;
use pointillist::math::random::Random;

const SIZE: usize = 96;

fn half(value: impl Fn(usize, usize) -> Vec4) -> HalfPicture {
    let mut half = Grid::try_filled(SIZE, SIZE, Vec4::ZERO).expect("memory");
    half.pixels_mut().iter_mut().enumerate().for_each(|(i, out)| *out = value(i % SIZE, i / SIZE));
    half
}

fn grey(y: f32) -> Vec4 {
    Vec3::splat(y).extend(2.0)
}

fn filtered(halves: [&HalfPicture; 2], features: Option<[&Grid<PixelFeatures>; 2]>) -> Option<Filtered> {
    WaveletFilter::after(None, [halves[0].width(), halves[0].height()], features)?.filtered(halves)
}

/// Numbers of mean 0 and variance 1.
fn noise(seed: u64) -> Vec<f32> {
    let mut random = Random(seed);
    (0..SIZE * SIZE).map(|_| (0..12).map(|_| random.f32()).sum::<f32>() - 6.0).collect()
}

fn features(of: impl Fn(usize) -> PixelFeatures) -> Grid<PixelFeatures> {
    let mut grid = Grid::try_filled(SIZE, SIZE, PixelFeatures::default()).expect("memory");
    grid.pixels_mut().iter_mut().enumerate().for_each(|(i, out)| *out = of(i % SIZE));
    grid
}

fn moments(picture: &Grid<Vec3>, of: impl Fn(usize, usize) -> bool) -> (f64, f64) {
    let values =
        (0..SIZE * SIZE).filter(|i| of(i % SIZE, i / SIZE)).map(|i| f64::from(picture.pixels()[i].y));
    let (n, sum, squares) = values.fold((0.0, 0.0, 0.0), |(n, s, q), v| (n + 1.0, s + v, q + v * v));
    (sum / n, squares / n - (sum / n).powi(2))
}

#[test]
fn what_both_halves_say_comes_back() {
    let constant = half(|_, _| grey(0.7));
    let picture = filtered([&constant, &constant], None).expect("memory").picture;
    assert!(picture.pixels().iter().all(|v| (*v - 0.7).abs().max_element() < 1e-6));
    let detail = noise(1);
    let textured = half(|x, y| {
        let v = detail[y * SIZE + x].abs();
        Vec4::new(v, 2.0 * v + 0.1, 3.0 - v, 5.0)
    });
    let picture = filtered([&textured, &textured], None).expect("memory").picture;
    for (found, was) in picture.pixels().iter().zip(textured.pixels()) {
        assert!((*found - was.truncate()).abs().max_element() < 2e-5, "{found} instead of {was}");
    }
}

#[test]
fn noise_on_a_plain_falls_sixtyfold() {
    let [a, b] = [1, 2].map(|seed| {
        let noise = noise(seed);
        half(move |x, y| grey(1.0 + 0.3 * noise[y * SIZE + x]))
    });
    let (mean, variance) = moments(&filtered([&a, &b], None).expect("memory").picture, |_, _| true);
    assert!((mean - 1.0).abs() < 5e-3, "mean {mean}");
    assert!(variance < 0.5 * 0.3 * 0.3 / 60.0, "the variance falls {}-fold", 0.045 / variance);
}

/// A pixel that one half alone has seen stays, with its light, and changes nothing around it.
#[test]
fn fireflies_do_not_spread() {
    let a = half(|x, y| grey(if (x, y) == (40, 50) { 100.0 } else { 1.0 }));
    let b = half(|_, _| grey(1.0));
    let picture = filtered([&a, &b], None).expect("memory").picture;
    for (i, v) in picture.pixels().iter().enumerate() {
        if i != 50 * SIZE + 40 {
            assert!((*v - 1.0).abs().max_element() < 0.01, "pixel {i}: {v}");
        }
    }
    let (mean, _) = moments(&picture, |_, _| true);
    let exact = 1.0 + 0.5 * 99.0 / (SIZE * SIZE) as f64;
    assert!((mean / exact - 1.0).abs() < 3e-4, "mean {mean} instead of {exact}");
}

/// Nothing crosses an edge that a feature has, whichever it is.
#[test]
fn features_keep_edges() {
    let [a, b] = [3, 4].map(|seed| {
        let noise = noise(seed);
        half(move |x, y| grey(if x < SIZE / 2 { 1.0 } else { 0.1 } * (1.0 + 0.3 * noise[y * SIZE + x])))
    });
    let sides: [fn(f32) -> PixelFeatures; 3] = [
        |side| PixelFeatures { albedo: Vec3::splat(0.2 + 0.5 * side), distance: 1.0, ..Default::default() },
        |side| PixelFeatures {
            normal: Vec3::new(side, 0.0, 1.0 - side),
            distance: 1.0,
            ..Default::default()
        },
        |side| PixelFeatures { distance: 1.0 + side, ..Default::default() },
    ];
    for of in sides {
        let known = features(|x| of(if x < SIZE / 2 { 0.0 } else { 1.0 }));
        let picture = filtered([&a, &b], Some([&known, &known])).expect("memory").picture;
        let (left, _) = moments(&picture, |x, _| x == SIZE / 2 - 1);
        let (right, _) = moments(&picture, |x, _| x == SIZE / 2);
        assert!(
            (left - 1.0).abs() < 0.03 && (right - 0.1).abs() < 0.01,
            "{left} and {right} beside the edge"
        );
    }
}

/// Where few pixels have samples, those that have none show what is around them.
#[test]
fn pixels_without_samples_are_missing_and_not_black() {
    let [a, b] = [5, 6].map(|seed| {
        let noise = noise(seed);
        half(move |x, y| if noise[y * SIZE + x] > 1.3 { grey(0.4) } else { Vec4::ZERO })
    });
    let picture = filtered([&a, &b], None).expect("memory").picture;
    assert!(picture.pixels().iter().all(|v| (*v - 0.4).abs().max_element() < 1e-5));
    let nothing = half(|_, _| Vec4::ZERO);
    let picture = filtered([&nothing, &nothing], None).expect("memory").picture;
    assert!(picture.pixels().iter().all(|v| *v == Vec3::ZERO));
    let wrong = half(|x, _| if x == 7 { Vec4::splat(f32::NAN) } else { grey(0.4) });
    let picture = filtered([&wrong, &wrong], None).expect("memory").picture;
    assert!(picture.pixels().iter().all(|v| (*v - 0.4).abs().max_element() < 1e-5));
}

/// Other units of light are another scale of the same picture.
#[test]
fn the_filter_knows_no_exposure() {
    let [a, b] = [7, 8].map(|seed| {
        let noise = noise(seed);
        half(move |x, y| grey((1.0 + 0.3 * noise[y * SIZE + x]) * (1.0 + (x / 16) as f32)))
    });
    let scaled = |half: &HalfPicture, by: f32| {
        let mut scaled = half.clone();
        scaled.pixels_mut().iter_mut().for_each(|v| *v *= Vec4::new(by, by, by, 1.0));
        scaled
    };
    let usual = filtered([&a, &b], None).expect("memory").picture;
    for by in [2f32.powi(20), 2f32.powi(-20)] {
        let picture = filtered([&scaled(&a, by), &scaled(&b, by)], None).expect("memory").picture;
        assert!(picture.pixels().iter().zip(usual.pixels()).all(|(v, u)| *v == *u * by));
    }
}

/// A filter that was used before gives the same picture as a new one.
#[test]
fn a_filter_keeps_nothing_of_the_picture_before() {
    let [a, b, c, d] = [11, 12, 13, 14].map(|seed| {
        let noise = noise(seed);
        half(|x, y| grey(2.0 + noise[y * SIZE + x]))
    });
    let mut filter = WaveletFilter::after(None, [SIZE; 2], None).expect("memory");
    filter.filtered([&a, &b]).expect("memory");
    let again = filter.filtered([&c, &d]).expect("memory").picture;
    assert!(again == filtered([&c, &d], None).expect("memory").picture);
}

/// Two halves and their features for a picture of any size: a wave with noise, edges, lights and missing pixels.
struct AnyPicture {
    halves: [HalfPicture; 2],
    features: Grid<PixelFeatures>,
}

impl AnyPicture {
    fn new(width: usize, height: usize) -> Self {
        let mut random = Random((width * 1000 + height) as u64);
        let mut half = || {
            let mut half = Grid::try_filled(width, height, Vec4::ZERO).expect("memory");
            for (i, out) in half.pixels_mut().iter_mut().enumerate() {
                let wave = 1.5 + (0.3 * (i % width) as f32).sin() + (0.2 * (i / width) as f32).cos();
                let [noise, missing] = [random.f32(), random.f32()];
                *out = if missing < 0.3 { Vec4::ZERO } else { grey(wave * (0.5 + noise)) };
            }
            half
        };
        let halves = [half(), half()];
        let mut features = Grid::try_filled(width, height, PixelFeatures::default()).expect("memory");
        for (i, out) in features.pixels_mut().iter_mut().enumerate() {
            let [x, y] = [i % width, i / width];
            *out = PixelFeatures {
                albedo: Vec3::new(0.2, 0.5, if x / 11 % 2 == 0 { 0.1 } else { 0.6 }),
                normal: if y / 7 % 2 == 0 { Vec3::Y } else { Vec3::Z },
                distance: 2.0 + 0.01 * (x + y) as f32,
                emits: (x + y) % 23 == 5,
            };
        }
        Self { halves, features }
    }

    fn features(&self) -> Option<[&Grid<PixelFeatures>; 2]> {
        Some([&self.features; 2])
    }

    fn filtered(&self) -> Filtered {
        filtered(self.halves.each_ref(), self.features()).expect("memory")
    }

    /// The same with x and y exchanged.
    fn transposed(&self) -> Self {
        Self { halves: self.halves.each_ref().map(transposed), features: transposed(&self.features) }
    }
}

fn transposed<T: Copy + Default>(grid: &Grid<T>) -> Grid<T> {
    let mut out = Grid::try_filled(grid.height(), grid.width(), T::default()).expect("memory");
    for (i, value) in out.pixels_mut().iter_mut().enumerate() {
        *value = grid.at(i / grid.height(), i % grid.height());
    }
    out
}

/// How rows are shared out among threads leaves no trace.
#[test]
fn threads_leave_no_trace() {
    for [width, height] in [[37, 90], [150, 91], [40, 300]] {
        let picture = AnyPicture::new(width, height);
        let [usual, same @ ..] = [1, 2, 7].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| picture.filtered())
        });
        for same in same {
            assert!(same.picture == usual.picture && same.finest == usual.finest, "{width}×{height}");
        }
    }
}

/// The transform treats rows and columns alike, in pictures that are smaller than its steps as well: exchanged, they give the same picture
/// but for rounding.
#[test]
fn rows_and_columns_are_alike() {
    for [width, height] in [[1, 1], [1, 40], [3, 7], [17, 33], [70, 41]] {
        let picture = AnyPicture::new(width, height);
        let (found, other) = (picture.filtered(), picture.transposed().filtered());
        for (a, b) in found.picture.pixels().iter().zip(transposed(&other.picture).pixels()) {
            assert!(a.is_finite() && (*a - *b).abs().max_element() < 1e-4, "{width}×{height}: {a}, {b}");
        }
        for (a, b) in found.finest.pixels().iter().zip(transposed(&other.finest).pixels()) {
            assert!((0.0..=1.0).contains(a) && (a - b).abs() < 1e-3, "{width}×{height}: gains {a}, {b}");
        }
    }
}

/// A filter in the memory of another has nothing of that: not its weights, nor its features.
#[test]
fn a_filter_in_the_memory_of_another_is_as_a_new_one() {
    let picture = AnyPicture::new(50, 37);
    let halves = picture.halves.each_ref();
    let mut last = None;
    for features in [picture.features(), None, picture.features()] {
        let mut filter = WaveletFilter::after(last, [50, 37], features).expect("memory");
        let (found, new) = (filter.filtered(halves), filtered(halves, features));
        let [found, new] = [found, new].map(|filtered| filtered.expect("memory"));
        assert!(found.picture == new.picture && found.finest == new.finest);
        last = Some(filter);
    }
}

/// Beside bright samples, which are kept where both halves see them, no pixel is darker than black.
#[test]
fn no_light_is_negative_beside_bright_samples() {
    let mut random = Random(5);
    let mut sparse = || {
        let values: Vec<f32> =
            (0..SIZE * SIZE).map(|_| if random.f32() < 0.02 { 40.0 } else { random.f32() }).collect();
        half(|x, y| grey(values[y * SIZE + x]))
    };
    let picture = filtered([&sparse(), &sparse()], None).expect("memory").picture;
    let least = picture.pixels().iter().map(|xyz| xyz.y).fold(f32::INFINITY, f32::min);
    assert!(least >= 0.0, "{least}");
}

/// While samples are added one by one the picture changes less than without the filter, in the mean and where it changes most.
#[test]
fn the_picture_does_not_flicker_while_it_converges() {
    let signal =
        |x: usize, y: usize| 1.0 + 0.5 * (0.2 * x as f32).sin() + if y > SIZE / 2 { 1.0 } else { 0.0 };
    let samples: Vec<[Vec<f32>; 2]> = (0..17).map(|n| [noise(100 + n), noise(200 + n)]).collect();
    // Luminances are positive and their noise is skewed, as that of light transport is.
    let sample = |noise: f32| (0.8 * noise - 0.32).exp();
    let mean = |count: usize, of: usize, i: usize| {
        samples[..count].iter().map(|halves| sample(halves[of][i])).sum::<f32>() / count as f32
    };
    let halves = |count: usize| {
        [0, 1].map(|of| {
            half(|x, y| Vec3::splat(signal(x, y) * mean(count, of, y * SIZE + x)).extend(count as f32))
        })
    };
    let mut filter = WaveletFilter::after(None, [SIZE; 2], None).expect("memory");
    let mut pictures = |count: usize| {
        let [a, b] = halves(count);
        let shown = filter.filtered([&a, &b]).expect("memory").picture;
        let plain = a.pixels().iter().zip(b.pixels()).map(|(a, b)| 0.5 * (a.y + b.y)).collect::<Vec<_>>();
        [shown.pixels().iter().map(|xyz| xyz.y).collect(), plain]
    };
    // Root mean square and 99.9th percentile of the change.
    let change = |before: &[f32], after: &[f32]| {
        let mut all: Vec<f32> = before.iter().zip(after).map(|(a, b)| (a - b).abs()).collect();
        all.sort_by(f32::total_cmp);
        let squares: f32 = all.iter().map(|d| d * d).sum();
        [(squares / all.len() as f32).sqrt(), all[all.len() * 999 / 1000]]
    };
    let mut before = pictures(1);
    for count in 2..=16 {
        let after = pictures(count);
        let [shown, plain] = [0, 1].map(|i| change(&before[i], &after[i]));
        let ratios = [shown[0] / plain[0], shown[1] / plain[1]];
        println!("{count} samples per half: {:.2} in the mean, {:.2} at most", ratios[0], ratios[1]);
        assert!(ratios[0] < 0.5 && ratios[1] < 0.8, "{count}: {ratios:?}");
        before = after;
    }
}
