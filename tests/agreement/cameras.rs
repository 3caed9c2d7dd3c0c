//! All methods agree through every camera, and a white furnace is white in it.

use glam::{DAffine3, DVec3};

use crate::materials::{lit, open_room};
use crate::pairs::{PHOTONS, PLAN, assert_all_pairs, assert_pairs};
use crate::support::agreement::{Method, measure};
use crate::support::scenes::*;
use pointillist::scene::desc::*;

/// A room with a lamp and the sky, seen from close by.
fn room(projection: ProjectionDesc) -> SceneDesc {
    let mut desc = lit(open_room([grey(0.6), grey(0.3)]));
    // Upright, so that poles are above and below.
    let turn = DAffine3::from_rotation_x(80f64.to_radians());
    desc.camera.to_world = DAffine3::from_translation(DVec3::new(0.1, -1.2, 1.3)) * turn;
    desc.camera.projection = projection;
    desc
}

fn fisheye(mapping: FisheyeMapping, fov: f64) -> ProjectionDesc {
    let (fov_axis, image_circle, distortion) = (FovAxis::Smaller, fov, [0.0; 4]);
    ProjectionDesc::Fisheye(FisheyeDesc { mapping, fov, fov_axis, image_circle, distortion })
}

/// With the image circle around the picture.
fn around(mapping: FisheyeMapping, fov: f64) -> ProjectionDesc {
    let (fov_axis, image_circle, distortion) = (FovAxis::Diagonal, 360.0, [0.0; 4]);
    ProjectionDesc::Fisheye(FisheyeDesc { mapping, fov, fov_axis, image_circle, distortion })
}

fn stereo(eyes: StereoEyes) -> ProjectionDesc {
    ProjectionDesc::Stereo(StereoDesc { interocular: 0.4, eyes })
}

/// A lens with blades, squeezed and distorted.
fn lens() -> ProjectionDesc {
    let lens = LensDesc { blades: 5, blade_rotation: 10.0, squeeze: 1.8, ..LensDesc::round(0.2, 1.5) };
    let distortion = DistortionDesc {
        radial: [-0.2, 0.05, 0.0, 0.02, 0.0, 0.0],
        tangential: [0.01, -0.02],
        prism: [0.005, 0.0, -0.01, 0.0],
    };
    let (fov, fov_axis) = (80.0, FovAxis::X);
    ProjectionDesc::Perspective(PerspectiveDesc { fov, fov_axis, lens, distortion: Some(distortion) })
}

/// A panorama beside a lens beside parallel rays.
fn batch() -> ProjectionDesc {
    let turn = DAffine3::from_rotation_y(0.3);
    let of = |projection| CameraDesc { projection, ..look(DVec3::ZERO, DVec3::Z, 60.0) };
    ProjectionDesc::Batch(vec![
        of(ProjectionDesc::Spherical),
        CameraDesc { to_world: turn, ..of(lens()) },
        CameraDesc {
            to_world: turn * DAffine3::from_scale(DVec3::new(2.0, 2.0, 1.0)),
            ..of(ProjectionDesc::Orthographic)
        },
        of(stereo(StereoEyes::OverUnder)),
    ])
}

#[test]
fn a_panorama() {
    assert_all_pairs("spherical", &room(ProjectionDesc::Spherical), PLAN, PHOTONS);
}

#[test]
fn both_eyes_all_around() {
    assert_all_pairs("ods", &room(stereo(StereoEyes::OverUnder)), PLAN, PHOTONS);
}

#[test]
fn a_cube() {
    assert_all_pairs("cubemap", &room(ProjectionDesc::CubeMap(CubeLayout::Cross)), PLAN, PHOTONS);
}

#[test]
fn fisheye_lenses() {
    assert_all_pairs("equidistant", &room(fisheye(FisheyeMapping::Equidistant, 200.0)), PLAN, PHOTONS);
    assert_all_pairs("equisolid", &room(fisheye(FisheyeMapping::Equisolid, 180.0)), PLAN, PHOTONS);
}

#[test]
fn a_distorted_lens_with_blades() {
    assert_all_pairs("distortion and blades", &room(lens()), PLAN, PHOTONS);
}

#[test]
fn several_cameras() {
    assert_all_pairs("batch", &room(batch()), PLAN, PHOTONS);
}

/// Particles do not find them, and paths from both ends weigh them as after a mirror.
#[test]
fn rays_of_one_direction() {
    let methods = [Method::Path, Method::Bidirectional, Method::Photon, Method::Vcm];
    assert_pairs("radiancemeter", &room(ProjectionDesc::Beam(0.0)), &methods, PLAN, PHOTONS);
    assert_pairs("distant", &room(ProjectionDesc::Beam(0.7)), &methods, PLAN, PHOTONS);
}

/// Meters stay away from the floor: what light paths add there grows with one over the squared distance.
#[test]
fn meters_of_irradiance() {
    for surface in [MeterSurface::Disk, MeterSurface::Sphere { center: DVec3::ZERO, radius: 0.5 }] {
        let mut desc = room(ProjectionDesc::Irradiance(surface));
        desc.camera.to_world = DAffine3::from_translation(DVec3::new(0.2, -1.5, 1.3));
        desc.camera.near_clip = 1e-4;
        assert_all_pairs("irradiancemeter", &desc, PLAN, PHOTONS);
    }
}

/// Inside of a white shell that shines, and outside of a white ball in a white world, every place that a camera shows is as bright as the world.
#[test]
fn furnaces() {
    for projection in [
        ProjectionDesc::Spherical,
        stereo(StereoEyes::OverUnder),
        ProjectionDesc::CubeMap(CubeLayout::Block),
        around(FisheyeMapping::Stereographic, 300.0),
        lens(),
        batch(),
    ] {
        let mut desc = empty();
        desc.camera.projection = projection.clone();
        let white = material(&mut desc, grey(1.0));
        shape(&mut desc, sphere(DVec3::new(0.0, 0.0, 3.0), 1.0), DAffine3::IDENTITY, white, 0.0);
        environment(&mut desc);
        for method in [Method::Path, Method::Particle, Method::Bidirectional] {
            let found = measure(&desc, method, PLAN);
            let n = found.mean.len() as f64;
            let mean = found.mean.iter().sum::<f64>() / n;
            let error = found.variance.iter().sum::<f64>().sqrt() / n;
            let expected = world(&desc);
            let z = (mean - expected) / error.max(1e-4 * expected);
            assert!(z.abs() < 4.0, "{projection:?} by {method:?}: {mean} ± {error} for {expected}");
        }
    }
}

/// The brightness of the world of [`environment`], by a panorama of nothing else.
fn world(desc: &SceneDesc) -> f64 {
    let mut desc = SceneDesc { shapes: Vec::new(), ..desc.clone() };
    desc.camera.projection = ProjectionDesc::Spherical;
    let found = measure(&desc, Method::Path, PLAN);
    found.mean.iter().sum::<f64>() / found.mean.len() as f64
}
