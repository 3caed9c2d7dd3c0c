//! The variance that a developed film states for its means: by it, noisy films of the same field agree, and films of slightly
//! different fields do not.

use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{Film, FilmData, FilmSpec, SplatFilter, VarianceForm, develop};
use pointillist::color::{Profile, Xyz};
use pointillist::gpu::Region;
use pointillist::image::compare::{Measured, Picture, z_test};
use pointillist::image::exr;
use pointillist::math::random::Random;
use pointillist::stream::{PathCounts, Sample};

use glam::Mat3;

/// Rec.709 as a matrix of this test's own: luminance of RGB must be Y again.
fn rec709() -> Profile {
    let to_xyz = Mat3::from_cols_array(&[
        0.412_390_8,
        0.212_639,
        0.019_330_8,
        0.357_584_3,
        0.715_168_7,
        0.119_194_8,
        0.180_480_8,
        0.072_192_3,
        0.950_532_2,
    ]);
    Profile { name: "rec709".to_owned(), from_xyz: to_xyz.inverse(), ..Profile::srgb() }
}

/// A film of noisy samples around `u + gain`, and as many light samples of mean 1 over all paths.
fn noisy(spec: FilmSpec, seed: u64, gain: f32) -> ReferenceFilm {
    noisy_around(spec, seed, 400_000, |u| u + gain)
}

/// The same of `n` paths around another function of u.
fn noisy_around(spec: FilmSpec, seed: u64, n: u64, field: impl Fn(f32) -> f32) -> ReferenceFilm {
    let mut random = Random(seed);
    let mut next = || random.f32();
    let window = spec.window();
    let size = [0, 1].map(|i| window.max[i] - window.min[i]);
    let mut film = ReferenceFilm::new(spec, 2).expect("film");
    let mut samples = Vec::new();
    for _ in 0..n {
        let uv = [window.min[0] + size[0] * next(), window.min[1] + size[1] * next()];
        let y = field(uv[0]) * 2.0 * next();
        samples.push(Sample { uv, xyz: Xyz::new(y, y, y), w: 1.0 });
        let uv = [window.min[0] + size[0] * next(), window.min[1] + size[1] * next()];
        let y = 2.0 * next() * size[0] * size[1];
        samples.push(Sample { uv, xyz: Xyz::new(y, y, y), w: -1.0 });
    }
    film.add(&samples).expect("add");
    film.count_paths(PathCounts { camera: n, light: n });
    film
}

#[test]
fn stated_variance_is_that_of_the_means() {
    let folder = std::env::temp_dir().join(format!("pointillist-develop-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("folder");
    for filter in [SplatFilter::Box, SplatFilter::Tent, SplatFilter::Gaussian] {
        let spec = FilmSpec {
            width: 40,
            height: 30,
            filter,
            variance: Some(VarianceForm::Product),
            sums: Default::default(),
        };
        let measure = |seed, gain| {
            let data = noisy(spec, seed, gain).develop().expect("develop");
            let path = folder.join(format!("{seed}.exr"));
            exr::write(&path, &develop::layers(&data, &rec709(), filter.energy(), &[])).expect("write");
            Picture::read(&path, None).expect("read").measured().expect("a variance").clone()
        };
        let reference = measure(1, 1.0);
        let same = z_test(&measure(2, 1.0), &reference, 0.01).expect("one size");
        // 1200 pixels, their sprites overlapping: within 5 σ = 5·√(2/1200)·2 of 1 for Box, near 1 for all.
        assert!(same.skipped == 0 && same.accepted >= 0.9975, "{filter:?}: {same:?}");
        assert!((same.mean_z2 - 1.0).abs() < 0.3, "{filter:?}: {same:?}");
        assert!((same.mean_ratio - 1.0).abs() < 5.0 * same.mean_ratio_error, "{filter:?}: {same:?}");
        let brighter = z_test(&measure(3, 1.1), &reference, 0.01).expect("one size");
        let off = brighter.mean_ratio - 1.0;
        assert!(
            off > 10.0 * brighter.mean_ratio_error,
            "{filter:?}: 3 % brighter is not noticed, {brighter:?}"
        );
    }
    std::fs::remove_dir_all(&folder).expect("remove");
}

/// A region with samples of its own, mixed into a picture of the same field: the mean is that of the field, the stated variance is that of the
/// mean and smaller by the share of the region's samples, and around the region nothing has changed.
#[test]
fn a_region_is_mixed_into_the_picture_with_its_variance() {
    let spec = |width, height| FilmSpec {
        width,
        height,
        filter: SplatFilter::Gaussian,
        variance: Some(VarianceForm::Product),
        sums: Default::default(),
    };
    let (origin, size) = ([12, 8], [16, 12]);
    let whole = noisy(spec(40, 30), 4, 1.0).develop().expect("develop");
    let field = |u: f32| (origin[0] as f32 + u * size[0] as f32) / 40.0 + 1.0;
    // The window of a small film reaches farther beyond it: about three times as many samples per pixel.
    let region = noisy_around(spec(size[0], size[1]), 5, 320_000, field).develop().expect("develop");
    let per_pixel = |data: &FilmData| {
        data.camera.iter().map(|sum| f64::from(sum[3])).sum::<f64>() / f64::from(data.width * data.height)
    };
    let (n, m) = (per_pixel(&whole), per_pixel(&region));
    let mut mixed = whole.clone();
    // In two parts, as where regions overlap.
    for x in [0, 8] {
        let part = Region { origin: [origin[0] + x, origin[1]], extent: [8, size[1]] };
        develop::mix_region(&mut mixed, &region, origin, part, (m / (n + m)) as f32);
    }
    let reference = noisy(spec(40, 30), 6, 1.0).develop().expect("develop");
    let measured = |data: &FilmData| Measured {
        width: 40,
        height: 30,
        mean: develop::linear_xyz(data).iter().map(|xyz| f64::from(xyz[1])).collect(),
        variance: develop::mean_variance(data, spec(1, 1).filter.energy())
            .iter()
            .map(|v| f64::from(*v))
            .collect(),
    };
    let inside = |i: usize| {
        let [x, y] = [i as u32 % 40, i as u32 / 40];
        (origin[0]..origin[0] + size[0]).contains(&x) && (origin[1]..origin[1] + size[1]).contains(&y)
    };
    let crop = |of: &Measured| {
        let part =
            |values: &[f64]| -> Vec<f64> { (0..1200).filter(|i| inside(*i)).map(|i| values[i]).collect() };
        Measured { width: 16, height: 12, mean: part(&of.mean), variance: part(&of.variance) }
    };
    let (before, after, reference) = (measured(&whole), measured(&mixed), measured(&reference));
    let test = z_test(&crop(&after), &crop(&reference), 0.01).expect("one size");
    assert!(test.accepted >= 0.99 && (test.mean_z2 - 1.0).abs() < 0.4, "{test:?}");
    assert!((test.mean_ratio - 1.0).abs() < 5.0 * test.mean_ratio_error, "{test:?}");
    let sum = |of: &Measured| crop(of).variance.iter().sum::<f64>();
    let smaller = sum(&after) / sum(&before);
    assert!((smaller / (n / (n + m)) - 1.0).abs() < 0.1, "{smaller} of {n} and {m} samples per pixel");
    for i in (0..1200).filter(|i| !inside(*i)) {
        assert_eq!((mixed.camera[i], mixed.light[i]), (whole.camera[i], whole.light[i]));
        assert_eq!(mixed.camera_variance[i], whole.camera_variance[i]);
    }
}
