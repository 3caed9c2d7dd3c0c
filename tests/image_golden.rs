//! The way of golden pictures, from samples through the film and a file to the z-test: noisy films of the
//! same field agree with the variance they state, films of slightly different fields do not.

use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{FilmSpec, SplatFilter, VarianceForm, develop};
use pointillist::color::{Profile, Xyz};
use pointillist::image::compare::Measured;
use pointillist::image::exr;
use pointillist::stream::{PathCounts, Sample};

use glam::Mat3;

#[path = "support/golden.rs"]
mod golden;

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
    Profile { name: "rec709", from_xyz: to_xyz.inverse(), ..Profile::srgb() }
}

/// A film of noisy samples around `u + gain`, and as many light samples of mean 1 over all paths.
fn noisy(spec: FilmSpec, mut seed: u64, gain: f32) -> ReferenceFilm {
    let mut next = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f32 / 16_777_216.0
    };
    let window = spec.window();
    let size = [0, 1].map(|i| window.max[i] - window.min[i]);
    let mut film = ReferenceFilm::new(spec, 2).expect("film");
    let n = 400_000;
    let mut samples = Vec::new();
    for _ in 0..n {
        let uv = [window.min[0] + size[0] * next(), window.min[1] + size[1] * next()];
        let y = (uv[0] + gain) * 2.0 * next();
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
fn films_of_one_field_agree_through_files() {
    let folder = std::env::temp_dir().join(format!("pointillist-golden-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("folder");
    for filter in [SplatFilter::Box, SplatFilter::Tent, SplatFilter::Gaussian] {
        let spec = FilmSpec { width: 40, height: 30, filter, variance: VarianceForm::Product };
        let reference = noisy(spec, 1, 1.0).develop().expect("develop");
        let path = folder.join("reference.exr");
        exr::write(&path, &develop::layers(&reference, &rec709(), filter.energy(), &[])).expect("write");
        let reference = Measured::read(&path).expect("read");

        let measure = |seed, gain| {
            let data = noisy(spec, seed, gain).develop().expect("develop");
            golden::measured(&data, &develop::linear_rgb(&data, &rec709()), filter.energy())
        };
        let result = golden::assert_same(&measure(2, 1.0), &reference, "the same field");
        // 1200 pixels, their sprites overlapping: within 5 σ = 5·√(2/1200)·2 of 1 for Box, near 1 for all.
        assert!((result.mean_z2 - 1.0).abs() < 0.3, "{filter:?}: {result:?}");
        let brighter = measure(3, 1.1);
        let caught = std::panic::catch_unwind(|| golden::assert_same(&brighter, &reference, "brighter"));
        assert!(caught.is_err(), "{filter:?}: 3 % brighter is not noticed");
    }
    std::fs::remove_dir_all(&folder).expect("remove");
    assert!(golden::path("a.exr").ends_with("tests/golden/a.exr"));
}
