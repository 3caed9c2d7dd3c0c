//! Fireflies: reweighted (`client/cascades.rs`) beside the plain mean and beside clamping.

use pointillist::client::cascades::{CascadeFilm, MakeFilm};
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{Film, FilmSpec, SplatFilter};
use pointillist::color::Xyz;
use pointillist::math::bits::mix;
use pointillist::stream::{PathCounts, Sample};

use crate::Row;

const SIDE: usize = 16;

/// Share of the light of rare samples: of those of 1000, one in 512.
const RARITY: u64 = 512;

/// A picture of samples of 0.5 to 1.5, and in one of `rarity` 1000.
struct Picture {
    /// Mean over the pixels: reweighted, as it is, and with samples clamped to 8 times the mean.
    means: [f64; 3],
    /// Root of the mean square error of a pixel over the expected mean: reweighted, and as it is.
    errors: [f64; 2],
    /// What the film says that it lacks.
    withheld: f64,
}

fn picture(per_pixel: u64, rarity: u64, light: bool) -> Picture {
    let (width, height, filter) = (SIDE as u32, SIDE as u32, SplatFilter::Box);
    let spec = FilmSpec { width, height, filter, variance: None, sums: Default::default() };
    let make: MakeFilm = Box::new(|spec| Ok(Box::new(ReferenceFilm::new(spec, 1)?)));
    let mut films: [Box<dyn Film>; 2] = [
        Box::new(CascadeFilm::new(make, spec, 1.0).unwrap()),
        Box::new(ReferenceFilm::new(spec, 1).unwrap()),
    ];
    let count = per_pixel * (SIDE * SIDE) as u64;
    let expected = 1.0 + if rarity < u64::MAX { 999.0 / rarity as f64 } else { 0.0 };
    let mut clamped = 0.0;
    let sample = |i: u64| {
        let uniform = |k: u64| (mix(4 * i + k) >> 40) as f32 / (1 << 24) as f32;
        let y = if mix(i ^ 1 << 50).is_multiple_of(rarity) { 1000.0 } else { 0.5 + uniform(2) };
        Sample { uv: [uniform(0), uniform(1)], xyz: Xyz::new(y, y, y), w: if light { -1.0 } else { 1.0 } }
    };
    for first in (0..count).step_by(1024) {
        let samples: Vec<Sample> = (first..(first + 1024).min(count)).map(sample).collect();
        clamped += samples.iter().map(|s| f64::from(s.xyz.y).min(8.0 * expected)).sum::<f64>();
        films.iter_mut().for_each(|film| film.add(&samples).unwrap());
    }
    let [camera, lit] = if light { [0, count] } else { [count, 0] };
    films.iter_mut().for_each(|film| film.count_paths(PathCounts { camera, light: lit }));
    let sums = films.each_mut().map(|film| {
        let data = film.develop().unwrap();
        let sums = if light { data.light } else { data.camera };
        sums.iter().map(|sum| f64::from(sum[1]) / per_pixel as f64).collect::<Vec<f64>>()
    });
    let mean = |y: &[f64]| y.iter().sum::<f64>() / y.len() as f64;
    let [reweighted, plain] = sums.each_ref().map(|y| mean(y));
    let error = |y: &Vec<f64>| {
        mean(&y.iter().map(|y| (y - expected).powi(2)).collect::<Vec<f64>>()).sqrt() / expected
    };
    Picture {
        means: [reweighted, plain, clamped / count as f64],
        errors: sums.each_ref().map(error),
        withheld: films[0].withheld().unwrap(),
    }
}

/// Even light is not touched, on either stream.
#[test]
fn even_light_stays_as_it_is() {
    for light in [false, true] {
        let Picture { means: [reweighted, plain, _], withheld, .. } = picture(8, u64::MAX, light);
        assert!((reweighted / plain - 1.0).abs() < 1e-3 && withheld < 1e-3, "{reweighted} {plain}");
    }
}

/// Eight samples per pixel, and one firefly in 64 pixels: the pixels are nearer to their expectation without its light than with it.
#[test]
fn fireflies_of_few_samples() {
    for light in [false, true] {
        let Picture { errors: [reweighted, plain], .. } = picture(8, RARITY, light);
        Row {
            case: &format!(
                "fireflies of 1000, one in 64 pixels, {} stream",
                if light { "light" } else { "camera" }
            ),
            measure: "error of a pixel over its expectation",
            figure: reweighted,
            naive: ("the plain mean", plain),
            // Two thirds of the light are missing.
            bound: 0.7,
        }
        .check();
    }
}

/// The same light when every pixel has met eight of those samples: nothing is missing, where a clamp goes on to miss two thirds.
#[test]
fn fireflies_are_found_in_the_limit() {
    for light in [false, true] {
        let few = picture(64, RARITY, light);
        assert!(few.withheld > 0.5 && few.withheld < 0.8, "{}", few.withheld);
        let Picture { means: [reweighted, plain, clamped], withheld, .. } = picture(4096, RARITY, light);
        assert!((withheld - (1.0 - reweighted / plain)).abs() < 1e-4, "{withheld}");
        Row {
            case: &format!(
                "samples of 1000, 8 in each pixel, {} stream",
                if light { "light" } else { "camera" }
            ),
            measure: "light that is missing",
            figure: 1.0 - reweighted / plain,
            naive: ("clamped to 8 times the mean", 1.0 - clamped / plain),
            bound: 0.02,
        }
        .check();
    }
}
