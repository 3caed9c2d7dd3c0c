//! All methods agree on materials, lights and a lens that paths reach from both ends.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::pairs::{PHOTONS, PLAN, assert_all_pairs};
use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::spectrum::{EmissionMap, Spectrum};

/// A floor and two spheres of these materials.
fn open_room(materials: [BsdfDesc; 2]) -> SceneDesc {
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, -4.0, 3.0), DVec3::new(0.0, 4.0, -2.8), 50.0);
    (desc.film.width, desc.film.height) = (8, 8);
    let white = material(&mut desc, grey(0.7));
    shape(&mut desc, ShapeKind::Rectangle, DAffine3::from_scale(DVec3::splat(3.0)), white, 0.0);
    for (bsdf, x) in materials.into_iter().zip([-0.9, 0.9]) {
        let bsdf = material(&mut desc, bsdf);
        shape(&mut desc, sphere(DVec3::new(x, 0.1, 0.8), 0.75), DAffine3::IDENTITY, bsdf, 0.0);
    }
    desc
}

/// With a lamp and the sky.
fn lit(mut desc: SceneDesc) -> SceneDesc {
    let black = material(&mut desc, grey(0.2));
    let turn = DAffine3::from_translation(DVec3::new(0.0, 0.0, 3.5)) * DAffine3::from_rotation_x(2.8);
    shape(&mut desc, ShapeKind::Rectangle, turn * DAffine3::from_scale(DVec3::splat(0.8)), black, 8.0);
    environment(&mut desc);
    desc
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
    assert_all_pairs("map", &desc, PLAN, PHOTONS);
}

#[test]
fn a_lens() {
    let mut desc = lit(open_room([grey(0.6), grey(0.3)]));
    (desc.camera.aperture_radius, desc.camera.focus_distance) = (0.4, 3.0);
    assert_all_pairs("lens", &desc, PLAN, PHOTONS);
}
