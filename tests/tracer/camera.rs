//! The camera's conventions, and uv ↔ ray both ways.

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec3};

use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::stream::UvWindow;
use pointillist::tracer::{Camera, PrepareError, PrepareOptions};

/// Numbers of the centre of the lens.
const CENTER: [f32; 2] = [0.5; 2];

/// The picture and its overscan.
const OVERSCAN: UvWindow = UvWindow { min: [-1.0; 2], max: [2.0; 2] };

fn camera(desc: &SceneDesc) -> Camera {
    Camera::new(&desc.camera, &desc.film, &PrepareOptions::from_film(&desc.film)).expect("valid")
}

fn identity(fov: f64, axis: FovAxis, (width, height): (u32, u32)) -> SceneDesc {
    let mut desc = empty();
    desc.camera.to_world = DAffine3::IDENTITY;
    let perspective = desc.camera.perspective_mut().unwrap();
    (perspective.fov, perspective.fov_axis) = (fov, axis);
    (desc.film.width, desc.film.height) = (width, height);
    desc
}

/// Looks along +z, +x is left, +y is up: the top left corner of the picture has x > 0 and y > 0.
#[test]
fn mitsuba_handedness_and_field_of_view() {
    let corner = |axis, size| {
        let d = camera(&identity(90.0, axis, size)).ray([0.0, 0.0], CENTER).unwrap().direction;
        DVec2::new(f64::from(d.x / d.z), f64::from(d.y / d.z))
    };
    let close = |a: DVec2, x: f64, y: f64| assert!((a - DVec2::new(x, y)).abs().max_element() < 1e-6, "{a}");
    close(corner(FovAxis::X, (200, 100)), 1.0, 0.5);
    close(corner(FovAxis::Y, (200, 100)), 2.0, 1.0);
    close(corner(FovAxis::Smaller, (200, 100)), 2.0, 1.0);
    close(corner(FovAxis::Larger, (200, 100)), 1.0, 0.5);
    close(corner(FovAxis::Smaller, (100, 200)), 1.0, 2.0);
    close(corner(FovAxis::Diagonal, (400, 300)), 0.8, 0.6);
}

#[test]
fn rays_and_projection_are_inverse_also_in_the_overscan() {
    let mut desc = identity(55.0, FovAxis::X, (640, 400));
    desc.camera.to_world = look(DVec3::new(3.0, -2.0, 1.0), DVec3::new(0.3, 0.5, -0.8), 1.0).to_world;
    desc.camera.principal_point_offset = DVec2::new(0.1, -0.2);
    desc.camera.near_clip = 0.5;
    desc.camera.far_clip = 50.0;
    desc.film.crop = Some(Crop { x: 100, y: 50, width: 320, height: 100 });
    let camera = camera(&desc);
    let mut random = Random(1);
    for _ in 0..1000 {
        let uv = [random.f64() * 1.4 - 0.2, random.f64() * 1.4 - 0.2];
        let ray = camera.ray(uv, CENTER).unwrap();
        assert!((ray.direction.length() - 1.0).abs() < 1e-6);
        let seen = |p: Vec3| camera.view(p, CENTER, &OVERSCAN);
        let view = seen(ray.origin + ray.direction * 7.0).expect("in front");
        let back = view.uv.map(f64::from);
        assert!((back[0] - uv[0]).abs() < 1e-5 && (back[1] - uv[1]).abs() < 1e-5, "{uv:?} {back:?}");
        assert!(view.distance2 > 7.0 * 7.0);
        assert!(seen(camera.position() - ray.direction).is_none(), "behind");
        assert!(seen(camera.position() + ray.direction * 0.2).is_none(), "before the near plane");
        let end = ray.origin + ray.direction * ray.t_max;
        assert!(seen(camera.position() + (end - camera.position()) * 1.01).is_none(), "beyond far");
    }
}

