//! Coats of high index over a diffuse base.

use std::f64::consts::PI;

use glam::{Vec3, Vec4};

use pointillist::spectrum::SampledSpectrum;
use pointillist::tracer::bsdf::{Base, Plastic, ScatteringModel, fresnel};

use crate::Row;

/// What a white base under a clear coat returns, over what the coat lets in, of light along the normal.
fn returned(eta: f32, escape: f32) -> f64 {
    let one = SampledSpectrum::ONE;
    let base = Base { albedo: one, escape: SampledSpectrum::splat(escape), nonlinear: true };
    let plastic = Plastic::new([SampledSpectrum::splat(eta), one], one, base, false);
    let count = 1 << 14;
    // Cosine-weighted: u = cos² is uniform.
    let value = |i: u32| {
        let cos = ((f64::from(i) + 0.5) / f64::from(count)).sqrt();
        let wi = Vec3::new((1.0 - cos * cos).sqrt() as f32, 0.0, cos as f32);
        plastic.eval(Vec3::Z, wi).map_or(0.0, |(f, _)| f64::from(f.0.x) * PI / f64::from(wi.z))
    };
    let sum: f64 = (0..count).map(value).sum();
    sum / f64::from(count) / (1.0 - f64::from(fresnel::dielectric(1.0, Vec4::splat(eta)).x))
}

/// Nothing is lost or made between a clear coat and a white base, whatever the index.
#[test]
fn b9_coats_of_high_index() {
    for eta in [200.0f32, 1000.0, 2000.0] {
        let escape = fresnel::diffuse_escape(eta);
        // The reflectance from within is a number near 1, of which single precision keeps 24 bits.
        let within = 1.0 - escape;
        Row {
            case: &format!("B9 plastic of index {eta} over white"),
            measure: "error of what the base returns",
            figure: (returned(eta, escape) - 1.0).abs(),
            naive: ("1 − internal, at least 1e-6", (returned(eta, (1.0 - within).max(1e-6)) - 1.0).abs()),
            bound: 2e-3,
        }
        .check();
    }
}
