//! One huge object in a scene changes nothing where it is not.

use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use pointillist::image::compare::Measured;
use pointillist::scene::desc::{SceneDesc, ShapeKind};
use pointillist::scene::load;
use pointillist::spectrum::Spectrum;
use pointillist::stream::UvWindow;
use pointillist::tracer::accel::PrimRange;
use pointillist::tracer::bounding_sphere::BoundingSphere;
use pointillist::tracer::integrator::{PhotonTracer, RenderContext};
use pointillist::tracer::light::{Light, LightSampleContext, LightShape, Lights, PointLight};
use pointillist::tracer::{Camera, Scene};

use crate::Row;
use crate::support::agreement::{Method, Plan, measure, repeat};
use crate::support::scenes::{Random, grey, material, shape};

/// Twelve lamps in a room of size 5.
fn lamps(radius: f32) -> (Lights, Vec<Vec3>) {
    let mut r = Random(4);
    let places: Vec<Vec3> = (0..12).map(|_| 5.0 * r.point()).collect();
    let light = |(&position, i): (&Vec3, u32)| Light {
        shape: LightShape::Point(PointLight { position }),
        spectrum: i,
        prims: PrimRange::NONE,
    };
    let all = places.iter().zip(0..).map(light).collect();
    let scene = BoundingSphere { center: Vec3::splat(2.5), radius };
    (Lights::new(all, vec![Spectrum::Constant(1.0); 12], scene), places)
}

/// Relative variance of one sample of the light at points near lamps, where a lamp is chosen with the probability `choice`.
fn variance(places: &[Vec3], choice: impl Fn(usize, LightSampleContext) -> f64) -> f64 {
    let mut r = Random(5);
    let points = 200;
    let at_a_point = |_| {
        let n = r.direction().as_vec3();
        let near = places[(r.f64() * 12.0) as usize];
        let at =
            LightSampleContext { p: near - n * (0.01 + 0.3 * r.f32()), n, through: false, glossy: false };
        let lit = |place: &Vec3| {
            let to = *place - at.p;
            f64::from(to.normalize().dot(n).max(0.0) / to.length_squared())
        };
        let sum: f64 = places.iter().map(lit).sum();
        let squares: f64 =
            places.iter().enumerate().map(|(i, place)| lit(place).powi(2) / choice(i, at).max(1e-9)).sum();
        squares / (sum * sum) - 1.0
    };
    (0..points).map(at_a_point).sum::<f64>() / f64::from(points)
}

/// A lamp that is near brings most of the light. Distances below a millionth of the scene used not to be told apart: 1.4
/// beside a backdrop of a million.
#[test]
fn b4_choice_of_lamps() {
    let floor2 = |radius: f32| f64::from(1e-12 * radius * radius);
    let naive = |places: &[Vec3], radius: f32| {
        let places = places.to_vec();
        variance(&places.clone(), move |i, at| {
            let weight = |place: &Vec3| {
                let to = *place - at.p;
                f64::from(to.normalize().dot(at.n).max(0.0))
                    / f64::from(to.length_squared()).max(floor2(radius))
            };
            let sum: f64 = places.iter().map(weight).sum();
            // A tenth is shared by all, as in the choice that is tested.
            0.9 * weight(&places[i]) / sum + 0.1 / 12.0
        })
    };
    let (near, places) = lamps(5.0);
    let (huge, _) = lamps(1.4e6);
    let of = |lights: &Lights| variance(&places, |i, at| f64::from(lights.probability(i as u32, at)));
    Row {
        case: "B4 12 lamps beside a backdrop × 1e6",
        measure: "variance of the choice over that without",
        figure: of(&huge) / of(&near),
        naive: ("distances from a millionth of the scene", naive(&places, 1.4e6) / naive(&places, 5.0)),
        bound: 1.01,
    }
    .check();
}

fn cornell() -> SceneDesc {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell.xml");
    load(&file, &[]).unwrap().desc
}

/// With a wall behind the box, a million times as large.
fn with_backdrop(mut desc: SceneDesc) -> SceneDesc {
    let white = material(&mut desc, grey(0.5));
    let place = DAffine3::from_translation(DVec3::new(0.0, 0.0, 10.0))
        * DAffine3::from_rotation_x(std::f64::consts::PI);
    shape(&mut desc, ShapeKind::Rectangle, place * DAffine3::from_scale(DVec3::splat(1e6)), white, 0.0);
    desc
}

fn tracer(desc: &SceneDesc) -> PhotonTracer {
    let scene = Arc::new(Scene::prepare(desc).unwrap());
    let context =
        RenderContext::new(scene, Camera::of(desc).unwrap(), &desc.integrator, 1, UvWindow::PICTURE);
    PhotonTracer::new(context, true)
}

/// relMSE of single pictures against a reference.
fn rel_mse(pictures: &[Vec<f64>], reference: &Measured) -> f64 {
    let pixel = |(x, r): (&f64, &f64)| (x - r).powi(2) / (r * r + 0.01);
    let of = |picture: &Vec<f64>| picture.iter().zip(&reference.mean).map(pixel).sum::<f64>();
    pictures.iter().map(of).sum::<f64>() / (pictures.len() * reference.mean.len()) as f64
}

/// The same noise and blur with the backdrop and without, by each method. The first radius of photons was that of the scene's
/// box.
#[test]
fn b4_cornell_box_before_a_backdrop() {
    let (plain, huge) = (cornell(), with_backdrop(cornell()));
    let plan = Plan { side: 16, paths_per_pixel: 64, seeds: 8, window: UvWindow::PICTURE };
    let reference = measure(&plain, Method::Path, Plan { paths_per_pixel: 512, ..plan });
    for method in [Method::Path, Method::Bidirectional, Method::Photon] {
        let [a, b] = [&plain, &huge].map(|desc| rel_mse(&repeat(desc, method, plan), &reference));
        let mut wide = huge.clone();
        wide.integrator.photons.initial_radius = Some(radius_of_the_box(&huge));
        // The other methods had no such constant.
        let naive = match method {
            Method::Photon => {
                ("photon radius of the scene's box", rel_mse(&repeat(&wide, method, plan), &reference) / a)
            }
            _ => ("none", f64::NAN),
        };
        Row {
            case: &format!("B4 Cornell box before a backdrop × 1e6, {method:?}"),
            measure: "relMSE over that without",
            figure: b / a,
            naive,
            bound: 1.3,
        }
        .check();
    }
    // What is no backdrop keeps the box of the scene, and its radius.
    for scene in
        ["cornell", "cornell_spheres", "cove", "caustic", "veach_door", "prism", "rough", "veach_plates"]
    {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{scene}.xml"));
        let desc = load(&file, &[]).unwrap().desc;
        let [radius, of_box] = [tracer(&desc).schedule.radius, radius_of_the_box(&desc)];
        assert!((radius / of_box - 1.0).abs() < 1e-3, "{scene}: {radius}, of the box {of_box}");
    }
}

/// The first radius of the photons if they lay on the sides of the scene's box: 12 neighbours of 8192.
fn radius_of_the_box(desc: &SceneDesc) -> f32 {
    let (lo, hi) = Scene::prepare(desc).unwrap().accel().bounds();
    let side = hi - lo;
    let area = 2.0 * (side.x * side.y + side.y * side.z + side.z * side.x);
    (4.0 * 12.0 * area / (std::f32::consts::PI * 8192.0)).sqrt()
}
