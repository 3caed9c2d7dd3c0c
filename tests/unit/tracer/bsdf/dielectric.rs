//! Tests of `tracer::bsdf::dielectric`.

use glam::{Vec3, Vec4};
use pointillist::spectrum::SampledSpectrum;
use pointillist::tracer::bsdf::*;
use pointillist::tracer::bsdf::{ScatteringModel, fresnel};

fn glass(eta: [f32; 4]) -> Dielectric {
    let one = SampledSpectrum::ONE;
    Dielectric::new([SampledSpectrum(Vec4::from_array(eta)), one], [one, one])
}

/// R + T = 1: the expected weight over the lobe number, radiance scaling undone, from both sides.
#[test]
fn nothing_is_lost() {
    for cos in [1.0f32, 0.9, 0.5, 0.1, 1e-4, -1.0, -0.8, -0.3, -1e-4] {
        let wo = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
        let (mut sum, n) = (Vec4::ZERO, 4096);
        for i in 0..n {
            let s =
                glass([1.5; 4]).sample(wo, [0.5; 2], (i as f32 + 0.5) / n as f32).expect("always samples");
            assert!((s.wi.length() - 1.0).abs() < 1e-6);
            sum += s.weight.0 * s.eta2 / n as f32;
        }
        assert!((sum - 1.0).abs().max_element() < 1e-3, "cos {cos}: {sum}");
    }
}

/// With dispersion each lane alone must still be conserved, also where some are totally reflected: at 0.755 only the
/// first is not, at 0.79 all but the last, at 0.78 the third and fourth.
#[test]
fn dispersion_conserves_every_lane() {
    let eta = Vec4::new(1.50, 1.52, 1.55, 1.60);
    for cos in [0.6f32, 0.1, -0.9, -0.79, -0.78, -0.77, -0.755, -0.75, -0.3] {
        for turn in 0..4 {
            let lanes: [f32; 4] = std::array::from_fn(|i| eta[(i + turn) % 4]);
            let (g, wo) = (glass(lanes), Vec3::new((1.0 - cos * cos).sqrt(), 0.0, cos));
            let (mut reflected, mut sum, n) = (Vec4::ZERO, Vec4::ZERO, 16_384);
            for i in 0..n {
                let Some(s) = g.sample(wo, [0.5; 2], (i as f32 + 0.5) / n as f32) else { continue };
                if !s.transmitted {
                    assert!(!s.hero_only);
                    reflected += s.weight.0 / n as f32;
                    sum += s.weight.0 / n as f32;
                    continue;
                }
                assert!(s.hero_only && s.wi.is_finite() && s.weight.is_finite());
                for lane in 0..4 {
                    let relative = if cos > 0.0 { lanes[lane] } else { 1.0 / lanes[lane] };
                    let Some((wi, eta2)) = g.refract(wo, lane) else {
                        assert_eq!(s.weight.0[lane], 0.0, "totally reflected");
                        continue;
                    };
                    assert!((wi.x * relative + wo.x).abs() < 1e-6 && wi.z * wo.z <= 0.0, "Snell");
                    sum[lane] += s.weight.0[lane] * eta2 / n as f32;
                }
            }
            let relative = if cos > 0.0 { Vec4::from(lanes) } else { 1.0 / Vec4::from(lanes) };
            let expected = fresnel::dielectric(cos.abs(), relative);
            assert!((reflected - expected).abs().max_element() < 1e-4, "{cos}: {reflected} {expected}");
            // One number of 16384 in the other lobe moves a weight of 4 at most.
            assert!((sum - 1.0).abs().max_element() < 4e-4, "{cos} {turn}: {sum}");
        }
    }
}

#[test]
fn equal_media_let_everything_straight_through() {
    let wo = Vec3::new(0.6, 0.0, 0.8);
    for lobe in [0.0, 0.5, 0.999_999_94] {
        let s = glass([1.0; 4]).sample(wo, [0.5; 2], lobe).expect("always samples");
        assert_eq!((s.wi, s.weight.0), (-wo, Vec4::ONE));
    }
}
