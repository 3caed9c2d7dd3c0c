//! Formulas of the paper that are numerically unsafe: each is shown to fail beside the one that is used instead.

use pointillist::client::lod::{StreamLod, TARGET_RELATIVE_VARIANCE};
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::reference::fold::two_float_add;
use pointillist::client::reference::tonemap::ToneMapper;
use pointillist::client::{Film, FilmData, FilmSpec, Reconstruction, Settings, SplatFilter, VarianceForm};
use pointillist::color::{Profile, Xyz};
use pointillist::math::random::Random;
use pointillist::stream::Sample;

use glam::{Mat3, Vec3};

fn grey(y: f32, w: f32) -> Sample {
    Sample { uv: [0.5, 0.5], xyz: Xyz::new(y, y, y), w }
}

/// A film of one texel that exactly receives the samples, `batch` at a time.
fn one_texel(form: VarianceForm, samples: &[Sample], batch: usize) -> FilmData {
    let spec = FilmSpec {
        width: 1,
        height: 1,
        filter: SplatFilter::Box,
        variance: Some(form),
        sums: Default::default(),
    };
    let mut film = ReferenceFilm::new(spec, 1).expect("film");
    for part in samples.chunks(batch) {
        film.add(part).expect("add");
        film.flush().expect("flush");
    }
    film.develop().expect("develop")
}

/// `Σ (Y − Ȳ)²` of a developed texel in luminance².
fn deviations(data: &FilmData) -> f64 {
    f64::from(data.camera_variance[0]) * f64::from(data.luminance_scale).powi(2)
}

/// `Σ w (Y − Ȳ)²` of the samples, in two passes of f64.
fn exact_deviations(samples: &[Sample]) -> f64 {
    let (y, w) = (|s: &Sample| f64::from(s.xyz.y / s.w), |s: &Sample| f64::from(s.w));
    let mean = samples.iter().map(|s| f64::from(s.xyz.y)).sum::<f64>() / samples.iter().map(w).sum::<f64>();
    samples.iter().map(|s| (y(s) - mean).powi(2)).sum()
}

/// The product form gives the sum of squares for batches of any size; the paper's form is low, and
/// says 0 after the first sample of every texel.
#[test]
fn product_form_is_right_for_any_batch() {
    let mut numbers = Random(1);
    let samples: Vec<Sample> = (0..240).map(|_| grey(numbers.f32(), 1.0)).collect();
    let exact = exact_deviations(&samples);
    let mut worst_of_paper = 0.0f64;
    for batch in [1, 2, 3, 7, 60, 240] {
        let product = deviations(&one_texel(VarianceForm::Product, &samples, batch)) / exact;
        assert!((product - 1.0).abs() < 1e-5, "batches of {batch}: {product}");
        let paper = deviations(&one_texel(VarianceForm::Paper, &samples, batch)) / exact;
        worst_of_paper = worst_of_paper.max(1.0 - paper);
    }
    assert!(worst_of_paper > 0.005, "{worst_of_paper}");

    // Unbiased: over many short runs of one-sample batches the mean of V/(n − 1) is σ² = 1/12.
    let (mut product, mut paper, n, runs) = (0.0, 0.0, 4usize, 3000);
    for _ in 0..runs {
        let samples: Vec<Sample> = (0..n).map(|_| grey(numbers.f32(), 1.0)).collect();
        product += deviations(&one_texel(VarianceForm::Product, &samples, 1));
        paper += deviations(&one_texel(VarianceForm::Paper, &samples, 1));
    }
    let relative = |sum: f64| sum / (runs * (n - 1)) as f64 * 12.0;
    // The standard error of the mean of 3000 sample variances of 4 uniform numbers is 1.2 %.
    assert!((relative(product) - 1.0).abs() < 0.05, "{}", relative(product));
    // (n−1)²/n² per term: (1/4 + 4/9 + 9/16 …)/3 of what it should be, about 0.6.
    assert!(relative(paper) < 0.8, "{}", relative(paper));
}

