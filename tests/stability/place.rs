//! Scenes far from the origin of their files.

use std::path::Path;

use glam::{DAffine3, DVec3, Vec3};

use pointillist::scene::desc::RenderingSpace;
use pointillist::scene::desc::{LightDesc, SceneDesc, ShapeKind, SpotDesc};
use pointillist::scene::load;
use pointillist::stream::UvWindow;
use pointillist::tracer::accel::{PrimRange, Ray};

use crate::Row;
use crate::support::agreement::{Method, Plan, repeat};
use crate::support::{scenes, welch};

const PLAN: Plan = Plan { side: 8, paths_per_pixel: 64, seeds: 16, window: UvWindow::PICTURE };

/// Few paths: two pictures that must be equal need no statistics.
const FEW: Plan = Plan { paths_per_pixel: 16, seeds: 2, ..PLAN };

const METHODS: [Method; 4] = [Method::Path, Method::Particle, Method::Bidirectional, Method::Photon];

/// A scene of `scenes/`.
fn scene(name: &str) -> SceneDesc {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    load(&file, &[]).unwrap().desc
}

/// The same scene in other units.
fn scaled(desc: &SceneDesc, by: f64) -> SceneDesc {
    let mut scaled = desc.clone();
    let camera = &mut scaled.camera;
    camera.to_world.translation *= by;
    (camera.near_clip, camera.far_clip) = (by * camera.near_clip, by * camera.far_clip);
    let lens = &mut camera.perspective_mut().unwrap().lens;
    (lens.radius, lens.focus_distance) = (by * lens.radius, by * lens.focus_distance);
    let unit = DAffine3::from_scale(DVec3::splat(by));
    scaled.shapes.iter_mut().for_each(|shape| shape.to_world = unit * shape.to_world);
    for light in &mut scaled.lights {
        if let LightDesc::Point { position, intensity, .. }
        | LightDesc::Spot(SpotDesc { position, intensity, .. }) = light
        {
            *position *= by;
            *intensity = intensity.scaled((by * by) as f32);
        }
    }
    scaled
}

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
    let desc = scene("cornell_spheres.xml");
    for method in METHODS {
        let here = repeat(&desc, method, PLAN);
        for far in [1e4, 1e6] {
            let mut there = moved(&desc, DVec3::new(far, -0.3 * far, 0.1 * far));
            let naive = repeat(&there, method, PLAN);
            there.place();
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

/// The share of pixels that are not equal, bit for bit.
fn unequal(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    let count = pairs.clone().count() as f64;
    pairs.filter(|(x, y)| x.to_bits() != y.to_bits()).count() as f64 / count
}

/// A scene that is scaled by a power of two is the same scene, bit for bit: nothing is rounded, and no constant knows its size.
#[test]
fn b7_n4_scenes_of_any_size() {
    let names =
        ["cornell_spheres.xml", "plugins/sensor_thinlens.xml", "plugins/emitter_spot.xml", "instances.xml"];
    for method in METHODS {
        for power in [-40, -7, 1, 12, 40] {
            let (mut figure, mut naive) = (0f64, 0f64);
            for desc in names.map(scene) {
                let here = repeat(&desc, method, FEW);
                assert!(here.iter().flatten().any(|y| *y > 0.0), "nothing to compare");
                let mut there = scaled(&desc, 2f64.powi(power));
                there.place();
                figure = figure.max(unequal(&here, &repeat(&there, method, FEW)));
                there.space = RenderingSpace::WORLD;
                naive = naive.max(unequal(&here, &repeat(&there, method, FEW)));
            }
            // Up to there single precision has room enough.
            let naive = if power.abs() < 40 { f64::NAN } else { naive };
            Row {
                case: &format!("B7 N4 four scenes, scaled by 2^{power}, {method:?}"),
                measure: "largest share of pixels that differ",
                figure,
                naive: ("units of the file", naive),
                bound: 0.0,
            }
            .check();
        }
    }
}

/// What stands between two points is found however near they are.
#[test]
fn b7_short_shadow_rays() {
    let mut desc = scenes::empty();
    let grey = scenes::material(&mut desc, scenes::grey(0.5));
    scenes::shape(&mut desc, ShapeKind::Rectangle, DAffine3::IDENTITY, grey, 0.0);
    let scene = scenes::prepare(&desc);
    let accel = scene.accel();
    let missed = |between: &dyn Fn(Vec3, Vec3) -> Ray| {
        let apart = |power: i32| {
            let [a, b] = [1.0, -1.0].map(|side| Vec3::new(0.0, 0.0, side * 2f32.powi(power)));
            !accel.occluded(&between(a, b), PrimRange::NONE)
        };
        (-90..-20).filter(|power| apart(*power)).count() as f64
    };
    Row {
        case: "B7 shadow rays of 2^-90 to 2^-20 through a plate",
        measure: "rays that miss it",
        figure: missed(&|a, b| Ray::between(a, b, 1.0)),
        naive: (
            "direction = target − origin",
            missed(&|a, b| Ray { origin: a, direction: b - a, t_max: 1.0 }),
        ),
        bound: 0.0,
    }
    .check();
}

/// Nor do other factors change more than roundings do.
#[test]
fn n4_scenes_in_other_units() {
    let desc = scene("cornell_spheres.xml");
    for method in METHODS {
        let here = repeat(&desc, method, PLAN);
        for by in [1e-6, 1e-3, 1e6] {
            let mut there = scaled(&desc, by);
            there.place();
            let there = repeat(&there, method, PLAN);
            let distance = distance(&here, &there);
            assert!(distance < 3.0, "{method:?} {by}: {distance} standard errors");
            let difference = difference(&here, &there);
            assert!(difference < 2e-3, "{method:?} {by}: the mean differs by {difference}");
        }
    }
}
