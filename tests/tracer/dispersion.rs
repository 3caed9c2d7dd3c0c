//! Dispersion: rough and smooth glass at four wavelengths, all methods against each other, and its limits.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3, Vec4};

use crate::support::agreement::{Method, PathReference, Plan};
use crate::support::scenes::*;
use pointillist::color::Xyz;
use pointillist::scene::desc::*;
use pointillist::spectrum::{SampledSpectrum, Spectrum, dispersion::Ior};
use pointillist::stream::{PathCounts, SampleSink, UvWindow};
use pointillist::tracer::bsdf::{Bsdf, Dielectric, Microfacet, RoughDielectric, ScatteringModel};
use pointillist::tracer::integrator::{BidirectionalTracer, RenderContext};
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

const PLAN: Plan = Plan { side: 16, paths_per_pixel: 96, seeds: 32, window: UvWindow::PICTURE };

const ETA: [f32; 4] = [1.50, 1.53, 1.57, 1.62];

fn glass_at(eta: [f32; 4], alpha: f32) -> Bsdf {
    let one = SampledSpectrum::ONE;
    let microfacet = Microfacet::new(Roughness { facets: Facets::Ggx, alpha: [alpha; 2] });
    let eta = [SampledSpectrum(Vec4::from_array(eta)), one];
    let smooth = Dielectric::new(eta, [one, one]);
    Bsdf::RoughDielectric(RoughDielectric::new(smooth, &microfacet).expect("glass"))
}

fn turned(eta: [f32; 4], by: usize) -> [f32; 4] {
    std::array::from_fn(|i| eta[(i + by) % 4])
}

fn direction(z: f32, phi: f32) -> Vec3 {
    let r = (1.0 - z * z).sqrt();
    Vec3::new(r * phi.cos(), r * phi.sin(), z)
}

/// Over the heroes, each lane's value with its weight is the value of glass of that index alone: light that a light
/// source brings is neither lost nor counted twice. The weights are the same from both ends.
#[test]
fn values_over_all_heroes_are_those_of_each_wavelength() {
    for alpha in [0.02, 0.1, 0.5] {
        let mut compared = 0;
        for (z, w) in [(0.8, 0.9), (0.95, 0.6), (-0.85, 0.7), (-0.9, 0.95), (0.3, 0.9)] {
            for phi in [3.0, 3.12, 2.5] {
                let (wo, wi) = (direction(z, 0.0), direction(-w * f32::signum(z), phi));
                let mut sum = [0.0; 4];
                for hero in 0..4 {
                    let bsdf = glass_at(turned(ETA, hero), alpha);
                    let [here, back] =
                        [(wo, wi), (wi, wo)].map(|(a, b)| bsdf.dispersion(a, b).wavelength_mis.weight());
                    assert!((here / back - 1.0).abs() < 1e-3, "{here} {back}");
                    let Some((value, _)) = bsdf.eval(wo, wi) else { continue };
                    for lane in 0..4 {
                        sum[(lane + hero) % 4] += 0.25 * value.0[lane] * here;
                    }
                }
                for lane in 0..4 {
                    let alone = glass_at([ETA[lane]; 4], alpha).eval(wo, wi).map_or(0.0, |(v, _)| v.0.x);
                    assert!(
                        (sum[lane] - alone).abs() <= 2e-3 * alone + 1e-6,
                        "{alpha} {z} {w}: {sum:?} {alone}"
                    );
                    compared += usize::from(alone > 1e-3);
                }
            }
        }
        assert!(compared > 12, "{alpha}: {compared}");
    }
}

/// Samples with their weights over densities: weight · density is the value, for all lanes, and no lane of a sample counts
/// more than the four that it stands for.
#[test]
fn samples_are_the_values() {
    let mut random = Random(5);
    for alpha in [1e-4, 0.02, 0.3] {
        let mut parted = 0;
        for i in 0..20_000 {
            let bsdf = glass_at(turned(ETA, i % 4), alpha);
            let wo = direction(random.f32() * 2.0 - 1.0, 0.3);
            let Some(s) = bsdf.sample(wo, [random.f32(), random.f32()], random.f32()) else { continue };
            assert!(!s.hero_only && s.weight.is_finite());
            let counts = bsdf.dispersion(wo, s.wi).wavelength_mis.weight();
            assert!((1.0..=4.0).contains(&counts), "{counts}");
            parted += usize::from(s.transmitted && counts > 1.01);
            // Four times what the hero counts alone: 4 at most, where all others are totally reflected.
            assert!((s.weight.0 * counts * s.eta2).max_element() < 16.1, "{:?} {counts}", s.weight);
            if alpha < 0.01 {
                continue;
            }
            let (value, pdf) = bsdf.eval(wo, s.wi).expect("it was sampled");
            let off = (value.0 / pdf.0 - s.weight.0).abs().max_element();
            assert!(off < 0.01 * s.weight.max_element().max(0.1), "{alpha}: {value:?} {pdf:?} {s:?}");
        }
        assert!(parted > 5_000, "{alpha}: {parted}");
    }
}

