//! All methods agree on meshes whose shading normals differ much from their faces, and on anisotropic materials that follow texture
//! coordinates.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec2, Vec3};

use crate::pairs::{PHOTONS, PLAN, assert_all_pairs};
use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::spectrum::{Spectrum, dispersion::Ior};

/// A sphere of 20 triangles: vertex normals are up to 37° from the faces' own.
fn icosahedron() -> Mesh {
    let g = 0.5 * (1.0 + 5f32.sqrt());
    let mut positions = Vec::new();
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        positions
            .extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)].map(Vec3::normalize));
    }
    let edge = 2.0 / (g * 5f32.sqrt()).sqrt();
    let near = |i: usize, j: usize| (positions[i].distance(positions[j]) - edge).abs() < 1e-3;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(i, k) {
                    let [a, b, c] = [i, j, k].map(|v| positions[v]);
                    let outwards = (b - a).cross(c - a).dot(a) > 0.0;
                    triangles.push(if outwards { [i, j, k] } else { [i, k, j] }.map(|v| v as u32));
                }
            }
        }
    }
    assert_eq!(triangles.len(), 20);
    let uvs = positions.iter().map(|p| Vec2::new(p.y.atan2(p.x), p.z)).collect();
    Mesh { normals: positions.clone(), positions, uvs, triangles, ..Mesh::default() }
}

/// Two such spheres on a floor, under a lamp and the sky.
fn room(materials: [BsdfDesc; 2]) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -4.0, 3.0), DVec3::new(0.0, 4.0, -2.8), 50.0);
    (desc.film.width, desc.film.height) = (8, 8);
    let white = material(&mut desc, grey(0.7));
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(3.0)), white, 0.0);
    desc.meshes.push(Arc::new(icosahedron()));
    for (bsdf, x) in materials.into_iter().zip([-0.9, 0.9]) {
        let bsdf = material(&mut desc, bsdf);
        let place =
            DAffine3::from_translation(DVec3::new(x, 0.1, 0.8)) * DAffine3::from_scale(DVec3::splat(0.85));
        shape(&mut desc, ShapeKind::Mesh(MeshId(0)), place, bsdf, 0.0);
    }
    let turn = DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.5)) * DAffine3::from_rotation_x(2.8);
    shape(&mut desc, ShapeKind::Rectangle, turn * DAffine3::from_scale(DVec3::splat(0.8)), white, 8.0);
    environment(&mut desc);
    desc
}

fn one() -> Spectrum {
    Spectrum::Constant(1.0)
}

fn facets(alpha: [f32; 2]) -> Roughness {
    Roughness { facets: Facets::Ggx, alpha }
}

fn metal(alpha: [f32; 2]) -> BsdfDesc {
    let [eta, k] = [0.2, 3.9].map(Spectrum::Constant);
    BsdfDesc::RoughConductor(RoughConductorDesc {
        eta,
        k,
        specular_reflectance: one().into(),
        roughness: facets(alpha),
        alpha: None,
    })
}

fn rough_glass(alpha: [f32; 2]) -> BsdfDesc {
    let [int_ior, ext_ior] = [1.5, 1.0].map(Ior::Constant);
    let [specular_reflectance, specular_transmittance] = [one().into(), one().into()];
    BsdfDesc::RoughDielectric(RoughDielectricDesc {
        int_ior,
        ext_ior,
        specular_reflectance,
        specular_transmittance,
        roughness: facets(alpha),
        alpha: None,
    })
}

fn rough_plastic(alpha: f32) -> BsdfDesc {
    let [int_ior, ext_ior] = [1.49, 1.0].map(Ior::Constant);
    let diffuse_reflectance = Spectrum::Constant(0.5).into();
    let roughness = facets([alpha; 2]);
    let (specular_reflectance, nonlinear) = (one().into(), true);
    BsdfDesc::RoughPlastic(RoughPlasticDesc {
        int_ior,
        ext_ior,
        diffuse_reflectance,
        specular_reflectance,
        nonlinear,
        roughness,
    })
}

#[test]
fn shading_normals_on_diffuse_and_metal() {
    assert_all_pairs("diffuse and metal", &room([grey(0.8), metal([0.3; 2])]), PLAN, PHOTONS);
}

#[test]
fn shading_normals_on_glass_and_plastic() {
    assert_all_pairs("glass and plastic", &room([rough_glass([0.4; 2]), rough_plastic(0.3)]), PLAN, PHOTONS);
}

#[test]
fn brushed() {
    assert_all_pairs("brushed", &room([metal([0.15, 0.5]), rough_glass([0.6, 0.3])]), PLAN, PHOTONS);
}
