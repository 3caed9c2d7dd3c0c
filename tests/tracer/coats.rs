//! Coats over other materials: values by formulas of their own in double precision, limits that are known, and maps over and under them.

use std::path::Path;

use glam::{DVec3, Vec3, Vec4};

use crate::bsdf::direction;
use crate::bumps::{check_samples, flat_and_tilted};
use crate::support::scenes::{Random, in_world_space};
use pointillist::scene::load_str;
use pointillist::spectrum::SampledWavelengths;
use pointillist::tracer::Scene;
use pointillist::tracer::accel::Ray;
use pointillist::tracer::bsdf::{Bsdf, ScatteringModel};

const LAMBDA: f32 = 0.3;

/// The material of a file, as a disk in the plane z = 0 has it half-way to its edge along x, seen from above.
fn read(material: &str) -> Bsdf {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/plugins/test.xml");
    let others = "<sensor type='perspective'/><emitter type='constant'/>";
    let text = format!("<scene version='3.0.0'>{others}<shape type='rectangle'>{material}</shape></scene>");
    let desc = in_world_space(load_str(&beside.display().to_string(), &text, &[]).expect("a material").desc);
    let scene = Scene::prepare(&desc).expect("a scene");
    let hit = scene.closest(&Ray::new(Vec3::new(0.3, 0.2, 1.0), -Vec3::Z)).expect("it is below");
    scene.surface_material(&hit).bsdf(&SampledWavelengths::sample(LAMBDA))
}

fn of(plugin: &str, inner: &str) -> String {
    format!("<bsdf type='{plugin}'>{inner}</bsdf>")
}

fn float(name: &str, v: f64) -> String {
    format!("<float name='{name}' value='{v}'/>")
}

fn matt(albedo: f64) -> String {
    of("diffuse", &float("reflectance", albedo))
}

fn index(inside: f64) -> String {
    float("int_ior", inside) + &float("ext_ior", 1.0)
}

/// A coat of an index, with more parameters.
fn coat(plugin: &str, eta: f64, more: &str, inner: &str) -> String {
    of(plugin, &format!("{}{more}{inner}", index(eta)))
}

/// Metal that loses nothing.
fn silver(alpha: f64) -> String {
    let factors = float("eta", 0.0) + &float("k", 1.0) + &float("alpha", alpha);
    of("roughconductor", &format!("{factors}<string name='distribution' value='ggx'/>"))
}

/// Settings of coats, each with the index behind the surface.
pub fn coats() -> Vec<(String, Bsdf, f32)> {
    let rough = |alpha: f64| float("alpha", alpha) + "<string name='distribution' value='ggx'/>";
    let absorbing = float("sigma_a", 0.4);
    let blend = |a: &str, b: &str| of("blendbsdf", &format!("{}{a}{b}", float("weight", 0.4)));
    let plastic = of("plastic", "");
    [
        ("smooth over white", coat("coating", 1.5, "", &matt(1.0))),
        ("absorbing over grey", coat("coating", 1.5, &absorbing, &matt(0.6))),
        (
            "lighter than around it",
            of("coating", &(float("int_ior", 1.0) + &float("ext_ior", 1.1) + &matt(0.8))),
        ),
        ("smooth over metal", coat("coating", 1.5, "", &silver(0.4))),
        ("smooth over a smooth one", coat("coating", 1.3, "", &plastic)),
        ("smooth over cavities", coat("coating", 1.5, "", &of("roughdiffuse", &float("alpha", 0.4)))),
        ("smooth over a sheet", coat("coating", 1.5, "", &of("difftrans", ""))),
        ("smooth over shares", coat("coating", 1.5, "", &blend(&matt(0.9), &silver(0.4)))),
        (
            "shares of coats",
            blend(&coat("coating", 1.5, "", &matt(0.9)), &coat("roughcoating", 1.7, &rough(0.3), &matt(0.2))),
        ),
        ("rough over white", coat("roughcoating", 1.5, &rough(0.3), &matt(1.0))),
        (
            "rough, absorbing, over metal",
            coat("roughcoating", 1.5, &(rough(0.25) + &absorbing), &silver(0.5)),
        ),
        ("rough over black", coat("roughcoating", 1.5, &rough(0.5), &matt(0.0))),
        (
            "rough over ward",
            coat(
                "roughcoating",
                1.5,
                &rough(0.3),
                &of("ward", &(float("alpha_u", 0.4) + &float("alpha_v", 0.2))),
            ),
        ),
    ]
    .map(|(name, bsdf)| (format!("coat, {name}"), read(&bsdf), 1.0))
    .to_vec()
}

