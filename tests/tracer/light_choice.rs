//! Which light a lit point samples: probabilities that add up, that are those of the choice, and that follow what the
//! lights bring.

use glam::Vec3;

use crate::support::scenes::*;
use pointillist::spectrum::Spectrum;
use pointillist::tracer::accel::PrimRange;
use pointillist::tracer::bounding_sphere::BoundingSphere;
use pointillist::tracer::light::{
    ConstantLight, DirectionalLight, Light, LightSampleContext, LightShape, Lights, ParallelogramLight,
    PointLight, SphereLight, SpotLight, TriangleLight,
};
use pointillist::tracer::shape::{Sphere, Triangle};

const EXTENT: BoundingSphere = BoundingSphere { center: Vec3::ZERO, radius: 10.0 };

fn vec(r: &mut Random, half: f64) -> Vec3 {
    (glam::DVec3::new(r.f64(), r.f64(), r.f64()) * 2.0 - 1.0).as_vec3() * half as f32
}

fn triangle(corners: [Vec3; 3]) -> Option<LightShape> {
    Triangle::new(corners).map(|t| LightShape::Triangle(TriangleLight::new(t)))
}

/// A light of any kind but an environment, within 5 of the origin.
fn any_light(r: &mut Random) -> LightShape {
    let (p, size) = (vec(r, 5.0), 10f64.powf(r.f64() * 3.0 - 2.5));
    let (a, b) = (vec(r, size), vec(r, size));
    match (r.f64() * 5.0) as u32 {
        0 => LightShape::Point(PointLight { position: p }),
        1 => {
            let inward = r.f64() < 0.3;
            LightShape::Sphere(SphereLight::new(Sphere { center: p, radius: size as f32, inward }))
        }
        2 => LightShape::Parallelogram(ParallelogramLight::over(p, a, b, a.cross(b).normalize())),
        3 => {
            let cutoff = 3.0 * r.f32();
            LightShape::Spot(SpotLight::new(p, r.direction().as_vec3(), cutoff * r.f32(), cutoff))
        }
        _ => triangle([p, p + a, p + b]).unwrap_or(LightShape::Point(PointLight { position: p })),
    }
}

/// These lights, of brightness by `value`.
fn lights(shapes: Vec<LightShape>, value: impl Fn(usize) -> f32) -> Lights {
    let spectra = (0..shapes.len()).map(|i| Spectrum::Constant(value(i))).collect();
    let light = |(i, shape)| Light { shape, spectrum: i as u32, prims: PrimRange::NONE };
    Lights::new(shapes.into_iter().enumerate().map(light).collect(), spectra, EXTENT)
}

fn lit(r: &mut Random) -> LightSampleContext {
    LightSampleContext { p: vec(r, 6.0), n: r.direction().as_vec3(), through: r.f64() < 0.25, glossy: false }
}

fn total(lights: &Lights, at: LightSampleContext) -> f64 {
    let probability = |i| {
        let p = lights.probability(i, at);
        assert!((0.0..=1.0).contains(&p), "{i}: {p} at {at:?}");
        f64::from(p)
    };
    (0..lights.len() as u32).map(probability).sum()
}

/// Sets of 1 to 300 lights of all kinds, with and without an environment, of powers over six decades.
fn sets() -> Vec<Lights> {
    let mut r = Random(1);
    let mut sets = Vec::new();
    for n in [1, 2, 5, 16, 17, 40, 300] {
        for environment in [false, true] {
            let mut shapes: Vec<LightShape> = (0..n).map(|_| any_light(&mut r)).collect();
            if environment {
                shapes.push(LightShape::Constant(ConstantLight));
                // None, one, two or three lights from single directions, among the others.
                for i in 0..n % 4 {
                    let direction = r.direction().as_vec3();
                    shapes.insert(i, LightShape::Directional(DirectionalLight { direction }));
                }
            }
            let values: Vec<f32> = shapes.iter().map(|_| 10f64.powf(r.f64() * 6.0 - 3.0) as f32).collect();
            sets.push(lights(shapes, |i| values[i]));
        }
    }
    sets
}

#[test]
fn probabilities_add_up_to_one() {
    let mut r = Random(2);
    for set in sets() {
        for _ in 0..200 {
            let at = lit(&mut r);
            let sum = total(&set, at);
            assert!((sum - 1.0).abs() < 1e-6, "{} lights: {sum} at {at:?}", set.len());
        }
    }
}