/// A mean of 10^6 times the deviation. The paper's warning about `Y2 − Ȳ²` holds: it fails by far.
#[test]
fn variance_beside_a_large_mean() {
    for (mean, tolerance) in [(1e3f32, 1e-4), (1e5, 1e-3), (1e6, 1e-3)] {
        let mut numbers = Random(2);
        let samples: Vec<Sample> = (0..4000).map(|_| grey(mean + numbers.f32(), 1.0)).collect();
        let exact = exact_deviations(&samples);
        // Some samples per texel and batch, as in a picture. (Thousands in one texel of one batch would
        // make the f32 sum itself, and with it the mean, wrong by more than the deviation.)
        for batch in [1, 4, 16] {
            let data = one_texel(VarianceForm::Product, &samples, batch);
            let relative = deviations(&data) / exact;
            assert!((relative - 1.0).abs() < tolerance, "mean {mean:e}, batches of {batch}: {relative}");
        }
        let squares = samples.iter().fold(0.0f32, |sum, s| sum + s.xyz.y * s.xyz.y);
        let sum = samples.iter().fold(0.0f32, |sum, s| sum + s.xyz.y);
        let naive = f64::from(squares - sum * sum / samples.len() as f32) / exact;
        assert!(mean < 1e5 || (naive - 1.0).abs() > 1.0, "the sum of squares gives {naive} at {mean:e}");
    }
}

/// Equal samples have no variance, in whatever batches and weights.
#[test]
fn equal_samples_have_no_variance() {
    for y in [1.0f32, 0.1, 1e6, 1e-20] {
        let samples: Vec<Sample> = (0..500).map(|i| grey(y, 1.0 + (i % 3) as f32)).collect();
        let samples: Vec<Sample> =
            samples.iter().map(|s| Sample { xyz: Xyz::new(y * s.w, y * s.w, y * s.w), ..*s }).collect();
        for batch in [1, 3, 500] {
            let data = one_texel(VarianceForm::Product, &samples, batch);
            let relative = deviations(&data) / f64::from(y).powi(2);
            // The f32 sum of a batch of 500 is off by up to 500 · 2^-25 / 2 = 7e-6 of itself; weights sum to 1000.
            assert!(relative.abs() < 1000.0 * 5e-11, "{y} in batches of {batch}: {relative:e}");
        }
    }
}

/// 2^26 unit samples into one texel, splatted in batches as the film does it, at batch level: W exact
/// and X within 1e-6, where plain f32 stands still at 2^24.
#[test]
fn sums_of_many_samples_stay_exact() {
    let samples = vec![Sample { xyz: Xyz::new(0.1, 0.1, 0.1), ..grey(0.1, 1.0) }; 1 << 16];
    let data = one_texel(VarianceForm::Product, &samples, 1 << 16);
    let [x, _, _, w] = data.camera[0];
    assert_eq!(w, 65_536.0);
    let (mut sum_w, mut sum_x, mut naive) = ((0.0f32, 0.0f32), (0.0f32, 0.0f32), 0.0f32);
    for _ in 0..1 << 10 {
        sum_w = two_float_add(sum_w.0, sum_w.1, w);
        sum_x = two_float_add(sum_x.0, sum_x.1, x);
    }
    for _ in 0..(1 << 24) + 1000 {
        naive += 1.0;
    }
    assert_eq!(naive, 16_777_216.0, "plain addition stands still");
    assert_eq!(sum_w, (67_108_864.0, 0.0));
    let mean = f64::from(sum_x.0) / f64::from(sum_w.0);
    // Within a batch 65,536 additions of 0.1 round: 2^16 equal steps are off by up to 2^16 · 2^-25.
    assert!((mean / f64::from(x) * 65_536.0 - 1.0).abs() < 1e-7);
    assert!((mean / 0.1 - 1.0).abs() < 2e-3, "{mean}");

    // In batches of a real picture's density, some samples per texel, X is right as well.
    let samples = vec![samples[0]; 1 << 14];
    let [x, _, _, w] = one_texel(VarianceForm::Product, &samples, 16).camera[0];
    assert_eq!(w, 16_384.0);
    assert!((f64::from(x) / 16_384.0 / 0.1 - 1.0).abs() < 1e-6, "{x}");
}

