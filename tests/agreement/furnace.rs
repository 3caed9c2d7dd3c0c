//! White furnaces: every method renders objects that radiance 1 lights from everywhere.
//!
//! A material without loss shows exactly 1. Single-scattering microfacets lose the light that would meet a second facet. The loss
//! follows from the material alone: it is the mean throughput of a random walk until it leaves the scene, without lights, roulette or
//! multiple importance sampling. Every method must agree with that number within noise.

use glam::{DAffine3, DVec3, Vec4};

use crate::support::agreement::{Method, Plan, repeat};
use crate::support::bsdfs::{self, BSDFS};
use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::spectrum::{SampledSpectrum, SampledWavelengths, Spectrum, dispersion::Ior};
use pointillist::stream::UvWindow;
use pointillist::tracer::Camera;
use pointillist::tracer::bsdf::{Bsdf, ScatteringModel};

const PLAN: Plan = Plan { side: 4, paths_per_pixel: 256, seeds: 16, window: UvWindow::PICTURE };

fn one() -> Spectrum {
    Spectrum::Constant(1.0)
}

fn facets(facets: Facets, alpha: f32) -> Roughness {
    Roughness { facets, alpha: [alpha; 2] }
}

/// Reflects everything.
fn silver(roughness: Roughness) -> BsdfDesc {
    let eta = Spectrum::Constant(0.0);
    BsdfDesc::RoughConductor(RoughConductorDesc {
        eta,
        k: one(),
        specular_reflectance: one().into(),
        roughness,
        alpha: None,
    })
}

fn rough_glass(int_ior: Ior, roughness: Roughness) -> BsdfDesc {
    let [specular_reflectance, specular_transmittance] = [one().into(), one().into()];
    let ext_ior = Ior::Constant(1.0);
    BsdfDesc::RoughDielectric(RoughDielectricDesc {
        int_ior,
        ext_ior,
        specular_reflectance,
        specular_transmittance,
        roughness,
        alpha: None,
    })
}

fn plastic(int_ior: Ior) -> BsdfDesc {
    let [diffuse_reflectance, specular_reflectance] = [one().into(), one().into()];
    let (ext_ior, nonlinear) = (Ior::Constant(1.0), true);
    BsdfDesc::Plastic(PlasticDesc { int_ior, ext_ior, diffuse_reflectance, specular_reflectance, nonlinear })
}

fn rough_plastic(roughness: Roughness) -> BsdfDesc {
    let [diffuse_reflectance, specular_reflectance] = [one().into(), one().into()];
    let [int_ior, ext_ior] = [1.49, 1.0].map(Ior::Constant);
    BsdfDesc::RoughPlastic(RoughPlasticDesc {
        int_ior,
        ext_ior,
        diffuse_reflectance,
        specular_reflectance,
        nonlinear: true,
        roughness,
    })
}

/// Materials of [`furnace`] that others can be made of: white on both sides, and none.
const WHITE: BsdfId = BsdfId(1);
const NOTHING: BsdfId = BsdfId(2);

/// A ball of a material that fills the picture, lit by radiance 1 from everywhere: by the environment, or by a sphere around
/// all of it.
fn furnace(bsdf: BsdfDesc, enclosed: bool) -> SceneDesc {
    let mut desc = empty();
    desc.camera.perspective_mut().unwrap().fov = 20.0;
    let white = material(&mut desc, grey(1.0));
    assert_eq!(material(&mut desc, TwoSidedDesc { front: white, back: white }.into()), WHITE);
    assert_eq!(material(&mut desc, NullDesc.into()), NOTHING);
    let m = material(&mut desc, bsdf);
    shape(&mut desc, sphere(DVec3::new(0.0, 0.0, 3.0), 1.0), DAffine3::IDENTITY, m, 0.0);
    if enclosed {
        let black = material(&mut desc, grey(0.0));
        shape(&mut desc, sphere(DVec3::new(0.1, 0.2, 3.0), 3.3), DAffine3::IDENTITY, black, 1.0);
        desc.shapes[1].flip_normals = true;
    } else {
        environment(&mut desc);
    }
    desc
}