/// A crop window shows exactly its part of the full picture.
#[test]
fn crop_is_a_part_of_the_picture() {
    let mut desc = identity(40.0, FovAxis::X, (400, 200));
    let full = camera(&desc);
    desc.film.crop = Some(Crop { x: 100, y: 50, width: 200, height: 50 });
    let crop = camera(&desc);
    for uv in [[0.0, 0.0], [1.0, 1.0], [0.3, 0.8]] {
        let outer = [0.25 + 0.5 * uv[0], 0.25 + 0.25 * uv[1]];
        assert!(
            (crop.ray(uv, CENTER).unwrap().direction - full.ray(outer, CENTER).unwrap().direction).length()
                < 1e-6
        );
    }
}

#[test]
fn what_cannot_be_a_camera_is_refused() {
    let refuse = |change: fn(&mut SceneDesc)| {
        let mut desc = identity(40.0, FovAxis::X, (4, 4));
        change(&mut desc);
        let options = PrepareOptions::from_film(&desc.film);
        let error = Camera::new(&desc.camera, &desc.film, &options).expect_err("unusable");
        assert!(matches!(error, PrepareError::Camera { .. }) && !error.to_string().is_empty());
    };
    refuse(|d| d.camera.perspective_mut().unwrap().fov = 180.0);
    refuse(|d| d.camera.perspective_mut().unwrap().fov = f64::NAN);
    refuse(|d| d.camera.near_clip = 1e40);
    refuse(|d| d.film.width = 0);
    refuse(|d| d.camera.perspective_mut().unwrap().lens.radius = -1.0);
    refuse(|d| d.camera.perspective_mut().unwrap().lens.radius = f64::NAN);
    refuse(|d| d.camera.perspective_mut().unwrap().lens = LensDesc::round(0.1, 0.0));
    refuse(|d| d.camera.perspective_mut().unwrap().lens = LensDesc::round(0.1, f64::INFINITY));
    refuse(|d| d.camera.to_world = DAffine3::from_scale(DVec3::new(1.0, 1.0, 0.0)));
    refuse(|d| d.camera.to_world.translation.x = f64::INFINITY);
    refuse(|d| d.film.crop = Some(Crop { x: 0, y: 0, width: 0, height: 1 }));
    assert_eq!(camera(&empty()).position(), Vec3::ZERO);
}

/// A camera with a lens that stands askew, focused at z = 3.
fn with_lens() -> SceneDesc {
    let mut desc = identity(55.0, FovAxis::X, (640, 400));
    desc.camera.to_world = look(DVec3::new(3.0, -2.0, 1.0), DVec3::new(0.3, 0.5, -0.8), 1.0).to_world;
    desc.camera.principal_point_offset = DVec2::new(0.1, -0.2);
    (desc.camera.near_clip, desc.camera.far_clip) = (0.25, 40.0);
    desc.camera.perspective_mut().unwrap().lens = LensDesc::round(0.4, 3.0);
    desc
}

/// A lens of radius 0 is a pinhole, bit for bit, whatever its focus.
#[test]
fn a_lens_without_size_is_a_pinhole() {
    let mut desc = with_lens();
    desc.camera.perspective_mut().unwrap().lens = LensDesc::round(0.0, f64::NAN);
    let without = camera(&desc);
    let mut random = Random(2);
    for _ in 0..100 {
        let uv = [random.f64(), random.f64()];
        let (a, b) = (without.ray(uv, CENTER).unwrap(), without.ray(uv, [random.f64() as f32, 0.9]).unwrap());
        assert!(a.origin == b.origin && a.direction == b.direction && a.t_max == b.t_max);
        let p = a.origin + a.direction;
        let seen = |lens| without.view(p, lens, &OVERSCAN).expect("in front").uv;
        assert_eq!(seen([0.1, 0.7]), seen(CENTER));
        assert_eq!(without.start(uv, [0.1, 0.7]).unwrap().from, Some(without.position()));
    }
}

