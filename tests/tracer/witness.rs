//! Witnesses: all light is what the picture has, the caustics told apart are what no other path shows there, and highlights are what paths meet.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::support::agreement::{Method, Plan, measure};
use crate::support::scenes::*;
use pointillist::image::compare::{Measured, z_test};
use pointillist::scene::desc::*;
use pointillist::spectrum::dispersion::Ior;
use pointillist::stream::{UvWindow, WitnessedArea};
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::witness::{Witness, pair};
use pointillist::tracer::{Camera, Scene};

/// Pixels along a side of the picture, and of an area.
const SIDE: u32 = 32;
const AREA: u32 = 8;

/// Areas of the picture.
const COUNT: usize = (SIDE / AREA * (SIDE / AREA)) as usize;

/// Paths of one witness.
const PATHS: u64 = 8192;

fn scene(name: &str) -> SceneDesc {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let mut desc = pointillist::scene::load(&path, &[]).expect("the scene can be read").desc;
    (desc.film.width, desc.film.height) = (SIDE, SIDE);
    desc
}

/// What witnesses of these seeds find in each area.
fn find(desc: &SceneDesc, all: bool, seeds: std::ops::Range<u32>) -> Vec<Vec<WitnessedArea>> {
    let (scene, camera) = (Arc::new(Scene::prepare(desc).unwrap()), Camera::of(desc).unwrap());
    let witness = |seed| {
        let context =
            RenderContext::new(scene.clone(), camera.clone(), &desc.integrator, seed, UvWindow::PICTURE);
        let mut witness = Witness::new(&context, [SIDE; 2], AREA, all);
        // In two parts, as a render asks for them.
        witness.trace(PATHS / 4);
        witness.trace(PATHS);
        witness.areas()
    };
    seeds.map(witness).collect()
}

/// Mean and variance of that mean over witnesses, area by area.
fn measured(found: &[Vec<WitnessedArea>], figure: impl Fn(&WitnessedArea) -> f64) -> Measured {
    let n = found.len() as f64;
    let of = |i: usize| found.iter().map(|areas| figure(&areas[i])).collect::<Vec<f64>>();
    let mean: Vec<f64> = (0..COUNT).map(|i| of(i).iter().sum::<f64>() / n).collect();
    let variance = |i: usize| of(i).iter().map(|x| (x - mean[i]).powi(2)).sum::<f64>() / (n - 1.0) / n;
    let side = (SIDE / AREA) as usize;
    Measured { width: side, height: side, variance: (0..COUNT).map(variance).collect(), mean }
}

/// The picture of a method in areas: each of its pixels is one.
fn picture(desc: &SceneDesc, method: Method) -> Measured {
    let mut desc = desc.clone();
    (desc.film.width, desc.film.height) = (SIDE / AREA, SIDE / AREA);
    let plan =
        Plan { side: (SIDE / AREA) as usize, paths_per_pixel: 4096, seeds: 16, window: UvWindow::PICTURE };
    measure(&desc, method, plan)
}

#[test]
fn all_light_is_that_of_the_picture() {
    for (name, all) in [("cornell.xml", false), ("cornell_spheres.xml", true), ("cove.xml", true)] {
        let desc = scene(name);
        let found = measured(&find(&desc, all, 0..24), |area| area.mean()[0]);
        let test = z_test(&found, &picture(&desc, Method::Vcm), 0.01).expect("equal sizes");
        println!("{name}: {test:?}");
        assert!((test.mean_ratio - 1.0).abs() < 4.0 * test.mean_ratio_error + 0.01, "{name}: {test:?}");
        assert!(test.accepted >= 0.9, "{name}: {test:?}");
    }
}

/// A floor under glass and a lamp that nothing can hit: all of the light is caustics.
#[test]
fn light_through_glass_is_told_apart() {
    let found = find(&lamp_over_floor(true), true, 0..12);
    let light = measured(&found, |area| area.mean()[0]);
    let caustics = measured(&found, WitnessedArea::mean_caustics);
    let sum = |m: &Measured| m.mean.iter().sum::<f64>();
    assert!(sum(&light) > 0.0);
    let ratio = sum(&caustics) / sum(&light);
    assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
}

/// Where nothing is mirrored there are no caustics; those behind mirrors and glass alone are fewer than all.
#[test]
fn caustics_are_what_mirrors_and_glass_bring() {
    let total = |name: &str, all: bool| -> f64 {
        find(&scene(name), all, 0..4).iter().flatten().map(WitnessedArea::mean_caustics).sum()
    };
    assert_eq!(total("cornell.xml", true), 0.0);
    let (behind, all) = (total("cornell_spheres.xml", false), total("cornell_spheres.xml", true));
    assert!(behind > 0.0 && all > 1.5 * behind, "{behind} {all}");
}