/// Scaling all lights by 2^k leaves the LoD map, hence the blur, as it is: bit for bit the same hue
/// and, at an exposure scaled back, the same picture. The paper's absolute variance would not.
#[test]
fn the_blur_does_not_depend_on_the_exposure() {
    let spec = FilmSpec {
        width: 40,
        height: 30,
        filter: SplatFilter::Gaussian,
        variance: Some(VarianceForm::Product),
        sums: Default::default(),
    };
    let picture = |k: i32| {
        let (mut numbers, scale) = (Random(3), 2.0f32.powi(k));
        let mut film = ReferenceFilm::new(spec, 2).expect("film");
        // Black samples first: the scale must not be taken from them.
        for round in 0..4 {
            let samples: Vec<Sample> = (0..700)
                .map(|_| {
                    let uv = [numbers.f32(), numbers.f32()];
                    let y = if round == 0 { 0.0 } else { numbers.f32().powi(8) * 5.0 * scale };
                    Sample { uv, xyz: Xyz::new(y * 0.5, y, y * 0.25), w: 1.0 }
                })
                .collect();
            film.add(&samples).expect("add");
            film.flush().expect("flush");
        }
        let settings = Settings {
            reconstruction: Reconstruction::Gaussian,
            vm: 0.7,
            exposure: scale.recip(),
            contrast: 1.0,
            ..Settings::default()
        };
        let variance = film.develop().expect("develop").camera_variance;
        (film.display(&settings).expect("display"), variance)
    };
    let unscaled = picture(0);
    for k in (-60..=60).step_by(15) {
        let scaled = picture(k);
        assert_eq!(scaled.1, unscaled.1, "variance in units of the scale, k = {k}");
        assert_eq!(scaled.0, unscaled.0, "k = {k}");
    }
    // The paper's rule with the variance itself moves by k levels.
    let paper = |k: i32| 0.7 * (0.5 * (0.3f32 * 4.0f32.powi(k)).log2());
    assert!((paper(10) - paper(0) - 7.0).abs() < 1e-4);
}

/// No sample, more samples than texels, no variance: always a level that exists.
#[test]
fn levels_are_always_there() {
    for samples in [0, 1, 5, 1 << 20, u64::MAX] {
        for texels in [1, 6, 1 << 18, u64::MAX] {
            let Some(lod) = StreamLod::new(texels, samples, 5) else {
                assert_eq!(samples, 0);
                continue;
            };
            for r in [0.0, 1e-30, TARGET_RELATIVE_VARIANCE, 1.0, f32::MAX, f32::INFINITY, f32::NAN] {
                for vm in [0.0, 0.5, 1e30, -1.0, f32::NAN] {
                    assert!((-1.0..=4.0).contains(&lod.masked(r, vm)), "{texels} {samples} {r} {vm}");
                }
            }
        }
    }
    // The naive levels are infinite without samples or without variance.
    let (texels, samples, variance) = (8.0f32, 0.0f32, 0.0f32);
    assert!((texels / samples).log2().is_infinite() && variance.log2().is_infinite());
}

/// Every 997th f32 from the least denormal to the largest number, rising, and both infinities.
fn positive_floats() -> impl Iterator<Item = f32> {
    (1..=f32::MAX.to_bits()).step_by(997).map(f32::from_bits).chain([f32::MAX, f32::INFINITY])
}

/// The displayed luminance of this scene-linear one.
fn tone_curve(y: f32, exposure: f32, contrast: f32) -> f32 {
    let profile = Profile { from_xyz: Mat3::IDENTITY, ..Profile::srgb() };
    let settings = Settings { exposure, contrast, profile, ..Settings::default() };
    ToneMapper::new(&settings).linear(Vec3::new(0.0, y, 0.0)).y
}

