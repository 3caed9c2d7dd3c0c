//! The models of version 0.6 against their papers, in double precision and in other forms: by angles, not by vectors.

use std::f64::consts::PI;

use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};

use crate::support::scenes::Random;
use pointillist::color::Xyz;
use pointillist::scene::desc::WardVariant;
use pointillist::scene::load_str;
use pointillist::spectrum::SampledSpectrum;
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::bsdf::{
    Bsdf, DiffuseTransmitter, Phong, PhongLobe, RoughDiffuse, ScatteringModel, Ward, WardLobe,
};
use pointillist::tracer::integrator::{PathTracer, RenderContext};
use pointillist::tracer::{Camera, Integrator, Scene};

/// The factors of the lobe and of the diffuse part, or the albedo: other ones in each lane.
const SPECULAR: [f32; 4] = [0.4, 0.1, 0.3, 0.0];
const ALBEDO: [f32; 4] = [0.5, 0.7, 0.2, 0.9];

fn spectrum(values: [f32; 4]) -> SampledSpectrum {
    SampledSpectrum(Vec4::from_array(values))
}

pub fn phong(exponent: f32) -> Bsdf {
    Phong::new(PhongLobe::new(exponent), [SPECULAR, ALBEDO].map(spectrum), false).into()
}

pub fn ward(variant: WardVariant, alpha: [f32; 2]) -> Bsdf {
    Ward::new(WardLobe::new(variant, alpha), [SPECULAR, ALBEDO].map(spectrum), false).into()
}

/// Settings of all of them. Those whose name has `unbounded` may reflect more than arrives at grazing angles, as published.
pub fn empirical_materials() -> Vec<(String, Bsdf, f32)> {
    let matt = |alpha, fast| Bsdf::from(RoughDiffuse::new(spectrum(ALBEDO), alpha, fast));
    [
        ("rough diffuse .1", matt(0.1, false)),
        ("rough diffuse .7", matt(0.7, false)),
        ("rough diffuse .7, fast", matt(0.7, true)),
        ("phong 0", phong(0.0)),
        ("phong 20", phong(20.0)),
        ("phong 200", phong(200.0)),
        ("ward, balanced", ward(WardVariant::Balanced, [0.2; 2])),
        ("ward, balanced, brushed", ward(WardVariant::Balanced, [0.5, 0.15])),
        ("ward, unbounded", ward(WardVariant::Ward, [0.3, 0.2])),
        ("ward-duer, unbounded", ward(WardVariant::Duer, [0.2, 0.3])),
        ("diffuse transmitter", DiffuseTransmitter::new(spectrum(ALBEDO)).into()),
    ]
    .map(|(name, bsdf)| (name.to_owned(), bsdf, 1.0))
    .to_vec()
}

/// Angle to the normal and azimuth.
fn angles(w: Vec3) -> (f64, f64) {
    let w = w.as_dvec3().normalize();
    (w.truncate().length().atan2(w.z), w.y.atan2(w.x))
}

/// Pairs of directions above the horizon.
fn pairs() -> impl Iterator<Item = [Vec3; 2]> {
    let mut random = Random(23);
    let mut direction = move || {
        let w = random.direction().as_vec3();
        w.with_z(w.z.abs().max(0.02)).normalize()
    };
    (0..3000).map(move |_| [direction(), direction()])
}

/// Compares `eval` with f per lane.
fn assert_values(name: &str, bsdf: &Bsdf, expected: impl Fn(Vec3, Vec3, usize) -> f64) {
    for [wo, wi] in pairs() {
        let found = bsdf.eval(wo, wi).map_or(Vec4::ZERO, |(value, _)| value.0);
        for lane in 0..4 {
            let (found, expected) = (f64::from(found[lane]), expected(wo, wi, lane) * f64::from(wi.z));
            assert!(
                (found - expected).abs() < 2e-4 * expected + 1e-6,
                "{name}: {wo} {wi}, lane {lane}: {found}, not {expected}"
            );
        }
    }
}