/// A ball of glass in the dark and a small lamp beside the camera: all that the camera sees are highlights, by reflection on the front and on the
/// back of the ball.
fn ball_in_the_dark(lamp: ShapeKind) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -5.0, 0.5), DVec3::new(0.0, 5.0, -0.5), 30.0);
    (desc.film.width, desc.film.height) = (SIDE, SIDE);
    let clear = material(&mut desc, glass(Ior::Constant(1.5)));
    let black = material(&mut desc, grey(0.0));
    shape(&mut desc, sphere(DVec3::ZERO, 1.0), DAffine3::IDENTITY, clear, 0.0);
    let place =
        DAffine3::from_translation(DVec3::new(2.0, -3.5, 1.5)) * DAffine3::from_scale(DVec3::splat(0.1));
    shape(&mut desc, lamp, place, black, 100.0);
    desc
}

/// Light and pixels of all highlights of a scene, mean over seeds, and the variance of the former.
fn highlights(desc: &SceneDesc) -> ([f64; 2], f64) {
    const SEEDS: u32 = 16;
    let (scene, camera) = (Arc::new(Scene::prepare(desc).unwrap()), Camera::of(desc).unwrap());
    let sums: Vec<[f64; 2]> = (0..SEEDS)
        .map(|seed| {
            let context =
                RenderContext::new(scene.clone(), camera.clone(), &desc.integrator, seed, UvWindow::PICTURE);
            let mut witnesses =
                pair(context, AREA, IntegratorKind::Vcm).expect("paths alone find highlights");
            let found = witnesses(PATHS, [SIDE; 2]).highlights;
            found.iter().fold([0.0; 2], |sum, found| [sum[0] + found.light, sum[1] + found.pixels])
        })
        .collect();
    let n = f64::from(SEEDS);
    let mean = [0, 1].map(|i| sums.iter().map(|sum| sum[i]).sum::<f64>() / n);
    let variance = sums.iter().map(|sum| (sum[0] - mean[0]).powi(2)).sum::<f64>() / (n * (n - 1.0));
    (mean, variance)
}

#[test]
fn highlights_are_the_lamps_that_paths_meet() {
    let desc = ball_in_the_dark(sphere(DVec3::ZERO, 1.0));
    let ([light, _], variance) = highlights(&desc);
    let shown = picture(&desc, Method::Path);
    let scale = f64::from(AREA * AREA);
    let truth = shown.mean.iter().sum::<f64>() * scale;
    let deviation = (variance + shown.variance.iter().sum::<f64>() * scale * scale).sqrt();
    println!("{light} of {truth} ± {deviation}");
    assert!(
        truth > 0.0 && (light - truth).abs() < 4.0 * deviation + 0.1 * truth,
        "{light} of {truth} ± {deviation}"
    );
}

/// What a lamp covers of the picture follows from its light, whether it is one light or twelve triangles, and with another lamp beside it.
#[test]
fn highlights_cover_what_their_lamps_do() {
    let one = ball_in_the_dark(sphere(DVec3::ZERO, 1.0));
    let many = ball_in_the_dark(ShapeKind::Cube);
    let mut two = one.clone();
    let black = two.shapes[1].bsdf;
    let place =
        DAffine3::from_translation(DVec3::new(-2.0, -3.5, 1.5)) * DAffine3::from_scale(DVec3::splat(0.1));
    shape(&mut two, sphere(DVec3::ZERO, 1.0), place, black, 100.0);
    let luminance = |desc: &SceneDesc| {
        let ([light, pixels], _) = highlights(desc);
        light / pixels
    };
    let [one, many, two] = [&one, &many, &two].map(luminance);
    println!("{one} {many} {two}");
    assert!((many / one).ln().abs() < 0.3 && (two / one).ln().abs() < 0.3, "{one} {many} {two}");
}

/// Where nothing is mirrored no lamp is.
#[test]
fn without_mirrors_there_are_no_highlights() {
    let desc = scene("cornell.xml");
    let (scene, camera) = (Arc::new(Scene::prepare(&desc).unwrap()), Camera::of(&desc).unwrap());
    let context = RenderContext::new(scene, camera, &desc.integrator, 1, UvWindow::PICTURE);
    let mut witnesses = pair(context, AREA, IntegratorKind::Vcm).expect("paths alone find highlights");
    let found = witnesses(PATHS, [SIDE; 2]);
    assert!(found.highlights.is_empty() && found.areas.iter().all(Vec::is_empty));
}
