//! Materials, lights and a lens that paths reach from both ends: bidirectional and particle tracing against path tracing.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::support::agreement::{Method, PathReference, Plan};
use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::spectrum::{EmissionMap, Spectrum, dispersion::Ior};
use pointillist::stream::UvWindow;

const PLAN: Plan = Plan { side: 16, paths_per_pixel: 96, seeds: 32, window: UvWindow::PICTURE };

const BOTH: [(Method, f64); 2] = [(Method::Bidirectional, 1e-2), (Method::Particle, 2e-2)];

fn facets(alpha: f32) -> Roughness {
    Roughness { facets: Facets::Ggx, alpha: [alpha; 2] }
}

fn rough_glass(int_ior: Ior) -> BsdfDesc {
    let [specular_reflectance, specular_transmittance] = [1.0; 2].map(|v| Spectrum::Constant(v).into());
    let ext_ior = Ior::Constant(1.0);
    let roughness = facets(0.4);
    BsdfDesc::RoughDielectric(RoughDielectricDesc {
        int_ior,
        ext_ior,
        specular_reflectance,
        specular_transmittance,
        roughness,
        alpha: None,
    })
}

/// A floor and two spheres of these materials, under a lamp and the sky.
fn open_room(materials: [BsdfDesc; 2]) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -4.0, 3.0), DVec3::new(0.0, 4.0, -2.8), 50.0);
    (desc.film.width, desc.film.height) = (16, 16);
    let white = material(&mut desc, grey(0.7));
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(3.0)), white, 0.0);
    for (bsdf, x) in materials.into_iter().zip([-0.9, 0.9]) {
        let bsdf = material(&mut desc, bsdf);
        shape(&mut desc, sphere(DVec3::new(x, 0.1, 0.8), 0.75), DAffine3::IDENTITY, bsdf, 0.0);
    }
    desc
}

fn lit(mut desc: SceneDesc) -> SceneDesc {
    let black = material(&mut desc, grey(0.2));
    let turn = DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.5)) * DAffine3::from_rotation_x(2.8);
    shape(&mut desc, ShapeKind::Rectangle, turn * DAffine3::from_scale(DVec3::splat(0.8)), black, 8.0);
    environment(&mut desc);
    desc
}

fn assert_both(desc: &SceneDesc) {
    let path = PathReference::new(desc, PLAN);
    for (method, within) in BOTH {
        path.assert_mostly(method, 0.99, within);
    }
}

/// A light subpath cannot show the mirror of a coat to the camera: particle tracing lacks it (and is left out), as it lacks
/// everything that is seen by a delta.
#[test]
fn metal_and_plastic() {
    let [eta, k, one] = [0.2, 3.9, 1.0].map(Spectrum::Constant);
    let metal = BsdfDesc::RoughConductor(RoughConductorDesc {
        eta,
        k,
        specular_reflectance: one.clone().into(),
        roughness: facets(0.3),
        alpha: None,
    });
    let plastic = BsdfDesc::Plastic(PlasticDesc {
        int_ior: Ior::Constant(1.49),
        ext_ior: Ior::Constant(1.0),
        diffuse_reflectance: Spectrum::Constant(0.5).into(),
        specular_reflectance: one.into(),
        nonlinear: true,
    });
    let desc = lit(open_room([metal, plastic]));
    PathReference::new(&desc, PLAN).assert_mostly(Method::Bidirectional, 0.99, 1e-2);
}

/// Also glass that disperses: what its facets refract is weighted over wavelengths, the same from either end.
#[test]
fn rough_glasses() {
    let named = Ior::named("sf11").expect("a named glass");
    assert_both(&lit(open_room([rough_glass(Ior::Constant(1.5)), rough_glass(named)])));
}

/// A sun in a sky that is dim and blue, turned.
#[test]
fn a_map_all_around() {
    let mut desc = open_room([grey(0.6), grey(0.3)]);
    let mut texels = vec![[0.1, 0.2, 0.4]; 16 * 8];
    texels[2 * 16 + 5] = [40.0, 35.0, 25.0];
    let map = Arc::new(EmissionMap::new(16, &texels).expect("texels"));
    let to_world = DAffine3::from_rotation_x(1.2) * DAffine3::from_rotation_y(0.7);
    let (scale, place) = (Spectrum::Constant(1.0), Place::default());
    desc.lights.push(LightDesc::Map { map, scale, to_world, place });
    assert_both(&desc);
}

/// Every path has one point of the lens, however it was found.
#[test]
fn a_lens() {
    let mut desc = lit(open_room([grey(0.6), grey(0.3)]));
    desc.camera.perspective_mut().unwrap().lens = LensDesc::round(0.4, 3.0);
    assert_both(&desc);
}