/// Oren and Nayar 1994, eq. 27 (C₁ to C₃), 28 and 30, with σ in radians, and the qualitative model of section 4.4.
fn oren_nayar(wo: Vec3, wi: Vec3, albedo: f64, sigma: f64, fast: bool) -> f64 {
    let ((theta_r, phi_r), (theta_i, phi_i)) = (angles(wo), angles(wi));
    let (alpha, beta, s) = (theta_r.max(theta_i), theta_r.min(theta_i), sigma * sigma);
    let cos_phi = (phi_r - phi_i).cos();
    let c1 = 1.0 - 0.5 * s / (s + 0.33);
    let c2 = 0.45 * s / (s + 0.09);
    if fast {
        return albedo / PI * (c1 + c2 * cos_phi.max(0.0) * alpha.sin() * beta.tan());
    }
    let c2 = c2 * (alpha.sin() - if cos_phi >= 0.0 { 0.0 } else { (2.0 * beta / PI).powi(3) });
    let c3 = 0.125 * (s / (s + 0.09)) * (4.0 * alpha * beta / (PI * PI)).powi(2);
    let first = c1 + cos_phi * c2 * beta.tan() + (1.0 - cos_phi.abs()) * c3 * (0.5 * (alpha + beta)).tan();
    let second = 0.17 * albedo * s / (s + 0.13) * (1.0 - cos_phi * (2.0 * beta / PI).powi(2));
    albedo / PI * (first + second)
}

#[test]
fn rough_diffuse_is_that_of_oren_and_nayar() {
    for (alpha, fast) in [(0.0, false), (0.2, false), (0.8, false), (3.0, false), (0.2, true), (0.8, true)] {
        let bsdf = RoughDiffuse::new(spectrum(ALBEDO), alpha, fast).into();
        let sigma = f64::from(alpha) / 2f64.sqrt();
        assert_values(&format!("rough diffuse {alpha}"), &bsdf, |wo, wi, lane| {
            oren_nayar(wo, wi, f64::from(ALBEDO[lane]), sigma, fast)
        });
    }
}

/// Adds the diffuse part to a lobe, both scaled where their factors add up to more than 1.
fn over_diffuse(lobe: f64, lane: usize) -> f64 {
    let [specular, diffuse] = [SPECULAR, ALBEDO].map(|factor| f64::from(factor[lane]));
    (specular * lobe + diffuse / PI) / (specular + diffuse).max(1.0)
}

#[test]
fn phong_is_that_of_lafortune_and_willems() {
    for exponent in [0.0, 3.5, 30.0, 400.0] {
        assert_values(&format!("phong {exponent}"), &phong(exponent), |wo, wi, lane| {
            let ((theta_r, phi_r), (theta_i, phi_i)) = (angles(wo), angles(wi));
            // The mirror direction is half a turn away.
            let cos = theta_r.cos() * theta_i.cos() - theta_r.sin() * theta_i.sin() * (phi_r - phi_i).cos();
            let n = f64::from(exponent);
            over_diffuse((n + 2.0) / (2.0 * PI) * if cos > 0.0 { cos.powf(n) } else { 0.0 }, lane)
        });
    }
}

#[test]
fn ward_is_that_of_its_papers() {
    for alpha in [[0.1f32, 0.1], [0.15, 0.4], [1.2, 0.3]] {
        for variant in [WardVariant::Ward, WardVariant::Duer, WardVariant::Balanced] {
            assert_values(&format!("{variant:?} {alpha:?}"), &ward(variant, alpha), |wo, wi, lane| {
                let half = (wo.as_dvec3().normalize() + wi.as_dvec3().normalize()).as_vec3();
                let ((theta_r, phi_r), (theta_i, phi_i), (delta, phi)) =
                    (angles(wo), angles(wi), angles(half));
                let [x, y] = alpha.map(f64::from);
                let gauss =
                    (-delta.tan().powi(2) * ((phi.cos() / x).powi(2) + (phi.sin() / y).powi(2))).exp();
                let (cos_r, cos_i) = (theta_r.cos(), theta_i.cos());
                let between = cos_r * cos_i + theta_r.sin() * theta_i.sin() * (phi_r - phi_i).cos();
                let normalization = match variant {
                    WardVariant::Ward => 1.0 / (4.0 * PI * x * y * (cos_r * cos_i).sqrt()),
                    WardVariant::Duer => 1.0 / (4.0 * PI * x * y * cos_r * cos_i),
                    WardVariant::Balanced => 2.0 * (1.0 + between) / (PI * x * y * (cos_r + cos_i).powi(4)),
                };
                over_diffuse(gauss * normalization, lane)
            });
        }
    }
}