/// All rays of one uv meet in the plane of focus, at the point that the pinhole sees; each goes through its point of
/// the lens, from the near to the far plane; projection through that point finds the uv again, from anywhere.
#[test]
fn rays_through_a_lens_meet_in_focus() {
    let desc = with_lens();
    let (lens, hole) = (camera(&desc), {
        let mut desc = desc.clone();
        desc.camera.perspective_mut().unwrap().lens.radius = 0.0;
        camera(&desc)
    });
    let forward = desc.camera.to_world.matrix3.z_axis.as_vec3();
    let eye = lens.position();
    let z = |p: Vec3| (p - eye).dot(forward);
    let mut random = Random(3);
    let (mut widest, mut square) = (0f32, 0f32);
    let n = 1000;
    for _ in 0..n {
        let uv = [random.f64() * 1.4 - 0.2, random.f64() * 1.4 - 0.2];
        let u = [random.f64() as f32, random.f64() as f32];
        let (ray, through) = (lens.ray(uv, u).unwrap(), hole.ray(uv, u).unwrap());
        let at = |r: &pointillist::tracer::accel::Ray, depth: f32| {
            r.origin + r.direction * ((depth - z(r.origin)) / r.direction.dot(forward))
        };
        assert!((at(&ray, 3.0) - at(&through, 3.0)).length() < 1e-5, "not in focus");
        let q = lens.start(uv, u).and_then(|start| start.from).expect("a lens");
        assert!((at(&ray, 0.0) - q).length() < 1e-5, "not through its point of the lens");
        assert!(z(q).abs() < 1e-6);
        assert!((z(ray.origin) - 0.25).abs() < 1e-5 && (ray.direction.length() - 1.0).abs() < 1e-6);
        assert!((z(ray.origin + ray.direction * ray.t_max) - 40.0).abs() < 1e-3);
        for t in [1.0, 5.0, 20.0] {
            let p = ray.origin + ray.direction * t;
            let view = lens.view(p, u, &OVERSCAN).expect("in front");
            let back = view.uv.map(f64::from);
            assert!((back[0] - uv[0]).abs() < 1e-5 && (back[1] - uv[1]).abs() < 1e-5, "{uv:?} {back:?}");
            assert!((view.distance2.sqrt() - (p - q).length()).abs() < 1e-4);
        }
        assert!(lens.view(q - ray.direction, u, &OVERSCAN).is_none(), "behind");
        widest = widest.max((q - eye).length());
        square += (q - eye).length_squared() / n as f32;
    }
    // Uniform over a disk: the mean of r² is half the square of the radius, with standard deviation R²/√12 each.
    assert!(widest > 0.39 && widest < 0.4 + 1e-6, "{widest}");
    let error = 0.16 / (12.0 * n as f32).sqrt();
    assert!((square - 0.08).abs() < 4.0 * error, "{square}");
}

