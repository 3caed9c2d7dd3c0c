//! Light subpaths are aimed at what casts caustics, and their densities are those that are told.

use glam::{DVec3, Vec3};
use pointillist::math::random::Random;
use pointillist::scene;
use pointillist::tracer::Scene;
use pointillist::tracer::bounding_sphere::BoundingSphere;
use pointillist::tracer::light::{CausticCasters, Lights};
use pointillist::tracer::sampler::LightNumbers;

/// A ball of this material over a floor, and a light.
fn scene(bsdf: &str, light: &str) -> Scene {
    let text = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\
         <shape type=\"rectangle\"><transform name=\"to_world\"><scale value=\"4\"/><rotate x=\"1\" angle=\"-90\"/></transform></shape>\
         <shape type=\"sphere\"><point name=\"center\" value=\"1, 1, 0\"/><float name=\"radius\" value=\"0.3\"/>{bsdf}</shape>{light}</scene>"
    );
    let desc = scene::load_str("ball.xml", &text, &[]).unwrap().desc;
    Scene::prepare(&desc).unwrap()
}

const GLASS: &str = "<bsdf type=\"dielectric\"/>";

const LAMP: &str = "<shape type=\"rectangle\"><transform name=\"to_world\"><scale value=\"0.2\"/><rotate x=\"1\" angle=\"90\"/>\
                    <translate y=\"3\"/></transform><emitter type=\"area\"><rgb name=\"radiance\" value=\"5\"/></emitter></shape>";

const LIGHTS: [(&str, &str); 5] = [
    ("area", LAMP),
    (
        "point",
        "<emitter type=\"point\"><point name=\"position\" value=\"0, 3, 0\"/><rgb name=\"intensity\" value=\"5\"/></emitter>",
    ),
    (
        "spot",
        "<emitter type=\"spot\"><transform name=\"to_world\"><lookat origin=\"0, 3, 0\" target=\"0.8, 1, 0\" up=\"0, 0, 1\"/></transform>\
         <rgb name=\"intensity\" value=\"5\"/></emitter>",
    ),
    (
        "directional",
        "<emitter type=\"directional\"><vector name=\"direction\" value=\"0.2, -1, 0.1\"/><rgb name=\"irradiance\" value=\"5\"/></emitter>",
    ),
    ("constant", "<emitter type=\"constant\"><rgb name=\"radiance\" value=\"5\"/></emitter>"),
];

/// What is made of a ray, of its origin and its direction.
type RayValue<'a> = dyn Fn([Vec3; 2]) -> f64 + 'a;

/// The mean of what `value` makes of rays of `emit`, over their densities, and its squared standard error.
fn mean(
    lights: &Lights,
    emit: impl Fn(&LightNumbers) -> Option<([Vec3; 2], f32)>,
    value: impl Fn([Vec3; 2]) -> f64,
) -> [f64; 2] {
    assert!(!lights.is_empty());
    let (n, mut random) = (1 << 18, Random(5));
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..n {
        let mut pair = || [random.f32(), random.f32()];
        let [place, direction] = [pair(), pair()];
        let numbers = LightNumbers { place, direction, choice: random.f64(), aim: random.f32() };
        let Some((ray, scale)) = emit(&numbers) else { continue };
        let x = value(ray) * f64::from(scale);
        (sum, squares) = (sum + x, squares + x * x);
    }
    let n = f64::from(n);
    [sum / n, (squares / n - (sum / n).powi(2)) / n]
}