/// Every kind of light in every sort of choice: what is sampled has the probability that is told, to the bit where the
/// rest of the density is known.
#[test]
fn samples_carry_the_probability_of_their_light() {
    let mut r = Random(3);
    for set in sets() {
        for _ in 0..3000 {
            let at = lit(&mut r);
            let Some((light, sample)) = set.sample(at, r.f64(), [r.f32(), r.f32()]) else { continue };
            let p = set.probability(light, at);
            assert!(p > 0.0 && sample.pdf.0 > 0.0 && sample.pdf.0 < f32::INFINITY, "{sample:?}");
            if sample.delta {
                assert_eq!(sample.pdf.0, p);
            }
            if set.environment() == Some(light) {
                let again = set.pdf(light, at, sample.wi, None).0;
                assert!((again - sample.pdf.0).abs() < 1e-5, "{again} {sample:?}");
            }
        }
    }
}

/// Spheres never fail from outside: counts against probabilities, for few and many.
#[test]
fn chi_squared_of_the_choice_among_spheres() {
    let mut r = Random(4);
    for n in [2, 16, 17, 500] {
        let sphere = |r: &mut Random| {
            let radius = 0.02 + 0.1 * r.f32();
            LightShape::Sphere(SphereLight::new(Sphere { center: vec(r, 4.0), radius, inward: false }))
        };
        let shapes = (0..n).map(|_| sphere(&mut r)).collect();
        let values: Vec<f32> = (0..n).map(|_| 0.1 + 10.0 * r.f32()).collect();
        let set = lights(shapes, |i| values[i]);
        for _ in 0..5 {
            let at = LightSampleContext { p: vec(&mut r, 1.0) + Vec3::X * 6.0, ..lit(&mut r) };
            let samples = 200_000;
            let mut counts = vec![0; n];
            for _ in 0..samples {
                let (light, sample) = set.sample(at, r.f64(), [0.3, 0.6]).expect("seen from outside");
                counts[light as usize] += 1;
                let hit = pointillist::tracer::shape::SurfacePoint {
                    p: sample.target.expect("a surface"),
                    error: Vec3::ZERO,
                    ng: -sample.wi,
                };
                assert_eq!(set.pdf(light, at, sample.wi, Some(&hit)), sample.pdf, "to the bit");
            }
            let share = |i| f64::from(set.probability(i as u32, at)) * f64::from(samples);
            let expected: Vec<f64> = (0..n).map(share).collect();
            assert_counts(&counts, &expected, 0.0, &format!("{n} spheres"));
        }
    }
}

/// No light that can bring something has probability 0; behind an opaque surface, all has where anything is before it.
#[test]
fn only_what_cannot_light_the_point_is_left_out() {
    let mut r = Random(5);
    let (mut seen, mut left_out) = (0, 0);
    for set in sets() {
        for _ in 0..2000 {
            let at = lit(&mut r);
            // Any light that a uniform choice of direction or point finds.
            let numbers = pointillist::tracer::sampler::LightNumbers {
                choice: r.f64(),
                place: [r.f32(), r.f32()],
                direction: [r.f32(), r.f32()],
                aim: 0.5,
            };
            let Some(emission) = set.emit(&numbers) else { continue };
            if set.environment() == Some(emission.light) {
                continue;
            }
            let far = emission.pdf.origin.is_far();
            let wi = if far { -emission.direction } else { (emission.from.p - at.p).normalize() };
            let cos_light = match emission.pdf.origin.is_delta() {
                // Nothing is sampled outside of the cone of a spot.
                true => f32::from(set.emission_pdf(emission.light, emission.from.p, -wi).next > 0.0),
                false => -wi.dot(emission.from.ng),
            };
            let cos = if at.through { wi.dot(at.n).abs() } else { wi.dot(at.n) };
            let p = set.probability(emission.light, at);
            if cos > 1e-4 && cos_light > 1e-4 {
                assert!(p > 0.0, "{emission:?} at {at:?}");
                seen += 1;
            }
            left_out += u32::from(p == 0.0);
        }
    }
    assert!(seen > 3000 && left_out > 1000, "{seen} {left_out}");
}

/// Next-event estimation never looks for a constant environment, so that multiple importance sampling must not expect it to, also
/// where each light is sampled.
#[test]
fn a_constant_environment_is_left_to_scattering() {
    let mut r = Random(9);
    for set in sets() {
        let Some(environment) = set.environment() else { continue };
        for i in 0..200 {
            let at = LightSampleContext { glossy: i % 2 == 0, ..lit(&mut r) };
            assert_eq!(set.probability(environment, at), 0.0, "{at:?}");
            let sampled = set.sample(at, r.f64(), [r.f32(), r.f32()]);
            assert!(sampled.is_none_or(|(light, _)| light != environment), "{at:?}");
        }
    }
}