/// Parallel rays along z, each from its place of the near plane; the scale of the transform is half the width of the picture. Scaled and
/// sheared, projection finds the place again, and a patch of the picture is as large as the importance says.
#[test]
fn orthographic_rays_are_parallel() {
    let mut desc = identity(f64::NAN, FovAxis::X, (200, 100));
    desc.camera.projection = ProjectionDesc::Orthographic;
    (desc.camera.near_clip, desc.camera.far_clip) = (0.5, 20.0);
    desc.camera.to_world = DAffine3::from_scale(DVec3::new(3.0, 2.0, 4.0));
    let straight = camera(&desc);
    let corner = straight.ray([0.0, 0.0], CENTER).unwrap();
    // Mitsuba 3.9.1 gives (3, 1, 2), (0, 0, 1) and a length of 19.5.
    assert!((corner.origin - Vec3::new(3.0, 1.0, 2.0)).length() < 1e-6, "{}", corner.origin);
    assert!(corner.direction == Vec3::Z && corner.t_max == 19.5 && straight.has_parallel_rays());
    assert!(straight.start([0.0, 0.0], CENTER).unwrap().from.is_none());

    let shear = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::new(0.3, -0.2, 1.0));
    let turned = look(DVec3::new(3.0, -2.0, 1.0), DVec3::new(0.3, 0.5, -0.8), 1.0).to_world;
    desc.camera.to_world = turned * DAffine3::from_mat3(shear * desc.camera.to_world.matrix3);
    desc.camera.principal_point_offset = DVec2::new(0.1, -0.2);
    desc.film.crop = Some(Crop { x: 50, y: 20, width: 100, height: 60 });
    let skew = camera(&desc);
    let mut random = Random(4);
    for _ in 0..200 {
        let uv = [random.f64() * 1.4 - 0.2, random.f64() * 1.4 - 0.2];
        let ray = skew.ray(uv, CENTER).unwrap();
        let seen = |t: f32| skew.view(ray.origin + ray.direction * t, CENTER, &OVERSCAN);
        let view = seen(7.0).expect("in front");
        let back = view.uv.map(f64::from);
        assert!((back[0] - uv[0]).abs() < 1e-5 && (back[1] - uv[1]).abs() < 1e-5, "{uv:?} {back:?}");
        assert!((view.origin - ray.origin).length() < 1e-5 && view.direction == ray.direction);
        assert!(seen(-0.01).is_none() && seen(19.6).is_none(), "beyond a clip plane");
        let step = 1e-2;
        let [right, down] = [[step, 0.0], [0.0, step]]
            .map(|by| skew.ray([uv[0] + by[0], uv[1] + by[1]], CENTER).unwrap().origin - ray.origin);
        let area = right.cross(down).dot(ray.direction).abs() / (step * step) as f32;
        assert!((view.uv_per_steradian * area / view.distance2 - 1.0).abs() < 1e-3, "{area}");
        assert_eq!(view.uv_per_steradian, skew.start(uv, CENTER).unwrap().uv_per_steradian);
    }
    assert!(skew.view_far(skew.ray([0.5; 2], CENTER).unwrap().direction, CENTER, &OVERSCAN).is_none());
}

/// The lines for display are those of the rays, and places on them are found again.
#[test]
fn lines_are_the_rays_through_the_centre_of_the_lens() {
    for (orthographic, aperture_radius) in [(false, 0.0), (false, 0.3), (true, 0.0)] {
        let mut desc = identity(40.0, FovAxis::X, (64, 48));
        desc.camera.perspective_mut().unwrap().lens = LensDesc::round(aperture_radius, 7.0);
        if orthographic {
            desc.camera.projection = ProjectionDesc::Orthographic;
        }
        desc.camera.to_world =
            DAffine3::from_rotation_y(0.4) * DAffine3::from_translation(DVec3::new(1.0, -2.0, 3.0));
        let camera = camera(&desc);
        let lines = camera.lines().expect("a plane");
        for i in 0..100 {
            let uv = [0.05 + 0.009 * f64::from(i), 0.95 - 0.007 * f64::from(i)];
            let ray = camera.ray(uv, [0.5; 2]).unwrap();
            let (origin, direction) = lines.line(DVec2::from_array(uv).as_vec2());
            assert!(
                origin.distance(ray.origin) < 1e-4 && direction.normalize().distance(ray.direction) < 1e-5
            );
            let distance = 0.5 + f32::from(i as u8);
            let (found, far) = lines.project(ray.origin + ray.direction * distance).expect("in the picture");
            assert!(found.distance(DVec2::from_array(uv).as_vec2()) < 1e-4, "{found} for {uv:?}");
            assert!((far - distance).abs() < 1e-3 * distance, "{far} for {distance}");
            let sky = lines.project_direction(ray.direction);
            assert_eq!(sky.is_some(), !orthographic);
            assert!(lines.project(ray.origin - ray.direction).is_none());
        }
    }
}