fn rough(int_ior: Ior, alpha: f32) -> BsdfDesc {
    let [specular_reflectance, specular_transmittance] = [1.0; 2].map(|v| Spectrum::Constant(v).into());
    let ext_ior = Ior::Constant(1.0);
    let roughness = Roughness { facets: Facets::Ggx, alpha: [alpha; 2] };
    BsdfDesc::RoughDielectric(RoughDielectricDesc {
        int_ior,
        ext_ior,
        specular_reflectance,
        specular_transmittance,
        roughness,
        alpha: None,
    })
}

/// A floor and two spheres of these materials under a lamp, with the sky.
fn room(materials: [BsdfDesc; 2]) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -4.0, 3.0), DVec3::new(0.0, 4.0, -2.8), 50.0);
    (desc.film.width, desc.film.height) = (16, 16);
    let white = material(&mut desc, grey(0.7));
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(3.0)), white, 0.0);
    for (bsdf, x) in materials.into_iter().zip([-0.9, 0.9]) {
        let bsdf = material(&mut desc, bsdf);
        shape(&mut desc, sphere(DVec3::new(x, 0.1, 0.8), 0.75), DAffine3::IDENTITY, bsdf, 0.0);
    }
    let turn = DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.5)) * DAffine3::from_rotation_x(PI * 0.9);
    shape(&mut desc, ShapeKind::Rectangle, turn * DAffine3::from_scale(DVec3::splat(0.8)), white, 8.0);
    environment(&mut desc);
    desc
}

/// Strong dispersion (Abbe number 8), so that a wrong weight would show.
fn strong() -> Ior {
    Ior::cauchy(1.45, 0.03)
}

/// Rough glass alone, nearly smooth glass, and rough next to smooth: paths split by dispersion at both kinds, in either order.
#[test]
fn all_methods_agree() {
    let black = || BsdfDesc::Diffuse(DiffuseDesc { reflectance: Spectrum::Constant(0.1).into() });
    let mut floor = room([black(), glass(strong())]);
    floor.camera = look(DVec3::new(0.9, -2.2, 0.6), DVec3::new(0.0, 0.7, -0.6), 30.0);
    floor.lights.clear();
    for (name, desc, seen_by_particles) in [
        ("rough", room([rough(strong(), 0.4), rough(strong(), 0.15)]), true),
        ("rough beside smooth", room([rough(strong(), 0.3), glass(strong())]), false),
        ("floor beside smooth glass", floor, true),
    ] {
        println!("{name}");
        let path = PathReference::new(&desc, PLAN);
        for method in [Method::Bidirectional, Method::Particle] {
            if method == Method::Particle && !seen_by_particles {
                continue;
            }
            let test = path.compare(method);
            let off = (test.mean_ratio - 1.0).abs();
            assert!(test.accepted >= 0.985 && test.mean_z2 < 2.0, "{name}, {method:?}: {test:?}");
            // Particles show smooth facets of glass seldom and strongly.
            let within = if method == Method::Particle { 4e-2 } else { 1e-2 };
            assert!(off <= 4.0 * test.mean_ratio_error && off <= within, "{name}, {method:?}: {test:?}");
        }
    }
}