#[test]
fn degenerate_lights_and_points() {
    let mut r = Random(6);
    let tiny = triangle([Vec3::ZERO, Vec3::X * 1e-15, Vec3::Y * 1e-15]).expect("it has a normal");
    let square = LightShape::Parallelogram(ParallelogramLight::over(
        Vec3::ZERO,
        Vec3::X * 2.0,
        Vec3::Y * 2.0,
        Vec3::Z,
    ));
    let point = LightShape::Point(PointLight { position: Vec3::ZERO });
    let far = LightShape::Point(PointLight { position: Vec3::splat(1e12) });
    for n in [2, 17, 3000] {
        for shape in [&tiny, &square, &point, &far] {
            for value in [0.0, 1e-38, 1.0, 1e38] {
                for odd in [0.0, 1.0, 1e30, 3e38] {
                    let set = lights(vec![shape.clone(); n], |i| if i == 0 { odd } else { value });
                    for p in [
                        Vec3::ZERO,
                        Vec3::ONE,
                        Vec3::splat(1e12),
                        Vec3::splat(1e-30),
                        Vec3::NAN,
                        Vec3::INFINITY,
                    ] {
                        let at = LightSampleContext { p, n: Vec3::Z, through: n == 2, glossy: false };
                        let sum = total(&set, at);
                        let bound = if n > 100 { 1e-5 } else { 1e-6 };
                        assert!((sum - 1.0).abs() < bound, "{n} × {shape:?}, {value}, {odd}: {sum} at {p}");
                        for u in [0.0, r.f64(), 1.0 - f64::EPSILON / 2.0] {
                            if let Some((light, sample)) = set.sample(at, u, [r.f32(), r.f32()]) {
                                assert!(set.probability(light, at) > 0.0 && !sample.pdf.0.is_nan());
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Lights in places that halve again and again: the deepest tree there is.
#[test]
fn a_tree_is_never_too_deep() {
    let place = |i: usize| Vec3::X * 0.9f32.powi(i as i32 % 800) * 9.0;
    let shapes = (0..20_000).map(|i| LightShape::Point(PointLight { position: place(i) })).collect();
    let set = lights(shapes, |i| 2f32.powi(-(i as i32 % 100)));
    for p in [Vec3::ZERO, Vec3::Z, Vec3::X * 9.0] {
        let sum = total(&set, LightSampleContext { p, n: Vec3::Z, through: true, glossy: false });
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
    }
}

/// One light, or one that shines: nothing is weighed.
#[test]
fn the_only_light_is_certain() {
    let mut r = Random(7);
    let shapes: Vec<LightShape> = (0..5).map(|_| any_light(&mut r)).collect();
    for n in [1, 5] {
        let set = lights(shapes[..n].to_vec(), |i| if i == n - 1 { 2.0 } else { 0.0 });
        for _ in 0..100 {
            let at = lit(&mut r);
            for i in 0..n {
                assert_eq!(set.probability(i as u32, at), if i == n - 1 { 1.0 } else { 0.0 });
            }
        }
    }
}

/// Variance of the irradiance from 2 000 small lights on a ceiling, relative to its square: 1.1, by power 33.
#[test]
fn many_lights_are_chosen_by_what_they_bring() {
    let mut r = Random(8);
    let n = 2000;
    let lamp = |r: &mut Random| {
        let p = Vec3::new(vec(r, 8.0).x, vec(r, 8.0).y, 1.0);
        let (a, b) = (Vec3::Y * 0.02, Vec3::X * 0.02);
        LightShape::Parallelogram(ParallelogramLight::over(p, a, b, Vec3::NEG_Z))
    };
    let shapes: Vec<LightShape> = (0..n).map(|_| lamp(&mut r)).collect();
    let set = lights(shapes, |_| 1.0);
    let power = 1.0 / n as f32;
    let (mut ours, mut by_power) = (0.0, 0.0);
    for _ in 0..50 {
        let at = LightSampleContext {
            p: vec(&mut r, 7.0) * Vec3::new(1.0, 1.0, 0.05),
            n: Vec3::Z,
            through: false,
            glossy: false,
        };
        let (mut sum, mut squares, mut squares_by_power) = (0.0, 0.0, 0.0);
        // Each light's share by the middle of its sample.
        let mut count = 0;
        while count < 20_000 {
            count += 1;
            let Some((light, s)) = set.sample(at, r.f64(), [0.5, 0.5]) else { continue };
            let value = s.wi.dot(at.n).max(0.0) / s.pdf.0;
            let p = set.probability(light, at);
            sum += f64::from(value);
            squares += f64::from(value * value);
            // The second moment of the other choice, weighted by the quotient of the two.
            squares_by_power += f64::from(value * value * p / power);
        }
        let k = f64::from(count);
        let mean2 = (sum / k).powi(2);
        ours += squares / k / mean2 - 1.0;
        by_power += squares_by_power / k / mean2 - 1.0;
    }
    println!("relative variance {:.2}, by power {:.1}", ours / 50.0, by_power / 50.0);
    assert!(ours < 0.06 * by_power && ours / 50.0 < 1.6, "{ours} {by_power}");
}
