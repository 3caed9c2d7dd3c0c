//! Open Image Denoise: the picture that it is given, and where the library is installed, what comes back.

use glam::{Vec3, Vec4};
use pointillist::client::oidn::{OidnFilter, OidnQuality, OidnVersion, input, library};
use pointillist::client::wavelet::{HalfPicture, PixelFeatures};
use pointillist::color::Profile;
use pointillist::image::Grid;
use pointillist::math::random::Random;

const WIDTH: usize = 90;
const HEIGHT: usize = 70;

fn half(value: impl Fn(usize, usize) -> Vec4) -> HalfPicture {
    let mut half = Grid::try_filled(WIDTH, HEIGHT, Vec4::ZERO).unwrap();
    half.pixels_mut().iter_mut().enumerate().for_each(|(i, out)| *out = value(i % WIDTH, i / WIDTH));
    half
}

/// XYZ of a colour in linear Rec.709.
fn xyz(rgb: Vec3) -> Vec3 {
    Profile::srgb().from_xyz.inverse() * rgb
}

/// One surface of albedo 0.5 that looks up.
const PLAIN: [&[[f32; 3]]; 2] = [&[[0.5; 3]; WIDTH * HEIGHT], &[[0.0, 0.0, 1.0]; WIDTH * HEIGHT]];

fn nothing(_: usize, _: usize) -> Vec4 {
    Vec4::ZERO
}

#[test]
fn both_halves_become_one_picture_in_rec709() {
    let (a, b) = (Vec3::new(0.2, 0.9, 40.0), Vec3::new(0.6, 0.1, 0.0));
    let picture = input([&half(|_, _| xyz(a).extend(3.0)), &half(|_, _| xyz(b).extend(1.0))], PLAIN).unwrap();
    let mean = 0.25 * (3.0 * a + b);
    assert!(picture.pixels().iter().all(|rgb| (*rgb - mean).abs().max_element() < 1e-4));
    // A spectral green is outside of Rec.709: what is below zero there is cut off.
    let green = Vec3::new(0.2, 0.7, 0.05);
    let picture = input([&half(|_, _| green.extend(1.0)), &half(nothing)], PLAIN).unwrap();
    let rgb = Profile::srgb().from_xyz * green;
    assert!(rgb.x < -0.1 && picture.at(3, 3) == rgb.max(Vec3::ZERO), "{rgb}");
}

/// Pixels with samples stay as they are; the others get samples from around, from all sides and of the same surface.
#[test]
fn holes_are_filled_from_around() {
    let value = |x: usize| xyz(Vec3::splat(1.0 + x as f32)).extend(2.0);
    let seen = |x: usize, y: usize| (5 * x + 3 * y).is_multiple_of(7);
    let wrong = Vec4::new(f32::NAN, 1.0, 1.0, 1.0);
    let a = half(|x, y| if seen(x, y) { value(x) } else { Vec4::ZERO });
    // What is not finite counts as no sample.
    let b = half(|x, y| if (x + y).is_multiple_of(11) { wrong } else { Vec4::ZERO });
    let off = |picture: &Grid<Vec3>, i: usize| picture.pixels()[i].x - 1.0 - (i % WIDTH) as f32;
    let picture = input([&a, &b], PLAIN).unwrap();
    for i in 0..WIDTH * HEIGHT {
        let most = if seen(i % WIDTH, i / WIDTH) { 1e-3 } else { 8.0 };
        assert!(off(&picture, i).abs() < most, "{} in {i}", picture.pixels()[i]);
    }
    let sum: f32 = (0..WIDTH * HEIGHT).map(|i| off(&picture, i)).sum();
    assert!((sum / (WIDTH * HEIGHT) as f32).abs() < 0.3, "{sum}");
    // Where two surfaces meet none gets samples of the other, neither by albedo nor by normal.
    let left = |i: usize| i % WIDTH < WIDTH / 2;
    let of = |a: [f32; 3], b: [f32; 3]| -> Vec<[f32; 3]> {
        (0..WIDTH * HEIGHT).map(|i| if left(i) { a } else { b }).collect()
    };
    let albedo = of([0.5; 3], [0.5, 0.5, 0.2]);
    let normal = of([0.0, 0.0, 1.0], [0.0, 0.6, 0.8]);
    for features in [[&albedo[..], PLAIN[1]], [PLAIN[0], &normal[..]]] {
        let picture = input([&a, &b], features).unwrap();
        let mixed = |i: &usize| left(*i) != (picture.pixels()[*i].x < 0.5 + (WIDTH / 2) as f32);
        assert_eq!((0..WIDTH * HEIGHT).filter(mixed).count(), 0);
        assert!((0..WIDTH * HEIGHT).filter(|i| off(&picture, *i).abs() > 0.5).count() > WIDTH * HEIGHT / 2);
    }
    // One sample is all that is known; none is black.
    let one = |x, y| if (x, y) == (61, 7) { xyz(Vec3::new(3.0, 2.0, 1.0)).extend(1.0) } else { Vec4::ZERO };
    let picture = input([&half(nothing), &half(one)], PLAIN).unwrap();
    assert!(picture.pixels().iter().all(|rgb| (*rgb - Vec3::new(3.0, 2.0, 1.0)).abs().max_element() < 1e-5));
    let picture = input([&half(nothing), &half(nothing)], PLAIN).unwrap();
    assert!(picture.pixels().iter().all(|rgb| *rgb == Vec3::ZERO));
}