/// Mean luminance of walks that leave the scene, in a uniform environment, with its standard error.
fn expected(desc: &SceneDesc, paths: u32) -> (f64, f64) {
    let scene = prepare(desc);
    let camera = Camera::of(desc).expect("the camera is valid");
    let mut random = Random(17);
    let mut one = |_| {
        // One wavelength alone: materials treat it as they would light of one colour.
        let lambda = SampledWavelengths::sample(random.f32());
        let alone = lambda.alone(0);
        let mut throughput = SampledSpectrum::ONE;
        let mut ray = camera.ray([random.f64(), random.f64()], [0.5; 2]).unwrap();
        // Throughput of what loses nothing does not fall: a walk ends by leaving.
        for _ in 0..10_000 {
            let Some(hit) = scene.closest(&ray) else {
                return f64::from(lambda.to_xyz(SampledSpectrum(throughput.0 * Vec4::X * 4.0)).y);
            };
            let surface = scene.surface_material(&hit);
            let numbers = [random.f32(), random.f32()];
            let Some(s) =
                surface.bsdf::<Bsdf>(&alone).sample(surface.frame.to_local(hit.wo), numbers, random.f32())
            else {
                return 0.0;
            };
            throughput *= s.weight;
            ray = hit.spawn(surface.frame.to_world(s.wi));
        }
        0.0
    };
    let values: Vec<f64> = (0..paths).map(&mut one).collect();
    moments(&values)
}

/// Mean and its standard error.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt())
}

/// With `lossless`, the random walk must give 1 too.
fn check(name: &str, bsdf: BsdfDesc, methods: &[Method], lossless: bool) {
    let (wanted, wanted_error) = expected(&furnace(bsdf.clone(), false), 1 << 17);
    println!("{name}: expected {wanted:.5} ± {wanted_error:.5}");
    if lossless {
        assert!((wanted - 1.0).abs() < 4.0 * wanted_error + 1e-3, "{name}: {wanted} ± {wanted_error}");
    }
    assert!(wanted < 1.0 + 4.0 * wanted_error + 1e-4, "{name} makes light: {wanted} ± {wanted_error}");
    for enclosed in [false, true] {
        for &method in methods {
            // Few light paths end in a narrow view. In an even sky they take weight from camera paths, which have no noise there.
            let (more, noise) = match method {
                Method::Particle => (8, 0.05),
                Method::Bidirectional => (8, 2e-3),
                _ => (1, 2e-3),
            };
            let plan = Plan { paths_per_pixel: more * PLAN.paths_per_pixel, ..PLAN };
            let pictures = repeat(&furnace(bsdf.clone(), enclosed), method, plan);
            let means: Vec<f64> = pictures.iter().map(|p| p.iter().sum::<f64>() / p.len() as f64).collect();
            let (mean, error) = moments(&means);
            let what =
                format!("{name}, enclosed {enclosed}, {method:?}: {mean:.5} ± {error:.5} for {wanted:.5}");
            println!("{what}");
            // Student's t with at least 15 degrees of freedom exceeds 5 once in 6000 times.
            assert!((mean - wanted).abs() < 5.0 * error.hypot(wanted_error) + 1e-4, "{what}");
            assert!(error < noise, "{what}: too much noise to tell");
        }
    }
}

const ALL: [Method; 3] = [Method::Path, Method::Particle, Method::Bidirectional];

/// Light subpaths do not show what a delta, or nearly one, shows to the camera.
const FROM_CAMERA: [Method; 2] = [Method::Path, Method::Bidirectional];

#[test]
fn diffuse_and_metal() {
    check("diffuse", grey(1.0), &ALL, true);
    check("silver 1e-3", silver(facets(Facets::Beckmann, 1e-3)), &FROM_CAMERA, true);
    check("silver 0.2", silver(facets(Facets::Ggx, 0.2)), &ALL, false);
    check("silver 0.5, Beckmann", silver(facets(Facets::Beckmann, 0.5)), &ALL, false);
}

#[test]
fn glasses() {
    let bk7 = Ior::named("bk7").expect("a named glass");
    check("glass", glass(Ior::Constant(1.5)), &FROM_CAMERA, true);
    check(
        "rough glass 1e-3",
        rough_glass(Ior::Constant(1.5), facets(Facets::Ggx, 1e-3)),
        &[Method::Path],
        false,
    );
    check("rough glass 0.1", rough_glass(Ior::Constant(1.5), facets(Facets::Ggx, 0.1)), &FROM_CAMERA, false);
    check("rough glass 0.7", rough_glass(Ior::Constant(1.5), facets(Facets::Beckmann, 0.7)), &ALL, false);
    check("dispersive rough glass", rough_glass(bk7, facets(Facets::Ggx, 0.3)), &FROM_CAMERA, false);
    check("strongly dispersive", rough_glass(Ior::cauchy(1.4, 0.04), facets(Facets::Ggx, 0.6)), &ALL, false);
}

#[test]
fn plastics() {
    check("plastic", plastic(Ior::Constant(1.49)), &FROM_CAMERA, true);
    check("dispersive plastic", plastic(Ior::named("bk7").expect("a named glass")), &FROM_CAMERA, true);
    check("rough plastic 0.1", rough_plastic(facets(Facets::Ggx, 0.1)), &FROM_CAMERA, false);
    check("rough plastic 0.4", rough_plastic(facets(Facets::Beckmann, 0.4)), &ALL, false);
}

