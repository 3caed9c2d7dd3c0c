//! The variance that a developed film states for its means: by it, noisy films of the same field agree, and films of slightly
//! different fields do not.

use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{Film, FilmSpec, SplatFilter, VarianceForm, develop};
use pointillist::color::{Profile, Xyz};
use pointillist::image::compare::{Picture, z_test};
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
    let mut random = Random(seed);
    let mut next = || random.f32();
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
