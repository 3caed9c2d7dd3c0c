//! Scenes far from the origin of their files.

use std::path::Path;

use glam::DVec3;

use pointillist::scene::desc::{LightDesc, SceneDesc};
use pointillist::scene::load;
use pointillist::stream::UvWindow;

use crate::Row;
use crate::support::agreement::{Method, Plan, repeat};
use crate::support::welch;

const PLAN: Plan = Plan { side: 8, paths_per_pixel: 64, seeds: 16, window: UvWindow::PICTURE };

fn moved(desc: &SceneDesc, by: DVec3) -> SceneDesc {
    let mut moved = desc.clone();
    moved.camera.to_world.translation += by;
    moved.shapes.iter_mut().for_each(|shape| shape.to_world.translation += by);
    for light in &mut moved.lights {
        if let LightDesc::Point { position, .. } = light {
            *position += by;
        }
    }
    moved
}

/// The largest difference between the blocks of two pictures, in standard errors.
fn distance(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let block = |i: usize| {
        let [(p, v), (q, w)] = [a, b].map(|pictures| welch::moments(pictures.iter().map(move |p| p[i])));
        if p == q { 0.0 } else { (p - q).abs() / (v + w).sqrt() }
    };
    (0..a[0].len()).map(block).fold(0.0, f64::max)
}

/// The difference of the means of two pictures with the same seeds, relative to the first.
fn difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let sum = |pictures: &[Vec<f64>]| pictures.iter().flatten().sum::<f64>();
    (sum(b) / sum(a) - 1.0).abs()
}

/// A scene that is moved by up to a million times its size is the same scene.
#[test]
fn b1_n4_scenes_far_away() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell_spheres.xml");
    let desc = load(&file, &[]).unwrap().desc;
    for method in [Method::Path, Method::Particle, Method::Bidirectional, Method::Photon] {
        let here = repeat(&desc, method, PLAN);
        for far in [1e4, 1e6] {
            let mut there = moved(&desc, DVec3::new(far, -0.3 * far, 0.1 * far));
            let naive = repeat(&there, method, PLAN);
            there.place_origin();
            let there = repeat(&there, method, PLAN);
            Row {
                case: &format!("B1 N4 Cornell box with spheres, moved by {far:e} times its size, {method:?}"),
                measure: "difference of the mean",
                figure: difference(&here, &there),
                naive: ("coordinates of the file", difference(&here, &naive)),
                bound: 1e-4,
            }
            .check();
            let distance = distance(&here, &there);
            assert!(distance < 3.0, "{method:?} {far}: {distance} standard errors");
        }
    }
}
