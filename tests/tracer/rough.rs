//! Rough and mixed materials in the path tracer: both ways of finding a light must add up to one. What is lost between facets
//! is in `furnace.rs`.

use glam::{DAffine3, DVec3};

use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::spectrum::{Spectrum, dispersion::Ior};

fn one() -> Spectrum {
    Spectrum::Constant(1.0)
}

fn roughness(facets: Facets, alpha: f32) -> Roughness {
    Roughness { facets, alpha: [alpha; 2] }
}

fn silver(facets: Facets, alpha: f32) -> BsdfDesc {
    let (eta, k) = (Spectrum::Constant(0.0), one());
    BsdfDesc::RoughConductor(RoughConductorDesc {
        eta,
        k,
        specular_reflectance: one().into(),
        roughness: roughness(facets, alpha),
        alpha: None,
    })
}

fn rough_glass(int_ior: Ior, alpha: f32) -> BsdfDesc {
    BsdfDesc::RoughDielectric(RoughDielectricDesc {
        int_ior,
        ext_ior: Ior::Constant(1.0),
        specular_reflectance: one().into(),
        specular_transmittance: one().into(),
        roughness: roughness(Facets::Ggx, alpha),
        alpha: None,
    })
}

fn plastic(int_ior: Ior, albedo: f32) -> BsdfDesc {
    BsdfDesc::Plastic(PlasticDesc {
        int_ior,
        ext_ior: Ior::Constant(1.0),
        diffuse_reflectance: Spectrum::Constant(albedo).into(),
        specular_reflectance: one().into(),
        nonlinear: true,
    })
}

/// A ball of a material, lit by radiance 1 from everywhere: by the environment, or by a sphere around all of it.
fn furnace(bsdf: BsdfDesc, enclosed: bool) -> SceneDesc {
    let mut desc = empty();
    desc.camera.perspective_mut().unwrap().fov = 10.0;
    let m = material(&mut desc, bsdf);
    shape(&mut desc, sphere(DVec3::new(0.0, 0.0, 3.0), 1.0), DAffine3::IDENTITY, m, 0.0);
    if enclosed {
        let black = material(&mut desc, grey(0.0));
        shape(&mut desc, sphere(DVec3::new(0.1, 0.2, 3.0), 6.0), DAffine3::IDENTITY, black, 1.0);
        desc.shapes[1].flip_normals = true;
    } else {
        environment(&mut desc);
    }
    desc
}

/// The same light found in two ways is the same light: an environment, and a sphere around the scene.
#[test]
fn environment_and_enclosing_light_agree() {
    for (name, bsdf) in [
        ("metal", silver(Facets::Beckmann, 0.7)),
        ("glass", rough_glass(Ior::Constant(1.5), 0.4)),
        ("dispersive glass", rough_glass(Ior::cauchy(1.4, 0.04), 0.4)),
        ("plastic", plastic(Ior::Constant(1.49), 0.4)),
    ] {
        let [(a, ea), (b, eb)] = [false, true].map(|e| mean(&furnace(bsdf.clone(), e), 1 << 17));
        let error = ea.hypot(eb);
        assert!((a - b).abs() < 4.0 * error + 1e-4, "{name}: {a} ± {ea}, {b} ± {eb}");
        assert!(a < 1.0 && a > 0.2, "{name}: {a}");
    }
}