/// Mean XYZ of a picture by `paths` paths of each seed, and its standard errors.
fn mean_xyz(desc: &SceneDesc, method: Method, seeds: Range<u32>, paths: u64) -> [[f64; 3]; 2] {
    // Also where nothing has a colour paths are to carry wavelengths here.
    let scene = Arc::new(Scene::prepare_general(desc).expect("valid"));
    let camera = Camera::of(desc).expect("valid");
    let window = UvWindow::PICTURE;
    let picture = |seed| {
        let mut sum = Sum::default();
        let context = RenderContext::new(scene.clone(), camera.clone(), &desc.integrator, seed, window);
        let path = PathTracer { context: context.clone() };
        let both = BidirectionalTracer { context };
        let (mut scratch, PathCounts { camera, light }) = (Default::default(), both.paths_per_index());
        let n = paths as f64;
        if method == Method::Path {
            (0..paths).for_each(|i| path.trace(i, &mut (), &mut sum));
        } else {
            (0..paths / camera).for_each(|i| both.trace(i, &mut scratch, &mut sum));
        }
        // A light path stands for so many camera paths.
        let share = camera as f64 / light as f64;
        [0, 1, 2].map(|k| (sum.camera[k] + share * sum.light[k]) / n)
    };
    let pictures: Vec<_> = seeds.map(picture).collect();
    let r = pictures.len() as f64;
    let mean = [0, 1, 2].map(|k| pictures.iter().map(|p| p[k]).sum::<f64>() / r);
    let error = [0, 1, 2].map(|k| {
        let squares = pictures.iter().map(|p| (p[k] - mean[k]).powi(2)).sum::<f64>();
        (squares / (r - 1.0) / r).sqrt()
    });
    [mean, error]
}

#[derive(Default)]
struct Sum {
    camera: [f64; 3],
    light: [f64; 3],
}

fn add(sum: &mut [f64; 3], value: Xyz) {
    for (s, v) in sum.iter_mut().zip([value.x, value.y, value.z]) {
        *s += f64::from(v);
    }
}

impl SampleSink for Sum {
    fn camera(&mut self, _: [f32; 2], value: Xyz, _: f32) {
        add(&mut self.camera, value);
    }
    fn light(&mut self, _: [f32; 2], value: Xyz) {
        add(&mut self.light, value);
    }
}

/// CIE 1976 L*a*b* relative to equal energy.
fn lab([x, y, z]: [f64; 3]) -> [f64; 3] {
    let f = |t: f64| if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 };
    let [x, y, z] = [x, y, z].map(f);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Glass with almost no dispersion looks like glass with none: the XYZ agree, and the colour difference is invisible, although smooth
/// glass still follows each wavelength on its own. With equal indices no path splits, and the picture is the same to the bit.
#[test]
fn neutral_glass_stays_neutral() {
    type Make = fn(Ior) -> BsdfDesc;
    let makes: [(&str, Make); 2] = [("smooth", glass), ("rough", |ior| rough(ior, 0.2))];
    for (name, make) in makes {
        let mut desc = room([make(Ior::Constant(1.5)), make(Ior::Constant(1.5))]);
        // Under the sky alone: little noise.
        desc.shapes.pop();
        let with = |ior: Ior| {
            let mut other = desc.clone();
            other.bsdfs[1..3].fill(make(ior));
            other
        };
        for method in [Method::Path, Method::Bidirectional] {
            // From both ends only the hero goes on where colours part: more noise to average.
            let single = method == Method::Path || name == "rough";
            let paths = if single { 1 << 15 } else { 1 << 17 };
            let [neutral, error] = mean_xyz(&desc, method, 0..16, 1 << 15);
            let [other, other_error] = mean_xyz(&with(Ior::cauchy(1.5, 1e-5)), method, 50..66, paths);
            let z = [0, 1, 2].map(|k| (neutral[k] - other[k]) / error[k].hypot(other_error[k]));
            let [a, b] = [neutral, other].map(|v| lab(v.map(|c| c / neutral[1])));
            let delta = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            println!(
                "{name} {method:?}: {neutral:.4?} ± {error:.5?}, {other:.4?} ± {other_error:.5?}, {z:.2?}, ΔE {delta:.3}"
            );
            assert!(z.iter().all(|z| z.abs() < 4.0), "{name} {method:?}: {z:?}");
            assert!(delta < 0.1, "{name} {method:?}: ΔE {delta}");
            // Far below the precision of directions.
            let [same, _] = mean_xyz(&with(Ior::Cauchy { a: 1.5, b: 1e-10 }), method, 0..1, 1 << 10);
            let [constant, _] = mean_xyz(&desc, method, 0..1, 1 << 10);
            assert_eq!(same, constant, "{name} {method:?}");
        }
    }
}