/// Only the other side is lit, and nothing is lost but what the factor says.
#[test]
fn a_diffuse_transmitter_lights_its_other_side() {
    let bsdf: Bsdf = DiffuseTransmitter::new(spectrum(ALBEDO)).into();
    for [wo, wi] in pairs() {
        assert!(bsdf.eval(wo, wi).is_none() && bsdf.eval(-wo, -wi).is_none());
        let expected = spectrum(ALBEDO).0 * (f64::from(wi.z) / PI) as f32;
        for (wo, wi) in [(wo, -wi), (-wo, wi)] {
            let (value, _) = bsdf.eval(wo, wi).expect("light goes through");
            assert!((value.0 - expected).abs().max_element() < 1e-6);
        }
    }
    let s = bsdf.sample(Vec3::new(0.6, 0.0, 0.8), [0.3, 0.7], 0.2).expect("light goes through");
    assert!(s.transmitted && s.wi.z < 0.0 && s.weight.0 == spectrum(ALBEDO).0 && s.eta2 == 1.0);
    assert!(bsdf.transmits() && bsdf.has_diffuse_part() && bsdf.as_diffuse().is_none());
}

/// The factors of a lobe and its diffuse part are scaled where they add up to more than 1; a lobe that is narrower than single
/// precision resolves is as narrow as that.
#[test]
fn extremes_of_lobes() {
    let all = Phong::new(PhongLobe::new(1e12), [SampledSpectrum::ONE; 2], false);
    let wo = DVec3::new(0.6, 0.0, 0.8).as_vec3();
    let mut random = Random(5);
    let mut sum = 0.0;
    for _ in 0..20_000 {
        let s = all.sample(wo, [random.f32(), random.f32()], random.f32()).expect("above the horizon");
        sum += f64::from(s.weight.0.x) / 20_000.0;
    }
    // Half of the light goes to the lobe, of which the cosine of the view is reflected.
    assert!((sum - 0.9).abs() < 0.02, "{sum}");
}

/// The luminances of samples.
struct Luminances(Vec<f32>);

impl SampleSink for Luminances {
    fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
        self.0.push(value.y);
    }

    fn light(&mut self, _: [f32; 2], _: Xyz) {}
}

/// The samples of a surface of this material that fills the picture, lit by radiance 1 from everywhere.
fn samples(bsdf: &str) -> Vec<f32> {
    let text = format!(
        "<scene version='3.0.0'><sensor type='perspective'><float name='fov' value='20'/><transform name='to_world'>\
         <lookat origin='0, -1, 3' target='0, 0, 0' up='0, 1, 0'/></transform></sensor><emitter type='constant'/>\
         <shape type='rectangle'><transform name='to_world'><scale value='9'/></transform>{bsdf}</shape></scene>"
    );
    let desc = load_str("t.xml", &text, &[]).expect("readable").desc;
    let scene = Arc::new(Scene::prepare(&desc).expect("valid"));
    let camera = Camera::of(&desc).expect("a camera");
    let tracer: PathTracer = RenderContext::new(scene, camera, &desc.integrator, 3, UvWindow::PICTURE).into();
    let (mut scratch, mut found) = (Default::default(), Luminances(Vec::new()));
    (0..20_000).for_each(|index| tracer.trace(index, &mut scratch, &mut found));
    found.0
}

/// A mixture has the samples of the blends that make the same shares of the same materials, and what its weights leave of 1 is black.
#[test]
fn mixtures_are_blends() {
    let of = |plugin: &str, inner: &str| format!("<bsdf type='{plugin}'>{inner}</bsdf>");
    let matt = |v: f32| of("diffuse", &format!("<rgb name='reflectance' value='{v}'/>"));
    let weights = |weights: &str| format!("<string name='weights' value='{weights}'/>");
    let half = "<float name='weight' value='0.5'/>";
    let (a, b, c) = (matt(0.2), of("roughconductor", ""), matt(0.9));
    let blend = of("blendbsdf", &format!("{half}{a}{}", of("blendbsdf", &format!("{half}{b}{c}"))));
    assert_eq!(samples(&of("mixturebsdf", &format!("{}{a}{b}{c}", weights(".5 .25 .25")))), samples(&blend));
    for (weight, albedo) in [("0.5", 0.4), ("0.25", 0.2), ("1", 0.8), ("2", 0.8)] {
        let found = samples(&of("mixturebsdf", &format!("{}{}", weights(weight), matt(0.8))));
        let mean = found.iter().map(|v| f64::from(*v)).sum::<f64>() / found.len() as f64;
        // D65 of radiance 1 has this luminance through the same camera.
        let white = samples(&matt(1.0)).iter().map(|v| f64::from(*v)).sum::<f64>() / found.len() as f64;
        assert!((mean / white - albedo).abs() < 0.01, "{weight}: {mean} of {white}");
    }
}
