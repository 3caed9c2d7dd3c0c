//! Coarse meshes with smooth normals: light that the smooth surface would get and its facets do not.
//!
//! Light from directions that only one of both normals sees is dropped, from both ends of a path, which makes a facet dark where it faces
//! away from a light that its smooth normal still faces. Methods that take this darkness away give light to facets that no light path meets
//! (Hanika, *Hacking the Shadow Terminator*, Ray Tracing Gems II, 2021), so that methods with light paths show something else; or they make
//! what is next to it darker (Chiang, Li and Burley, *Taming the Shadow Terminator*, SIGGRAPH 2019 Talks). The rows show what both would cost.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};

use pointillist::math::frame::Frame;
use pointillist::math::warp;
use pointillist::scene::desc::{LightDesc, Mesh, MeshId, Place, SceneDesc, ShapeKind};
use pointillist::spectrum::Spectrum;
use pointillist::stream::UvWindow;
use pointillist::tracer::Camera;
use pointillist::tracer::interaction::SurfaceInteraction;

use crate::Row;
use crate::support::accel::icosphere;
use crate::support::agreement::{Method, Plan, repeat};
use crate::support::scenes::{empty, environment, grey, look, material, mean, prepare, shape};
use crate::support::welch;

const ALBEDO: f32 = 0.8;

/// An icosahedron with the normals of the sphere around it, up to 37° from those of its faces, which fills this field of view in degrees.
fn icosahedron(fov: f64) -> SceneDesc {
    let (points, faces) = icosphere(0);
    let positions: Vec<Vec3> = points.iter().map(|p| p.as_vec3()).collect();
    let triangles = faces.iter().map(|f| f.map(|i| i as u32)).collect();
    let mut desc = empty();
    desc.camera = look(DVec3::new(0.0, 0.0, -4.0), DVec3::Z, fov);
    desc.integrator.max_depth = Some(2);
    desc.meshes.push(Arc::new(Mesh { normals: positions.clone(), positions, triangles, ..Mesh::default() }));
    let bsdf = material(&mut desc, grey(ALBEDO));
    let turn = DAffine3::from_axis_angle(DVec3::new(0.2, 0.9, -0.4).normalize(), 0.6);
    shape(&mut desc, ShapeKind::Mesh(MeshId(0)), turn, bsdf, 0.0);
    desc
}

/// Where rays over the picture, side by side, meet the mesh.
fn seen(desc: &SceneDesc, side: usize) -> Vec<SurfaceInteraction> {
    let (scene, camera) = (prepare(desc), Camera::of(desc).unwrap());
    let middle = |i: usize| (i as f64 + 0.5) / side as f64;
    let rays = (0..side * side).map(|i| camera.ray([middle(i % side), middle(i / side)], [0.5; 2]).unwrap());
    rays.filter_map(|ray| scene.first(&ray)).collect()
}

/// Paths from the camera, from the light, and from both ends show the same under a light at 80° to the view. A method that lights what smooth
/// normals see adds what no light path brings.
///
/// The bound is three to four standard errors of the means.
#[test]
fn b2_n7_light_at_80_degrees() {
    let mut desc = icosahedron(30.0);
    let direction = DVec3::new(-f64::sin(80f64.to_radians()), 0.0, f64::cos(80f64.to_radians()));
    let irradiance = Spectrum::Constant(1.0);
    desc.lights.push(LightDesc::Directional { direction, irradiance, place: Place::default() });
    let plan = Plan { side: 8, paths_per_pixel: 512, seeds: 16, window: UvWindow::PICTURE };
    let total = |method| {
        let pictures = repeat(&desc, method, plan);
        welch::moments(pictures.iter().map(|p| p.iter().sum::<f64>() / p.len() as f64))
    };
    let (path, _) = total(Method::Path);
    let methods = [Method::Particle, Method::Bidirectional, Method::Photon].map(total);
    println!("path {path}, others {methods:?}");
    let figure = methods.iter().map(|(mean, _)| (mean / path - 1.0).abs()).fold(0.0, f64::max);
    let side = 256;
    let l = -direction.as_vec3();
    let smooth = |at: &SurfaceInteraction| f64::from(ALBEDO * at.n.dot(l).max(0.0)) / PI;
    let kept = seen(&desc, side).iter().map(smooth).sum::<f64>() / (side * side) as f64;
    Row {
        case: "B2 N7 icosahedron with vertex normals, light at 80° to the view",
        measure: "difference of methods",
        figure,
        naive: ("light wherever smooth normals see it", (kept / path - 1.0).abs()),
        bound: 1e-2,
    }
    .check();
}

/// In a white furnace an icosahedron with vertex normals loses what comes from between its facets and the planes of its smooth normals,
/// (1 − cos)/2 of the angle between both. A factor that falls to zero smoothly there loses three times as much.
///
/// The bound is (1 − cos)/2 at 27°, the mean square angle over a face, and of what is dropped on the way to the eye at most as much again.
#[test]
fn b2_n7_furnace() {
    let mut desc = icosahedron(15.0);
    environment(&mut desc);
    let (found, _) = mean(&desc, 1 << 16);
    let side = 64;
    let tamed = |at: &SurfaceInteraction| {
        let frame = Frame::new(at.n);
        let apart = at.n.dot(at.point.ng);
        let of = |i: u32| {
            let u = [(i % 32) as f32 + 0.5, (i / 32) as f32 + 0.5].map(|v| v / 32.0);
            let wi = frame.to_world(warp::cosine_hemisphere(u));
            if !at.sides_agree(wi, false) {
                return 0.0;
            }
            let g = (wi.dot(at.point.ng) / (wi.dot(at.n) * apart)).min(1.0);
            f64::from(g * (1.0 + g * (1.0 - g)))
        };
        (0..1024).map(of).sum::<f64>() / 1024.0
    };
    let seen = seen(&desc, side);
    assert_eq!(seen.len(), side * side, "the mesh fills the picture");
    let tamed = seen.iter().map(tamed).sum::<f64>() / seen.len() as f64;
    Row {
        case: "B2 N7 icosahedron with vertex normals in a white furnace",
        measure: "share of light that is lost",
        figure: 1.0 - found / f64::from(ALBEDO),
        naive: ("shadowing of Chiang, Li and Burley", 1.0 - tamed),
        bound: 0.055,
    }
    .check();
}
