//! A region that is traced alone shows what the whole picture shows there.

use std::path::Path;

use glam::DVec2;

use crate::support::agreement::{Method, Plan, measured, repeat, repeat_through};
use crate::support::welch;
use pointillist::stream::UvWindow;
use pointillist::tracer::Camera;

/// Side of the whole picture, and corner and side of the region.
const WHOLE: usize = 16;
const CORNER: usize = 4;
const PART: usize = 8;

/// Pixel by pixel by Student's test, at a level of 1 % for all of them together, for camera paths, light paths and both. Samples around the
/// region are traced too, as they are for the filters of a film.
#[test]
fn means_of_a_region_are_those_of_the_whole_picture() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.xml");
    let mut desc = pointillist::scene::load(&path, &[]).unwrap().desc;
    (desc.film.width, desc.film.height) = (WHOLE as u32, WHOLE as u32);
    let camera = Camera::of(&desc).unwrap();
    let part = |n: usize| DVec2::splat(n as f64 / WHOLE as f64);
    let region = camera.clone().cropped(part(CORNER), part(PART));
    let window = UvWindow { min: [-0.25; 2], max: [1.25; 2] };
    for method in [Method::Path, Method::Particle, Method::Bidirectional] {
        let whole = Plan { side: WHOLE, paths_per_pixel: 256, seeds: 32, window: UvWindow::PICTURE };
        let pictures = repeat(&desc, method, whole);
        let crop = |picture: Vec<f64>| -> Vec<f64> {
            let rows = CORNER..CORNER + PART;
            rows.clone().flat_map(|y| picture[y * WHOLE..][rows.clone()].to_vec()).collect()
        };
        let expected = measured(&pictures.into_iter().map(crop).collect::<Vec<_>>());
        let plan = Plan { side: PART, window, ..whole };
        let found = measured(&repeat_through(&region, &desc, method, plan));
        let mut largest: f64 = 1.0;
        for i in 0..PART * PART {
            let [a, b] = [&expected, &found].map(|of| (of.mean[i], of.variance[i]));
            let (t, freedom) = welch::t(a, b, 0.0, f64::from(whole.seeds));
            largest = largest.min(welch::p_value(t, freedom));
        }
        let sum = |of: &[f64]| of.iter().sum::<f64>();
        let (a, b) = (sum(&expected.mean), sum(&found.mean));
        let deviation = (sum(&expected.variance) + sum(&found.variance)).sqrt();
        println!("{method:?}: smallest p {largest:.4}, ratio {:.5} ± {:.5}", b / a, deviation / a);
        assert!(largest >= 0.01 / (PART * PART) as f64, "{method:?}: p = {largest}");
        assert!((a - b).abs() < 4.0 * deviation, "{method:?}: {a} and {b} ± {deviation}");
    }
}