/// Over the whole range the curve is finite, in 0…1 and never falls.
#[test]
fn tone_curve_over_all_floats() {
    for (exposure, contrast) in [(1.0, 1.0), (8.0, 0.5), (0.01, 1.7), (1e30, 1.0)] {
        let mut last = 0.0;
        let profile = Profile { from_xyz: Mat3::IDENTITY, ..Profile::srgb() };
        let settings = Settings { exposure, contrast, profile, ..Settings::default() };
        let mapper = ToneMapper::new(&settings);
        for y in positive_floats() {
            let toned = mapper.linear(Vec3::new(0.0, y, 0.0)).y;
            assert!((0.0..=1.0).contains(&toned), "{y:e} → {toned}");
            // Library functions may step back by a rounding; never by what 8 bits could show.
            assert!(toned >= last - 1.2e-7, "falls at {y:e}: {last:e} → {toned:e}");
            last = toned.max(last);
        }
        assert_eq!(last, 1.0);
        for y in [0.0, -0.0, -1e-45, -1.0, f32::MIN, f32::NEG_INFINITY, f32::NAN] {
            assert_eq!(tone_curve(y, exposure, contrast), 0.0);
        }
    }
    // Near 0 the plain form loses everything.
    let y = 1e-9f32;
    assert_eq!(1.0 - (-y).exp(), 0.0);
    assert!((f64::from(tone_curve(y, 1.0, 1.0)) / f64::from(y) - 1.0).abs() < 1e-6);
    for y in [1e-4f32, 5e-3, 0.009_999, 0.010_001, 0.3] {
        let exact = -(-f64::from(y)).exp_m1();
        assert!((f64::from(tone_curve(y, 1.0, 1.0)) / exact - 1.0).abs() < 1e-5, "{y}");
    }
}

/// sRGB's matrix, so that the test does not hang on what the profile holds.
fn parameters() -> Settings {
    let from_xyz = Mat3::from_cols_array(&[
        3.240_454_2,
        -0.969_266,
        0.055_643_4,
        -1.537_138_5,
        1.876_010_8,
        -0.204_025_9,
        -0.498_531_4,
        0.041_556,
        1.057_225_2,
    ]);
    // White, scaled to X = Y = Z: rows divided by their sums, so that (1, 1, 1) is grey.
    let rows = from_xyz.transpose();
    let row = |r: Vec3| r / r.element_sum();
    let from_xyz = Mat3::from_cols(row(rows.x_axis), row(rows.y_axis), row(rows.z_axis)).transpose();
    Settings { profile: Profile { from_xyz, ..Profile::srgb() }, ..Settings::default() }
}

/// The hue stays at any brightness, where the ratio as printed (Y/Y') or taken first (Y'/Y, which
/// overflows) gives white, black or NaN.
#[test]
fn hue_stays_at_any_brightness() {
    let p = parameters();
    let reference = ToneMapper::new(&p).linear(Vec3::new(0.011, 0.01, 0.009)) / 0.01;
    for exponent in -30..-2 {
        let y = 10.0f32.powi(exponent);
        let rgb = ToneMapper::new(&p).linear(Vec3::new(1.1, 1.0, 0.9) * y);
        assert!((rgb / y / reference - 1.0).abs().max_element() < 0.01, "{y:e}: {rgb}");
    }
    // With contrast 0.5, Y' of the least floats is about 1e-22 and Y'/Y is infinite.
    let root = Settings { contrast: 0.5, ..p.clone() };
    let least = f32::from_bits(100);
    assert!((tone_curve(least, 1.0, 0.5) / least).is_finite());
    let rgb = ToneMapper::new(&root).linear(Vec3::splat(least));
    assert!(rgb.is_finite() && rgb.min_element() > 0.0, "{rgb}");
    let tiny = Settings { contrast: 0.01, ..p };
    assert!((tone_curve(1e-40, 1.0, 0.01) / 1e-40f32).is_infinite());
    let rgb = ToneMapper::new(&tiny).linear(Vec3::splat(1e-40));
    assert!((rgb - rgb.x).abs().max_element() < 1e-6 && rgb.x > 0.1, "{rgb}");
}

/// Any three numbers give a colour, of the luminance that the curve says when that can be shown.
#[test]
fn any_colour_can_be_shown() {
    let p = parameters();
    let weights = p.profile.from_xyz.inverse().row(1);
    let values = [
        0.0,
        1e-45,
        1e-38,
        1e-6,
        0.3,
        1.0,
        7.0,
        1e20,
        f32::MAX,
        f32::INFINITY,
        f32::NAN,
        -1.0,
        -1e-45,
        f32::MIN,
    ];
    for x in values {
        for y in values {
            for z in values {
                let rgb = ToneMapper::new(&p).linear(Vec3::new(x, y, z));
                assert!(rgb.min_element() >= 0.0 && rgb.max_element() <= 1.0, "{x} {y} {z} → {rgb}");
                let luminance = weights.dot(rgb);
                let wanted = tone_curve(y, 1.0, 1.0);
                assert!((luminance - wanted).abs() < 2e-3, "{x} {y} {z}: {luminance} for {wanted}");
            }
        }
    }
}
