//! Tests of `tracer::light::sphere`.

use glam::Vec3;
use pointillist::tracer::light::*;
use pointillist::tracer::light::{LightSampleContext, LightSource};
use pointillist::tracer::shape::{Sphere, SurfacePoint};

/// Irradiance of a point that faces the centre of a unit-radiance sphere is π (r/d)², and from
/// within, straight "up" into the sphere, π; the cone computed by the textbook 1 − √(1 − sin²) fails.
#[test]
fn irradiance_of_small_far_near_and_surrounding_spheres() {
    let naive = |ratio: f32| 1.0 - (1.0 - ratio * ratio).sqrt();
    assert_eq!(naive(1e-5), 0.0, "the case is too easy");
    for ratio in [1e-8f32, 1e-6, 1e-4, 1e-2, 0.1, 0.5, 0.9, 0.99, 0.999] {
        let sphere = Sphere { center: Vec3::new(0.0, 0.0, 1.0), radius: ratio, inward: false };
        let e = irradiance(sphere);
        let exact = std::f64::consts::PI * f64::from(ratio).powi(2);
        assert!((e / exact - 1.0).abs() < 1e-4, "r/d = {ratio}: {e} instead of {exact}");
    }
    let e = irradiance(Sphere { center: Vec3::new(0.3, 0.2, -0.1), radius: 1.0, inward: true });
    assert!((e / std::f64::consts::PI - 1.0).abs() < 1e-4, "inside: {e}");
    let dark = Sphere { center: Vec3::ZERO, radius: 1.0, inward: false };
    assert_eq!(irradiance(dark), 0.0);
}

fn irradiance(sphere: Sphere) -> f64 {
    let (light, at) = (
        SphereLight::new(sphere),
        LightSampleContext { p: Vec3::ZERO, n: Vec3::Z, through: false, glossy: false },
    );
    let n = 512;
    let mut sum = 0.0;
    for i in 0..n * n {
        let u = [((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32];
        if let Some(s) = light.sample(at, u) {
            let hit = SurfacePoint { p: s.target.expect("a point"), error: Vec3::ZERO, ng: -s.wi };
            assert_eq!(s.pdf, light.pdf(at, s.wi, Some(&hit)));
            assert!((s.wi.length() - 1.0).abs() < 1e-5);
            sum += f64::from(s.wi.z.max(0.0)) / f64::from(s.pdf.0);
        }
    }
    sum / (n * n) as f64
}
