//! Tests of the lights on surfaces: `tracer::light::{flat, cylinder, sphere, spot}`.

use glam::{DVec3, Vec3};
use pointillist::math::random::Random;
use pointillist::tracer::bounding_sphere::BoundingSphere;
use pointillist::tracer::light::{
    CylinderLight, DiskLight, LightSampleContext, LightSource, ParallelogramLight, SphereLight, SpotLight,
    TriangleLight,
};
use pointillist::tracer::sampler::LightNumbers;
use pointillist::tracer::shape::{Cylinder, Disk, Sphere, Triangle};

const SCENE: BoundingSphere = BoundingSphere { center: Vec3::ZERO, radius: 10.0 };

fn lit(p: Vec3) -> LightSampleContext {
    LightSampleContext { p, n: Vec3::ZERO, through: true, glossy: false }
}

fn numbers(random: &mut Random) -> LightNumbers {
    let mut pair = || [random.f32(), random.f32()];
    LightNumbers { place: pair(), direction: pair(), choice: 0.5, aim: 0.5 }
}

/// Emitted points of a surface of one density: a ray that hits one would have been sampled with distance² / (cos · area), and not at all
/// from behind; and what next-event estimation samples has the same density and lies on the surface. `close` tells from where points are
/// sampled by solid angle instead.
fn check(light: &impl LightSource, area: f32, on_it: impl Fn(Vec3) -> bool, close: impl Fn(Vec3) -> bool) {
    assert!((light.power(SCENE) / area - 1.0).abs() < 1e-5, "the area is {}", light.power(SCENE));
    let mut random = Random(7);
    let mut seen = [0; 2];
    for _ in 0..1000 {
        let (hit, _) = light.emit(&numbers(&mut random), SCENE).expect("a point");
        let at = Vec3::from_array([(); 3].map(|()| random.within(-6.0, 6.0)));
        let to = hit.p - at;
        let wi = to.normalize();
        let cos = -wi.dot(hit.ng);
        seen[usize::from(cos > 0.0)] += 1;
        let expected = if cos > 0.0 { to.length_squared() / (cos * area) } else { 0.0 };
        let pdf = light.pdf(lit(at), wi, Some(&hit)).0;
        let is_right = close(at) || (pdf - expected).abs() <= 1e-3 * expected;
        assert!(is_right, "{pdf} instead of {expected} at cosine {cos}");
        assert!(on_it(hit.p), "emission from {}", hit.p);
        if let Some(sample) = light.sample(lit(at), [random.f32(), random.f32()]) {
            let target = sample.target.expect("a point");
            assert!(on_it(target), "light from {target}");
            assert!((target - at).normalize().dot(sample.wi) > 1.0 - 1e-5);
        }
    }
    assert!(seen.iter().all(|n| *n > 50), "one side only: {seen:?}");
}

#[test]
fn flat_lights_have_the_density_of_their_area() {
    let corner = Vec3::new(1.0, -0.5, 0.3);
    let (a, b) = (Vec3::new(0.3, 1.5, 0.2), Vec3::new(-0.8, 0.4, 2.0));
    let n = a.cross(b);
    let shares = move |p: Vec3| {
        let d = p - corner;
        [d.cross(b).dot(n), a.cross(d).dot(n)].map(|v| v / n.length_squared())
    };
    let flat = move |p: Vec3| (p - corner).dot(n.normalize()).abs() < 1e-5;
    let within = |v: f32| (-1e-4..=1.0 + 1e-4).contains(&v);
    check(
        &ParallelogramLight::over(corner, a, b, n.normalize()),
        n.length(),
        |p| flat(p) && shares(p).into_iter().all(within),
        |_| false,
    );
    let triangle = Triangle::new([corner, corner + a, corner + b]).expect("a triangle");
    let in_triangle = |p: Vec3| {
        let [x, y] = shares(p);
        flat(p) && within(x) && within(y) && within(x + y)
    };
    // From three times as far from its middle as its vertices are none is twice as far as any of its points.
    let middle = corner + (a + b) / 3.0;
    let reach = [Vec3::ZERO, a, b].map(|v| (corner + v).distance(middle)).into_iter().fold(0.0, f32::max);
    check(&TriangleLight::new(triangle), 0.5 * n.length(), in_triangle, |p| p.distance(middle) < 3.0 * reach);
    let disk = Disk::new(corner, a, b, DVec3::Z).expect("a disk");
    check(
        &DiskLight::new(disk),
        std::f32::consts::PI * n.length(),
        |p| {
            let [x, y] = shares(p);
            flat(p) && x * x + y * y < 1.0 + 1e-4
        },
        |_| false,
    );
}

#[test]
fn round_cylinders_have_the_density_of_their_area() {
    let (base, axis) = (Vec3::new(0.5, 1.0, -1.0), Vec3::new(0.0, 0.0, 3.0));
    for inward in [false, true] {
        let axes = [Vec3::X * 1.5, Vec3::Y * 1.5, axis];
        let cylinder = Cylinder::new(base, axes, inward).expect("a cylinder");
        check(
            &CylinderLight::new(cylinder),
            std::f32::consts::TAU * 1.5 * 3.0,
            |p| {
                let d = p - base;
                (d.truncate().length() - 1.5).abs() < 1e-4 && (-1e-4..3.0001).contains(&d.z)
            },
            |_| false,
        );
    }
}

/// Every direction from within a shining ball meets it where the sample says.
#[test]
fn targets_lie_on_the_sphere() {
    let (center, radius) = (Vec3::new(0.4, -2.0, 1.0), 3.5);
    let mut random = Random(9);
    for inward in [false, true] {
        let light = SphereLight::new(Sphere { center, radius, inward });
        for _ in 0..1000 {
            let reach = if inward { 0.99 } else { random.within(1.05, 5.0) };
            let at = center + radius * reach * random.direction().as_vec3();
            let target = light
                .sample(lit(at), [random.f32(), random.f32()])
                .expect("a sample")
                .target
                .expect("a point");
            let off = (target - center).length() / radius - 1.0;
            assert!(off.abs() < 1e-4, "{off} from {at}");
        }
    }
}

#[test]
fn a_spot_without_a_cone_is_black() {
    let spot = |cutoff| SpotLight::new(Vec3::ZERO, Vec3::Z, 0.0, cutoff);
    assert!(spot(0.0).is_black() && !spot(0.3).is_black());
}