/// Unpolarised reflectance by Fresnel, from the angles themselves.
fn fresnel(cos: f64, eta: f64) -> f64 {
    let a = cos.acos();
    let sin = a.sin() / eta;
    if sin >= 1.0 {
        return 1.0;
    }
    let b = sin.asin();
    if a < 1e-6 {
        return ((eta - 1.0) / (eta + 1.0)).powi(2);
    }
    let (s, p) = ((a - b).sin() / (a + b).sin(), (a - b).tan() / (a + b).tan());
    0.5 * (s * s + p * p)
}

/// The direction within a medium, by angles.
fn within(w: Vec3, eta: f64) -> DVec3 {
    let w = w.as_dvec3().normalize();
    let (theta, phi) = ((w.truncate().length() / eta).asin(), w.y.atan2(w.x));
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

fn pairs() -> impl Iterator<Item = [Vec3; 2]> {
    let mut random = Random(23);
    let mut up = move || {
        let w = random.direction().as_vec3();
        w.with_z(w.z.abs().max(0.02)).normalize()
    };
    (0..2000).map(move |_| [up(), up()])
}

fn value(bsdf: &Bsdf, wo: Vec3, wi: Vec3) -> Vec4 {
    bsdf.eval(wo, wi).map_or(Vec4::ZERO, |(value, _)| value.0)
}

/// f′(ωₒ′, ωᵢ′) T(ωₒ) T(ωᵢ) exp(−σ d (1/cos θₒ′ + 1/cos θᵢ′)) / η², with T by the sum of Fresnel's formulas over angles.
#[test]
fn values_are_those_of_refracted_directions() {
    let (sigma, thickness) = (0.8, 0.5);
    let more = float("sigma_a", sigma) + &float("thickness", thickness);
    for eta in [1.2, 1.5, 2.4] {
        for inner in [matt(0.7), silver(0.4), of("phong", &float("exponent", 12.0)), of("ward", "")] {
            let (bare, coated) = (read(&inner), read(&coat("coating", eta, &more, &inner)));
            for [wo, wi] in pairs() {
                let inwards = [wo, wi].map(|w| within(w, eta));
                let f = value(&bare, inwards[0].as_vec3(), inwards[1].as_vec3()).x;
                let cos = f64::from(wi.z);
                let through = (1.0 - fresnel(wo.z.into(), eta)) * (1.0 - fresnel(cos, eta)) / (eta * eta);
                let path = thickness * (1.0 / inwards[0].z + 1.0 / inwards[1].z);
                let expected = f64::from(f) / inwards[1].z * cos * through * (-sigma * path).exp();
                let found = f64::from(value(&coated, wo, wi).x);
                let off = (found - expected).abs();
                assert!(off < 2e-3 * expected + 1e-5, "{inner}, η = {eta}, {wo} {wi}: {found} {expected}");
            }
        }
    }
}

/// A coat of the index around it is not there, and where it absorbs it does nothing else; what is black has the reflection of the coat alone.
#[test]
fn limits_of_coats() {
    for inner in [matt(0.7), silver(0.4), of("plastic", ""), of("roughdiffuse", "")] {
        let bare = read(&inner);
        for plugin in ["coating", "roughcoating"] {
            let clear = read(&coat(plugin, 1.0, "", &inner));
            let grey = read(&coat(plugin, 1.0, &float("sigma_a", 0.7), &inner));
            for [wo, wi] in pairs() {
                let expected = value(&bare, wo, wi);
                assert_eq!(value(&clear, wo, wi), expected, "{plugin} over {inner}: {wo} {wi}");
                let kept = (-0.7 * (1.0 / wo.z + 1.0 / wi.z)).exp();
                let off = (value(&grey, wo, wi) - expected * kept).abs().max_element();
                assert!(off < 1e-5 * expected.x * kept + 1e-7, "{plugin} over {inner}: {wo} {wi}: {off}");
            }
        }
    }
    let black = read(&coat("coating", 1.5, "", &matt(0.0)));
    for z in [1.0, 0.7, 0.2, 0.01, -0.5] {
        let wo = direction(z, 0.4);
        assert!(black.eval(wo, Vec3::Z).is_none());
        let s = black.sample(wo, [0.3, 0.6], 0.999).expect("a reflection");
        let expected = fresnel(z.abs().into(), 1.5);
        assert!(s.delta && s.wi == Vec3::new(-wo.x, -wo.y, wo.z), "{s:?}");
        assert!((f64::from(s.weight.0.x) - expected).abs() < 1e-5, "{z}: {} {expected}", s.weight.0.x);
    }
}

/// `plastic` has the light that the coat throws back to the base, and a coat has not: of a white base, all but the share that leaves at first.
#[test]
fn plastic_is_a_coat_with_all_reflections() {
    for eta in [1.3, 1.5, 2.0] {
        // The share of diffuse light from within that leaves, by the mean of Fresnel's reflectance outside.
        let n = 4000;
        let cos = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
        let reflected: f64 = (0..n).map(|i| 2.0 * cos(i) * fresnel(cos(i), eta) / f64::from(n)).sum();
        let leaves = (1.0 - reflected) / (eta * eta);
        for albedo in [0.2, 0.7, 1.0] {
            let coated = read(&coat("coating", eta, "", &matt(albedo)));
            let base = float("diffuse_reflectance", albedo) + "<boolean name='nonlinear' value='true'/>";
            let plastic = read(&coat("plastic", eta, "", &base));
            for [wo, wi] in pairs().take(100) {
                let found = f64::from(value(&plastic, wo, wi).x / value(&coated, wo, wi).x);
                let expected = 1.0 / (1.0 - albedo * (1.0 - leaves));
                assert!((found / expected - 1.0).abs() < 2e-3, "{eta}, {albedo}: {found} {expected}");
            }
        }
    }
}

/// A mirror under a coat is one: by the coat, and by the metal with two refractions; from a number of either the same is chosen again.
#[test]
fn mirrors_under_coats() {
    let mirror = of("conductor", &(float("eta", 0.0) + &float("k", 1.0)));
    let bsdf = read(&coat("coating", 1.5, &float("sigma_a", 0.3), &mirror));
    assert!(bsdf.is_delta());
    for z in [1.0, 0.6, 0.1, -0.3] {
        let wo = direction(z, 0.7);
        let (mut sum, mut values) = (0.0, Vec::new());
        let n = 4096;
        for i in 0..n {
            let lobe = (i as f32 + 0.5) / n as f32;
            let Some(s) = bsdf.sample(wo, [0.3, 0.6], lobe) else { continue };
            assert!(s.delta && s.wi == Vec3::new(-wo.x, -wo.y, wo.z), "{s:?}");
            sum += f64::from(s.weight.0.x) / f64::from(n);
            let again = bsdf.sample(wo, [0.5; 2], bsdf.delta_lobe(wo, lobe, false)).expect("the same");
            assert_eq!((again.weight.0, again.pdf.0), (s.weight.0, s.pdf.0), "{z}: {lobe}");
            values.push(s.weight.0.x * s.pdf.0);
        }
        values.dedup();
        let r = fresnel(z.abs().into(), 1.5);
        let cos = within(wo.with_z(wo.z.abs()), 1.5).z;
        let metal = if z > 0.0 { (1.0 - r).powi(2) * (-0.6 / cos).exp() } else { 0.0 };
        assert!((sum - r - metal).abs() < 2e-3, "{z}: {sum}, not {r} + {metal}");
        assert_eq!(values.len(), if z > 0.0 { 2 } else { 1 }, "{values:?}");
    }
}

/// Smooth normals of a map count for the coat where it lies over it, and for what is under it alone where the map is there.
#[test]
fn maps_over_and_under_coats() {
    for (name, bsdf) in flat_and_tilted() {
        for z in [1.0, 0.6, 0.15] {
            let wo = direction(z, 0.7);
            let what = format!("{name}, cos θₒ = {z}");
            let from_eye = |wi| bsdf.eval(wo, wi).map_or((0.0, 0.0), |(f, pdf)| (pdf.0, f.0.x));
            check_samples(&what, from_eye, |u, lobe| {
                bsdf.sample(wo, u, lobe).filter(|s| !s.delta).map(|s| (s.wi, s.weight.0.x))
            });
            let from_light = |wi: Vec3| {
                let f = bsdf.eval(wi, wo).map_or(0.0, |(f, _)| f.0.x);
                (bsdf.pdf_from_light(wo, wi), f * (wi.z / wo.z).abs())
            };
            check_samples(&format!("{what}, from the light"), from_light, |u, lobe| {
                let s = bsdf.sample_from_light(wo, u, lobe).filter(|s| !s.delta)?;
                Some((s.wi, s.weight.0.x))
            });
        }
    }
    // The reflection of a smooth coat says whose normal it has.
    let picture = "<texture name='normalmap' type='bitmap'><string name='filename' value='bsdf_normalmap.png'/>\
                   <boolean name='raw' value='true'/></texture>";
    let mapped = |inner: &str| of("normalmap", &format!("{picture}{inner}"));
    let reflects = |bsdf: Bsdf| {
        let wo = direction(0.8, 0.4);
        let s = bsdf.sample(wo, [0.3, 0.6], 0.0).expect("a reflection");
        assert!(s.delta, "{s:?}");
        s.wi.distance(Vec3::new(-wo.x, -wo.y, wo.z))
    };
    assert_eq!(reflects(read(&coat("coating", 1.5, "", &mapped(&matt(0.5))))), 0.0);
    assert!(reflects(read(&mapped(&coat("coating", 1.5, "", &matt(0.5))))) > 0.01);
}