/// Over their densities, aimed rays bring the flux of those that are not aimed: in all, to the ball, and past it. The ball gets at least a
/// fifth of the rays, whatever it looks like from the light.
#[test]
fn aimed_rays_have_their_density() {
    for (what, light) in LIGHTS {
        let scene = scene(GLASS, light);
        let lights = scene.lights();
        let center = scene.space().point(DVec3::new(1.0, 1.0, 0.0)).as_vec3();
        let radius = scene.space().length(0.3);
        let to_ball = |[from, direction]: [Vec3; 2]| {
            let offset = center - from;
            (offset - direction * offset.dot(direction)).length() < radius
        };
        let even = |u: &LightNumbers| lights.emit(u).map(|e| ([e.from.p, e.direction], e.scale()));
        let aimed = |u: &LightNumbers| lights.emit_aimed(u).map(|e| ([e.from.p, e.direction], e.scale()));
        let tests: [(&str, &RayValue<'_>); 3] = [
            ("in all", &|_| 1.0),
            ("to the ball", &|ray| f64::from(u8::from(to_ball(ray)))),
            ("past the ball", &|[from, d]| {
                if to_ball([from, d]) { 0.0 } else { f64::from(1.0 + d.x * d.y + 0.1 * from.z) }
            }),
        ];
        for (which, value) in tests {
            let ([a, va], [b, vb]) = (mean(lights, even, value), mean(lights, aimed, value));
            let z = (a - b) / (va + vb).sqrt().max(1e-9 * a.abs());
            println!("{what} {which}: {a} {b}, z = {z:.2}");
            assert!(a > 0.0 && z.abs() < 4.0, "{what} {which}: {a} {b}, z = {z}");
        }
        let unscaled = |u: &LightNumbers| aimed(u).map(|(ray, _)| (ray, 1.0));
        let [share, _] = mean(lights, unscaled, |ray| f64::from(u8::from(to_ball(ray))));
        assert!(share > 0.2, "{what}: {share}");
    }
}

/// Without mirrors and glass rays are those that are not aimed, and so they are with a ball of something dull.
#[test]
fn nothing_dull_is_aimed_at() {
    for bsdf in ["", "<bsdf type=\"plastic\"/>", "<bsdf type=\"thindielectric\"/>"] {
        let scene = scene(bsdf, LAMP);
        let mut random = Random(6);
        for _ in 0..1000 {
            let mut pair = || [random.f32(), random.f32()];
            let [place, direction] = [pair(), pair()];
            let u = LightNumbers { place, direction, choice: random.f64(), aim: random.f32() };
            let rays = [scene.lights().emit(&u), scene.lights().emit_aimed(&u)];
            let [a, b] = rays.map(|e| e.map(|e| (e.from.p, e.direction, e.pdf)));
            assert_eq!(a, b, "{bsdf}");
        }
    }
}

/// An edit that makes the ball of glass aims at it, and one that makes it dull does not.
#[test]
fn an_edit_of_a_material_aims_anew() {
    let desc = |bsdf: &str| {
        let text = format!(
            "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>{LAMP}\
             <shape type=\"sphere\"><float name=\"radius\" value=\"0.3\"/>{bsdf}</shape></scene>"
        );
        scene::load_str("ball.xml", &text, &[]).unwrap().desc
    };
    let (dull, glass) = (desc("<bsdf type=\"diffuse\"/>"), desc(GLASS));
    let u = LightNumbers { place: [0.4; 2], direction: [0.9; 2], choice: 0.5, aim: 0.1 };
    let ray = |scene: &Scene| scene.lights().emit_aimed(&u).map(|e| (e.direction, e.pdf));
    let [a, b] = [&dull, &glass].map(|desc| Scene::prepare(desc).unwrap());
    assert_ne!(ray(&a), ray(&b));
    // The mesh of neither is shared, but a sphere has none: the geometry stays.
    assert_eq!(ray(&a.edited(&glass).unwrap()), ray(&b));
    assert_eq!(ray(&b.edited(&dull).unwrap()), ray(&a));
}

/// A thousand casters are in a few spheres that hold them all, so that each is aimed at.
#[test]
fn many_casters_share_spheres() {
    let mut random = Random(7);
    let mut point = || Vec3::new(random.f32(), random.f32(), random.f32()) * 2.0;
    let spheres: Vec<BoundingSphere> =
        (0..1000).map(|_| BoundingSphere { center: point(), radius: 0.01 }).collect();
    let casters = CausticCasters::new(spheres.clone());
    let count = casters.spheres().len();
    assert!((2..=16).contains(&count), "{count}");
    for one in spheres {
        let holds = |s: &&BoundingSphere| s.center.distance(one.center) + one.radius <= s.radius * 1.0001;
        assert!(casters.spheres().iter().any(|s| holds(&s)), "{one:?}");
    }
    assert!(CausticCasters::new(Vec::new()).spheres().is_empty());
}