/// Everything that mirrors nothing away is a closed room for light: these lose nothing at all.
#[test]
fn surfaces_that_light_passes_straight() {
    let [specular_reflectance, specular_transmittance] = [one().into(), one().into()];
    let [int_ior, ext_ior] = [1.7, 1.0].map(Ior::Constant);
    let pane = ThinDielectricDesc { int_ior, ext_ior, specular_reflectance, specular_transmittance };
    check("pane", pane.into(), &FROM_CAMERA, true);
}

/// A ball of which two thirds are there reflects inside and outside, and loses nothing.
#[test]
fn surfaces_with_holes() {
    check("nothing", NullDesc.into(), &ALL, true);
    let (bsdf, opacity) = (WHITE, Spectrum::Constant(0.67).into());
    check("white with holes", MaskDesc { bsdf, opacity }.into(), &ALL, true);
    let weight = Spectrum::Constant(0.4).into();
    check("white and nothing", BlendDesc { weight, bsdfs: [WHITE, NOTHING] }.into(), &ALL, true);
}

/// A metal of this base colour is a rough conductor that reflects everything; a leaf keeps what it does not scatter with its facets.
#[test]
fn principled() {
    let lobes = PrincipledLobes {
        roughness: 0.5,
        anisotropic: 0.0,
        metallic: 1.0,
        eta: 1.5,
        spec_tint: 0.0,
        sheen: 0.0,
        sheen_tint: 0.0,
        flatness: 0.0,
        clearcoat: 0.0,
        clearcoat_gloss: 0.0,
    };
    let of = |spec_trans, lobes| PrincipledDesc {
        base_color: one().into(),
        spec_trans: Spectrum::Constant(spec_trans).into(),
        lobes,
        textures: Vec::new(),
        thin_film: None,
    };
    check("principled metal", of(0.0, lobes).into(), &ALL, false);
    check(
        "principled glass",
        of(1.0, PrincipledLobes { metallic: 0.0, ..lobes }).into(),
        &FROM_CAMERA,
        false,
    );
    let grey = Spectrum::Constant(0.7);
    let satin = PrincipledLobes { metallic: 0.3, clearcoat: 0.5, ..lobes };
    check(
        "principled satin",
        PrincipledDesc { base_color: grey.into(), ..of(0.3, satin) }.into(),
        &ALL,
        false,
    );
    let leaf = PrincipledThinDesc {
        base_color: Spectrum::Constant(0.8).into(),
        transmittance: one().into(),
        spec_trans: Spectrum::Constant(0.5).into(),
        diff_trans: Spectrum::Constant(1.0).into(),
        lobes: PrincipledLobes { metallic: 0.0, ..lobes },
        textures: Vec::new(),
    };
    check("leaf", leaf.into(), &ALL, false);
}

/// A white sheet that light passes loses nothing; the lobes and cavities lose what goes below the horizon.
#[test]
fn models_of_version_0_6() {
    check("sheet", DiffuseTransmitterDesc { transmittance: one().into() }.into(), &ALL, true);
    let matt = RoughDiffuseDesc {
        reflectance: Spectrum::Constant(0.9).into(),
        alpha: Spectrum::Constant(0.5).into(),
        use_fast_approx: false,
    };
    check("rough diffuse", matt.into(), &ALL, false);
    let [specular_reflectance, diffuse_reflectance] = [0.6, 0.4].map(|v| Spectrum::Constant(v).into());
    let ward = WardDesc {
        variant: WardVariant::Balanced,
        specular_reflectance,
        diffuse_reflectance,
        roughness: facets(Facets::Beckmann, 0.3),
        alpha: None,
    };
    check("ward", ward.into(), &ALL, false);
    let [specular_reflectance, diffuse_reflectance] = [0.6, 0.4].map(|v| Spectrum::Constant(v).into());
    let exponent = Spectrum::Constant(20.0).into();
    check("phong", PhongDesc { exponent, specular_reflectance, diffuse_reflectance }.into(), &ALL, false);
    let parts = vec![(WHITE, 0.5), (NOTHING, 0.2), (WHITE, 0.3)];
    check("whites and nothing", MixtureDesc { parts }.into(), &ALL, true);
}

/// Every plugin, as white as it can be: it makes no light, and paths from one end and from both agree about what it loses.
#[test]
fn every_plugin() {
    for entry in BSDFS {
        let bsdf = bsdfs::desc(&entry.uniform(1.0, 0.5, 0.4));
        check(&format!("{}, listed", entry.plugin), bsdf, &FROM_CAMERA, false);
    }
}