#[test]
fn versions_are_read_as_the_library_writes_them() {
    assert_eq!(OidnVersion(20_303).to_string(), "2.3.3");
    assert_eq!(OidnVersion(1_04_03).to_string(), "1.4.3");
    assert!(OidnVersion(1_03_00) < OidnVersion(1_04_00));
}

/// Two plains of different albedo under noise: noise goes, brightness and edge stay, and the same picture comes for any number of threads and
/// from a filter that was used before.
#[test]
fn with_the_library_noise_goes_and_edges_stay() {
    if let Err(error) = library() {
        // `tools/test` names the library where `tools/setup` could install it.
        assert!(std::env::var_os("OIDN_LIBRARY").is_none(), "{error}");
        return println!("skipped: {error}");
    }
    let level = |x: usize| if x < WIDTH / 2 { 0.2 } else { 0.8 };
    let noisy = |seed| {
        let mut random = Random(seed);
        let noise: Vec<f32> = (0..WIDTH * HEIGHT).map(|_| 2.0 * random.f32()).collect();
        half(|x, y| xyz(Vec3::splat(level(x) * noise[y * WIDTH + x])).extend(1.0))
    };
    let mut features = Grid::try_filled(WIDTH, HEIGHT, PixelFeatures::default()).unwrap();
    for (i, out) in features.pixels_mut().iter_mut().enumerate() {
        *out = PixelFeatures {
            albedo: Vec3::splat(level(i % WIDTH)),
            normal: Vec3::Z,
            distance: 1.0,
            emits: false,
        };
    }
    let filter =
        |threads, quality| OidnFilter::new([WIDTH, HEIGHT], [&features; 2], threads, quality).unwrap();
    for quality in [OidnQuality::High, OidnQuality::Balanced] {
        let (a, b) = (noisy(1), noisy(2));
        let mut one = filter(1, quality);
        let picture = one.filtered([&a, &b]).unwrap().picture;
        let off = |x: usize, y: usize| picture.at(x, y).y / level(x) - 1.0;
        let all = || (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y)));
        let mean = all().map(|(x, y)| off(x, y)).sum::<f32>() / (WIDTH * HEIGHT) as f32;
        let squares = all().map(|(x, y)| off(x, y).powi(2)).sum::<f32>() / (WIDTH * HEIGHT) as f32;
        // The mean of both halves has a variance of 1/6.
        assert!(mean.abs() < 0.05 && squares < 0.01, "{quality:?}: {mean} ± {}", squares.sqrt());
        let edge = |x: usize| (0..HEIGHT).map(|y| off(x, y)).sum::<f32>() / HEIGHT as f32;
        assert!(edge(WIDTH / 2 - 1).abs() < 0.2 && edge(WIDTH / 2).abs() < 0.1, "{quality:?}");
        // From the second picture on features are filtered in any case.
        one.filtered([&noisy(3), &b]).unwrap();
        let [picture, again] = [[&a, &b]; 2].map(|halves| one.filtered(halves).unwrap().picture);
        assert!(again.pixels() == picture.pixels(), "{quality:?}: used before");
        let mut two = filter(2, quality);
        let pictures = [[&noisy(3), &b], [&a, &b]].map(|halves| two.filtered(halves).unwrap().picture);
        assert!(pictures[1].pixels() == picture.pixels(), "{quality:?}: another number of threads");
    }
}
