//! Projections beyond pinhole, round lens and parallel rays: both ways, areas, closed forms, and OpenCV's numbers.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec3};

use crate::support::scenes::*;
use pointillist::scene::desc::*;
use pointillist::stream::UvWindow;
use pointillist::tracer::{Camera, PrepareError, PrepareOptions};

const CENTER: [f32; 2] = [0.5; 2];

/// The picture and its overscan.
const OVERSCAN: UvWindow = UvWindow { min: [-0.4; 2], max: [1.4; 2] };

/// Where OpenCV shows points.
const OPENCV: &str = include_str!("opencv.csv");

fn perspective(lens: LensDesc, distortion: Option<DistortionDesc>) -> ProjectionDesc {
    ProjectionDesc::Perspective(PerspectiveDesc { fov: 70.0, fov_axis: FovAxis::X, lens, distortion })
}

fn fisheye(mapping: FisheyeMapping, fov: f64, distortion: [f64; 4]) -> ProjectionDesc {
    let image_circle = if distortion == [0.0; 4] { fov } else { 360.0 };
    ProjectionDesc::Fisheye(FisheyeDesc {
        mapping,
        fov,
        fov_axis: FovAxis::Smaller,
        image_circle,
        distortion,
    })
}

fn stereo(eyes: StereoEyes) -> ProjectionDesc {
    ProjectionDesc::Stereo(StereoDesc { interocular: 0.3, eyes })
}

fn distortion(random: &mut Random) -> DistortionDesc {
    let mut small = |scale: f64| scale * (2.0 * random.f64() - 1.0);
    DistortionDesc {
        radial: [0.3, 0.1, 0.02, 0.2, 0.05, 0.01].map(&mut small),
        tangential: [0.01, 0.01].map(&mut small),
        prism: [0.01, 0.005, 0.01, 0.005].map(&mut small),
    }
}

/// Every projection, with random parameters.
fn projections(random: &mut Random) -> Vec<ProjectionDesc> {
    let blades = LensDesc { blades: 5, blade_rotation: 17.0, squeeze: 1.8, ..LensDesc::round(0.2, 3.0) };
    let squeezed = LensDesc { squeeze: 0.6, ..LensDesc::round(0.2, 3.0) };
    vec![
        perspective(LensDesc::PINHOLE, Some(distortion(random))),
        perspective(LensDesc::round(0.2, 3.0), Some(distortion(random))),
        perspective(blades, Some(distortion(random))),
        perspective(blades, None),
        perspective(squeezed, None),
        fisheye(FisheyeMapping::Equidistant, 100.0 + 250.0 * random.f64(), [0.0; 4]),
        fisheye(FisheyeMapping::Equidistant, 120.0, [0.02, -0.005, 0.002, -0.0003]),
        fisheye(FisheyeMapping::Equisolid, 100.0 + 250.0 * random.f64(), [0.0; 4]),
        fisheye(FisheyeMapping::Stereographic, 100.0 + 200.0 * random.f64(), [0.0; 4]),
        fisheye(FisheyeMapping::Orthographic, 100.0 + 80.0 * random.f64(), [0.0; 4]),
        ProjectionDesc::Spherical,
        ProjectionDesc::CubeMap(CubeLayout::Block),
        ProjectionDesc::CubeMap(CubeLayout::Row),
        ProjectionDesc::CubeMap(CubeLayout::Column),
        ProjectionDesc::CubeMap(CubeLayout::Cross),
        stereo(StereoEyes::OverUnder),
        stereo(StereoEyes::Left),
        stereo(StereoEyes::Right),
        ProjectionDesc::Batch(vec![
            look(DVec3::new(0.5, 0.0, 0.0), DVec3::new(0.1, 0.2, 1.0), 40.0),
            CameraDesc {
                projection: perspective(squeezed, None),
                ..look(DVec3::new(-0.5, 0.2, 0.0), DVec3::new(0.3, -0.2, 1.0), 60.0)
            },
            CameraDesc {
                projection: ProjectionDesc::Spherical,
                ..look(DVec3::ZERO, DVec3::new(0.3, -0.2, 1.0), 60.0)
            },
        ]),
    ]
}

/// The camera of a projection; sheared, unless it is one of several.
fn placed(projection: ProjectionDesc, shear: f64, crop: Option<Crop>) -> Camera {
    let turned = look(DVec3::new(0.3, -0.2, 1.0), DVec3::new(0.3, 0.5, -0.8), 1.0).to_world;
    let by = if matches!(projection, ProjectionDesc::Batch(_)) { 0.0 } else { shear };
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(by, 1.0, 0.0), DVec3::new(by, -2.0 * by, 1.0));
    let mut desc = empty();
    desc.camera = CameraDesc {
        projection,
        to_world: turned * DAffine3::from_mat3(shear),
        principal_point_offset: DVec2::new(0.03, -0.05),
        near_clip: 0.25,
        far_clip: 60.0,
        ..desc.camera
    };
    (desc.film.width, desc.film.height, desc.film.crop) = (600, 400, crop);
    Camera::new(&desc.camera, &desc.film, &PrepareOptions::from_film(&desc.film)).expect("valid")
}

fn identity(projection: ProjectionDesc, (width, height): (u32, u32)) -> Camera {
    let mut desc = empty();
    desc.camera = CameraDesc { projection, to_world: DAffine3::IDENTITY, ..desc.camera };
    (desc.film.width, desc.film.height) = (width, height);
    Camera::new(&desc.camera, &desc.film, &PrepareOptions::from_film(&desc.film)).expect("valid")
}

/// A point on a ray is seen at the uv of the ray, as a point and from infinitely far, and the area of the picture around it is the one that finite
/// differences of rays find.
#[test]
fn rays_and_views_are_inverse() {
    let mut random = Random(1);
    for round in 0..6 {
        let crop = (round % 2 == 1).then_some(Crop { x: 60, y: 40, width: 300, height: 320 });
        for projection in projections(&mut random) {
            let name = format!("{projection:?}, round {round}");
            let shear = if round < 2 { 0.0 } else { 0.15 };
            let camera = placed(projection.clone(), shear, crop);
            let cameras = if let ProjectionDesc::Batch(cameras) = &projection { cameras.len() } else { 1 };
            let (mut shown, mut areas) = (0, 0);
            for _ in 0..300 {
                let uv = [random.f64(), random.f64()];
                let lens = [random.f64() as f32, random.f64() as f32];
                let Some(start) = camera.start(uv, lens) else { continue };
                shown += 1;
                let ray = start.ray;
                assert!((ray.direction.length() - 1.0).abs() < 1e-6, "{name}");
                let distance = 0.5 + 12.0 * random.f64() as f32;
                let p = ray.origin + ray.direction * distance;
                // Among several cameras the first number chooses one and the point of its lens, so that it must be put into the part of the camera.
                let tries = (0..cameras).flat_map(|i| {
                    [0.25, 0.75].map(|u| {
                        [(i as f32 + lens[0]) / cameras as f32, if cameras > 1 { lens[1] } else { u }]
                    })
                });
                let has_lens = matches!(projection, ProjectionDesc::Perspective(_));
                let tries: Vec<[f32; 2]> = if has_lens { vec![lens] } else { tries.collect() };
                let near = |found: [f32; 2]| {
                    let tolerance = 1e-5 * (1.0 + f64::from(start.uv_per_steradian));
                    (0..2).all(|i| (f64::from(found[i]) - uv[i]).abs() < tolerance)
                };
                let view =
                    tries.iter().find_map(|u| camera.view(p, *u, &UvWindow::PICTURE).filter(|v| near(v.uv)));
                let Some(view) = view else { panic!("{name}: {uv:?} is not found again") };
                assert!((view.direction - ray.direction).length() < 1e-5, "{name}");
                assert!((view.origin - ray.origin).length() < 1e-5, "{name}");
                let from = start.from.expect("no parallel rays");
                assert!((view.distance2.sqrt() / (p - from).length() - 1.0).abs() < 1e-5, "{name}");
                let ratio = view.uv_per_steradian / start.uv_per_steradian;
                assert!((ratio - 1.0).abs() < 1e-3, "{name}: {ratio}");
                let far = tries.iter().find_map(|u| {
                    camera.view_far(ray.direction, *u, &UvWindow::PICTURE).filter(|view| near(view.uv))
                });
                let far = far.unwrap_or_else(|| panic!("{name}: {uv:?} is not found from far"));
                assert!((far.uv_per_steradian / start.uv_per_steradian - 1.0).abs() < 1e-3, "{name}");
                let again = tries.iter().find_map(|u| camera.ray_of(&far, *u)).expect("its ray");
                assert!((again.direction - ray.direction).length() < 1e-5, "{name}");
                assert!(
                    (again.t_max / ray.t_max - 1.0).abs() < 1e-4,
                    "{name}: {} {}",
                    again.t_max,
                    ray.t_max
                );
                // Beyond either end of the ray nothing is seen there.
                for t in [-0.01, ray.t_max * 1.01] {
                    let beyond = ray.origin + ray.direction * t;
                    let found = tries.iter().find_map(|u| {
                        camera.view(beyond, *u, &UvWindow::PICTURE).filter(|view| near(view.uv))
                    });
                    assert!(found.is_none(), "{name}: {t}");
                }
                let step = 1e-3;
                let at = |du: f64, dv: f64| {
                    camera.ray([uv[0] + du, uv[1] + dv], lens).map(|r| r.origin + r.direction * distance)
                };
                let (Some(a), Some(b), Some(c), Some(d)) =
                    (at(-step, 0.0), at(step, 0.0), at(0.0, -step), at(0.0, step))
                else {
                    continue;
                };
                // Not across an edge of two faces or pictures, nor where the picture is too curved for these steps.
                let smooth =
                    |low: Vec3, high: Vec3| ((low + high) * 0.5 - p).length() < 0.01 * (high - low).length();
                if smooth(a, b) && smooth(c, d) {
                    areas += 1;
                    let area = (b - a).cross(d - c).dot(ray.direction).abs() / (4.0 * step * step) as f32;
                    let product = view.uv_per_steradian * area / view.distance2;
                    assert!((product - 1.0).abs() < 5e-3, "{name}: {product} at {uv:?}");
                }
            }
            assert!(shown > 80 && areas > shown / 2, "{name}: {shown} rays, {areas} areas");
        }
    }
}

/// The solid angles of all places sum to what the projection shows.
#[test]
fn solid_angles_are_complete() {
    for (projection, whole) in [
        (ProjectionDesc::Spherical, 4.0 * PI),
        (stereo(StereoEyes::Left), 4.0 * PI),
        (stereo(StereoEyes::OverUnder), 8.0 * PI),
        (ProjectionDesc::CubeMap(CubeLayout::Block), 4.0 * PI),
        (ProjectionDesc::CubeMap(CubeLayout::Cross), 4.0 * PI),
        (fisheye(FisheyeMapping::Equidistant, 180.0, [0.0; 4]), 2.0 * PI),
        (fisheye(FisheyeMapping::Equisolid, 360.0, [0.0; 4]), 4.0 * PI),
        (fisheye(FisheyeMapping::Stereographic, 220.0, [0.0; 4]), TAU * (1.0 - 110f64.to_radians().cos())),
        (fisheye(FisheyeMapping::Orthographic, 170.0, [0.0; 4]), TAU * (1.0 - 85f64.to_radians().cos())),
    ] {
        let (camera, n) = (identity(projection.clone(), (256, 256)), 512);
        let mut sum = 0.0;
        for i in 0..n * n {
            let uv = [(f64::from(i % n) + 0.5) / f64::from(n), (f64::from(i / n) + 0.5) / f64::from(n)];
            if let Some(start) = camera.start(uv, CENTER) {
                sum += 1.0 / f64::from(start.uv_per_steradian) / f64::from(n * n);
            }
        }
        assert!((sum / whole - 1.0).abs() < 5e-3, "{projection:?}: {sum} for {whole}");
    }
}

/// Longitude and latitude: the middle is ahead, a quarter to the right is to the right.
#[test]
fn equirectangular_directions() {
    let camera = identity(ProjectionDesc::Spherical, (200, 100));
    let mut random = Random(2);
    let known = [
        ([0.5, 0.5], DVec3::Z),
        ([0.75, 0.5], DVec3::NEG_X),
        ([0.25, 0.5], DVec3::X),
        ([0.3, 0.0], DVec3::Y),
    ];
    for (uv, direction) in known {
        assert!((camera.ray(uv, CENTER).unwrap().direction.as_dvec3() - direction).length() < 1e-6, "{uv:?}");
    }
    for _ in 0..200 {
        let uv = [random.f64(), random.f64()];
        let (longitude, latitude) = ((uv[0] - 0.5) * TAU, (0.5 - uv[1]) * PI);
        let right = latitude.cos() * longitude.sin();
        let direction = DVec3::new(-right, latitude.sin(), latitude.cos() * longitude.cos());
        let start = camera.start(uv, CENTER).unwrap();
        assert!((start.ray.direction.as_dvec3() - direction).length() < 1e-6);
        let density = 1.0 / (2.0 * PI * PI * latitude.cos());
        assert!((f64::from(start.uv_per_steradian) / density - 1.0).abs() < 1e-5);
    }
}

/// Rays of both eyes as Google's *Rendering Omni-directional Stereo Content* (2015) has them, where x is to the right and −z ahead; and the place of
/// a point on the horizon of either eye: its azimuth from the middle between the eyes, turned by the angle whose sine is the radius over the distance.
#[test]
fn omnidirectional_stereo() {
    let camera = identity(stereo(StereoEyes::OverUnder), (200, 200));
    let mut random = Random(3);
    for _ in 0..200 {
        let (x, y) = (random.f64(), random.f64());
        for (eye, sign) in [-1.0, 1.0].into_iter().enumerate() {
            let (theta, phi) = (x * TAU - PI, PI / 2.0 - y * PI);
            let scale = 0.5 * 0.3 * sign;
            let origin = DVec3::new(theta.cos() * scale, 0.0, theta.sin() * scale);
            let direction = DVec3::new(theta.sin() * phi.cos(), phi.sin(), -theta.cos() * phi.cos());
            let ours = |v: DVec3| DVec3::new(-v.x, v.y, -v.z);
            let start = camera.start([x, 0.5 * (y + eye as f64)], CENTER).unwrap();
            assert!((start.from.unwrap().as_dvec3() - ours(origin)).length() < 1e-6);
            assert!((start.ray.direction.as_dvec3() - ours(direction)).length() < 1e-6);
        }
        let (azimuth, distance) = (TAU * random.f64() - PI, 0.2 + 3.0 * random.f64());
        let p = DVec3::new(-azimuth.sin(), 0.0, azimuth.cos()) * distance;
        let seen =
            [0.25, 0.75].map(|u| camera.view(p.as_vec3(), [0.1, u], &UvWindow::PICTURE).expect("seen"));
        for (eye, view) in seen.into_iter().enumerate() {
            assert_eq!(view.choices, 2.0);
            // To the left eye a near thing is farther to the right.
            let turn = (0.15 / distance).asin() * [1.0, -1.0][eye];
            let u = (0.5 + (azimuth + turn) / TAU).rem_euclid(1.0);
            let off = (f64::from(view.uv[0]) - u).abs();
            assert!(off.min(1.0 - off) < 1e-5, "{off}");
            assert!((f64::from(view.uv[1]) - 0.25 - 0.5 * eye as f64).abs() < 1e-6);
        }
    }
}

/// In the overscan a panorama goes on, so that points near an edge have several places, of which the numbers of the lens choose one.
#[test]
fn overscan_continues_panoramas() {
    for projection in [ProjectionDesc::Spherical, stereo(StereoEyes::OverUnder), stereo(StereoEyes::Right)] {
        let camera = identity(projection.clone(), (64, 64));
        let (mut random, mut several) = (Random(4), 0);
        for _ in 0..500 {
            let uv = [1.8 * random.f64() - 0.4, 1.8 * random.f64() - 0.4];
            let start = camera.start(uv, CENTER).expect("all directions");
            let p = start.ray.origin + start.ray.direction * 5.0;
            let first = camera.view(p, CENTER, &OVERSCAN).expect("seen");
            let count = first.choices as usize;
            several += usize::from(count > 1);
            let views: Vec<_> = (0..count)
                .map(|i| camera.view(p, [0.3, (i as f32 + 0.5) / count as f32], &OVERSCAN).expect("seen"))
                .collect();
            let tolerance = 1e-5 * (1.0 + f64::from(start.uv_per_steradian));
            let near = |found: [f32; 2]| (0..2).all(|i| (f64::from(found[i]) - uv[i]).abs() < tolerance);
            assert_eq!(
                views.iter().filter(|view| near(view.uv)).count(),
                1,
                "{projection:?} {uv:?} {views:?}"
            );
            for view in views {
                let ray = camera.ray(view.uv.map(f64::from), CENTER).expect("its ray");
                let along = (p - ray.origin).dot(ray.direction);
                assert!((p - ray.origin - ray.direction * along).length() < 1e-4, "{projection:?}");
            }
        }
        assert!(several > 250, "{several}");
    }
}

/// The blades of an aperture: uniform over the polygon, whose corners lie on the circle, the first of them up; narrower by the squeeze.
#[test]
fn apertures_of_blades() {
    for (blades, squeeze) in [(3, 1.0), (6, 1.0), (8, 2.0), (0, 1.5)] {
        let lens = LensDesc { blades, squeeze, ..LensDesc::round(0.5, 3.0) };
        let camera = identity(perspective(lens, None), (100, 100));
        let mut random = Random(5);
        let n = 20_000;
        let mut sums = [0.0; 2];
        let sides = f64::from(blades);
        for _ in 0..n {
            let u = [random.f64() as f32, random.f64() as f32];
            let q = camera.start([0.5; 2], u).unwrap().from.unwrap().as_dvec3();
            assert!(q.z.abs() < 1e-9);
            let q = DVec2::new(q.x * squeeze, q.y) / 0.5;
            if blades > 0 {
                // Inside of every side: their normals lie half a sector beside the corners.
                for i in 0..blades {
                    let normal = PI / 2.0 + (f64::from(i) + 0.5) * TAU / sides;
                    assert!(q.dot(DVec2::from_angle(normal)) <= (PI / sides).cos() + 1e-6, "{q}");
                }
            }
            sums[0] += q.length_squared();
            sums[1] += q.length_squared().powi(2);
        }
        // The second moment of a regular polygon of circumradius 1 (and of the disk): (2 + cos(2π/n)) / 6.
        let expected = if blades > 0 { (2.0 + (TAU / sides).cos()) / 6.0 } else { 0.5 };
        let (mean, square) = (sums[0] / f64::from(n), sums[1] / f64::from(n));
        let error = ((square - mean * mean) / f64::from(n)).sqrt();
        assert!((mean - expected).abs() < 4.0 * error, "{blades}: {mean} for {expected} ± {error}");
        let middle = camera.start([0.5; 2], CENTER).unwrap().from.unwrap();
        assert!(middle.length() < 1e-7, "the middle of the lens");
    }
}

/// Lenses of OpenCV show points where OpenCV does, to 1e-5 pixels, and rays through these places meet the points.
#[test]
fn opencv_lenses() {
    let (width, height) = (640, 400);
    let (mut camera, mut points) = (None, 0);
    for line in OPENCV.lines().filter(|line| !line.starts_with('#')) {
        let (kind, numbers) = line.split_once(',').unwrap();
        let n: Vec<f64> = numbers.split(',').map(|number| number.parse().unwrap()).collect();
        if kind == "point" {
            let camera: &Camera = camera.as_ref().unwrap();
            let p = DVec3::new(-n[0], -n[1], n[2]);
            let pixel = camera.screen_position(p).expect("it is shown")
                * DVec2::new(width.into(), height.into())
                - 0.5;
            let off = pixel - DVec2::new(n[3], n[4]);
            assert!(off.length() < 1e-5, "{line}: {pixel}");
            let uv = [(n[3] + 0.5) / f64::from(width), (n[4] + 0.5) / f64::from(height)];
            let ray = camera.ray(uv, CENTER).expect("a ray");
            let direction = p.normalize();
            assert!((ray.direction.as_dvec3() - direction).length() < 1e-6, "{line}");
            points += 1;
            continue;
        }
        let (focal, c) = (n[0], &n[3..]);
        let half = 0.5 * f64::from(width) / focal;
        let fov_axis = FovAxis::X;
        let projection = match kind {
            "lens" => ProjectionDesc::Perspective(PerspectiveDesc {
                fov: 2.0 * half.atan().to_degrees(),
                fov_axis,
                lens: LensDesc::PINHOLE,
                distortion: Some(DistortionDesc {
                    radial: [c[0], c[1], c[4], c[5], c[6], c[7]],
                    tangential: [c[2], c[3]],
                    prism: [c[8], c[9], c[10], c[11]],
                }),
            }),
            _ => ProjectionDesc::Fisheye(FisheyeDesc {
                mapping: FisheyeMapping::Equidistant,
                fov: 2.0 * half.to_degrees(),
                fov_axis,
                image_circle: 360.0,
                distortion: [c[0], c[1], c[2], c[3]],
            }),
        };
        let mut desc = empty();
        // Pixel centres of OpenCV have whole numbers.
        let middle = DVec2::new((n[1] + 0.5) / f64::from(width), (n[2] + 0.5) / f64::from(height));
        desc.camera = CameraDesc {
            projection,
            to_world: DAffine3::IDENTITY,
            principal_point_offset: 0.5 - middle,
            ..desc.camera
        };
        (desc.film.width, desc.film.height) = (width, height);
        camera = Some(
            Camera::new(&desc.camera, &desc.film, &PrepareOptions::from_film(&desc.film)).expect("valid"),
        );
    }
    assert_eq!(points, 180);
}

#[test]
fn projections_that_cannot_be_are_refused() {
    let nan = DistortionDesc { radial: [f64::NAN; 6], ..DistortionDesc::default() };
    for projection in [
        perspective(LensDesc { blades: 2, ..LensDesc::round(1.0, 1.0) }, None),
        perspective(LensDesc { squeeze: 0.0, ..LensDesc::round(1.0, 1.0) }, None),
        perspective(LensDesc::PINHOLE, Some(nan)),
        fisheye(FisheyeMapping::Orthographic, 181.0, [0.0; 4]),
        fisheye(FisheyeMapping::Equidistant, 361.0, [0.0; 4]),
        fisheye(FisheyeMapping::Equidistant, 90.0, [f64::INFINITY, 0.0, 0.0, 0.0]),
        ProjectionDesc::Stereo(StereoDesc { interocular: -1.0, eyes: StereoEyes::Left }),
        ProjectionDesc::Batch(Vec::new()),
    ] {
        let mut desc = empty();
        desc.camera.projection = projection;
        let error = Camera::of(&desc).expect_err("unusable");
        assert!(matches!(error, PrepareError::Camera { .. }) && !error.to_string().is_empty());
    }
}

/// A single ray has no place that a point could be seen at.
#[test]
fn a_single_ray_is_found_by_nothing() {
    let camera = identity(ProjectionDesc::Beam(0.0), (1, 1));
    let start = camera.start([0.3, 0.7], CENTER).unwrap();
    assert!(start.ray.direction == Vec3::Z && start.uv_per_steradian == 0.0 && !camera.is_found_by_light());
    assert!(camera.view(Vec3::Z * 3.0, CENTER, &UvWindow::PICTURE).is_none());
    assert!(camera.view_far(Vec3::Z, CENTER, &UvWindow::PICTURE).is_none());
}

/// Rays of a meter leave its surface by the cosine, uniformly over it, and points see them again through the same point of the surface, also in the
/// overscan.
#[test]
fn meters_of_irradiance() {
    let scale = DAffine3::from_scale(DVec3::splat(2.0));
    for (surface, to_world, second_moment) in [
        (MeterSurface::Rectangle, DAffine3::from_scale(DVec3::new(2.0, 0.5, 1.0)), (4.0 + 0.25) / 3.0),
        (MeterSurface::Disk, scale, 2.0),
        (MeterSurface::Sphere { center: DVec3::ZERO, radius: 0.5 }, scale, 1.0),
        (MeterSurface::Sphere { center: DVec3::ZERO, radius: -0.5 }, scale, 1.0),
    ] {
        let mut desc = empty();
        let turn = DAffine3::from_rotation_x(0.7) * DAffine3::from_translation(DVec3::new(0.3, 0.2, 0.1));
        let projection = ProjectionDesc::Irradiance(surface);
        desc.camera = CameraDesc { projection, to_world: turn * to_world, near_clip: 1e-3, ..desc.camera };
        (desc.film.width, desc.film.height) = (1, 1);
        let camera = Camera::of(&desc).expect("valid");
        let middle = turn.translation;
        let (mut random, n) = (Random(6), 4000);
        let mut moments = [0.0; 2];
        for _ in 0..n {
            let uv = [1.8 * random.f64() - 0.4, 1.8 * random.f64() - 0.4];
            let u = [random.f64() as f32, random.f64() as f32];
            let start = camera.start(uv, u).expect("a ray");
            let from = start.from.unwrap().as_dvec3();
            let square = (from - middle).length_squared();
            moments = [moments[0] + square, moments[1] + square * square];
            let normal = match surface {
                MeterSurface::Sphere { radius, .. } => (from - middle).normalize() * radius.signum(),
                _ => turn.matrix3.z_axis,
            };
            let cos = start.ray.direction.as_dvec3().dot(normal);
            assert!(cos > -1e-6 && (f64::from(start.uv_per_steradian) - cos / PI).abs() < 1e-5, "{cos}");
            let p = start.ray.origin + start.ray.direction * 0.2;
            let picture = UvWindow::PICTURE;
            // One cell, then nine: the numbers of the lens choose the cell of this place and the same point.
            let cell = [0, 1].map(|i| uv[i].floor() as f32 + 1.0);
            let number = cell[1] * 3.0 + cell[0];
            for (window, choices, u) in [(picture, 1.0, u), (OVERSCAN, 9.0, [u[0], (number + u[1]) / 9.0])] {
                let is_inside = uv.iter().all(|c| (0.0..1.0).contains(c));
                let view = camera.view(p, u, &window);
                if choices > 1.0 || is_inside {
                    let view = view.unwrap_or_else(|| panic!("{surface:?} {uv:?} is not found again"));
                    assert_eq!(view.choices, choices);
                    assert!((view.direction - start.ray.direction).length() < 1e-3, "{surface:?}");
                    let again = camera.ray(view.uv.map(f64::from), u);
                    assert!(again.is_some() && (0..2).all(|i| (f64::from(view.uv[i]) - uv[i]).abs() < 1e-2));
                }
            }
        }
        let (mean, square) = (moments[0] / f64::from(n), moments[1] / f64::from(n));
        let error = ((square - mean * mean).max(0.0) / f64::from(n)).sqrt().max(1e-6);
        assert!((mean - second_moment).abs() < 4.0 * error, "{surface:?}: {mean} for {second_moment}");
    }
}

/// A shell around the camera that shines unevenly has the same picture by rays and by its points, as particles connect them: z-tests over 16 parts of
/// the picture and its overscan.
#[test]
fn rays_and_points_show_the_same_picture() {
    const PARTS: usize = 4;
    const SAMPLES: u32 = 200_000;
    let radiance = |p: Vec3| f64::from(1.0 + (p.x * 0.7 + p.y * 0.4).sin() * 0.9 * (p.z * 0.5).cos());
    let window = UvWindow { min: [-0.1; 2], max: [1.1; 2] };
    let side = f64::from(window.max[0] - window.min[0]);
    let radius = 4.0f32;
    let mut random = Random(7);
    let mut all = projections(&mut random);
    all.push(ProjectionDesc::Irradiance(MeterSurface::Disk));
    all.push(ProjectionDesc::Irradiance(MeterSurface::Sphere {
        center: DVec3::new(0.1, 0.2, 0.3),
        radius: 0.5,
    }));
    let mut worst: f64 = 0.0;
    for projection in all {
        let name = format!("{projection:?}");
        let sheared = !matches!(projection, ProjectionDesc::Irradiance(_));
        let camera = placed(projection, if sheared { 0.1 } else { 0.0 }, None);
        let part = |uv: [f64; 2]| {
            let [x, y] = [0, 1].map(|i| ((uv[i] - f64::from(window.min[i])) / side * PARTS as f64) as usize);
            y.min(PARTS - 1) * PARTS + x.min(PARTS - 1)
        };
        // By rays and by points: sums and sums of squares of density over uv.
        let mut sums = [[[0.0f64; 2]; PARTS * PARTS]; 2];
        for _ in 0..SAMPLES {
            let lens = [random.f32(), random.f32()];
            let uv = [0, 1].map(|i| f64::from(window.min[i]) + side * random.f64());
            if let Some(start) = camera.start(uv, lens) {
                let (o, d) = (start.ray.origin, start.ray.direction);
                let (b, c) = (o.dot(d), o.length_squared() - radius * radius);
                let t = -b + (b * b - c).sqrt();
                let value = radiance(o + d * t) * side * side;
                let sum = &mut sums[0][part(uv)];
                *sum = [sum[0] + value, sum[1] + value * value];
            }
            let (z, turn) = (2.0 * random.f64() - 1.0, TAU * random.f64());
            let across = (1.0 - z * z).sqrt();
            let p = (DVec3::new(across * turn.cos(), across * turn.sin(), z) * f64::from(radius)).as_vec3();
            if let Some(view) = camera.view(p, [random.f32(), random.f32()], &window) {
                let cos = f64::from(view.direction.dot(p) / radius).abs();
                let area = 4.0 * PI * f64::from(radius * radius);
                let density = f64::from(view.choices * view.uv_per_steradian / view.distance2);
                let value = radiance(p) * cos * area * density;
                let sum = &mut sums[1][part(view.uv.map(f64::from))];
                *sum = [sum[0] + value, sum[1] + value * value];
            }
        }
        let n = f64::from(SAMPLES);
        for (rays, points) in sums[0].iter().zip(&sums[1]) {
            let [a, b] = [rays, points].map(|s| (s[0] / n, (s[1] / n - (s[0] / n).powi(2)) / n));
            let z = (a.0 - b.0).abs() / (a.1 + b.1).sqrt().max(1e-12);
            worst = worst.max(z);
            // 21 projections with 16 parts: 5 standard deviations happen in 2 of 10 000 runs.
            assert!(z < 5.0, "{name}: {} by rays, {} by points, z = {z}", a.0, b.0);
        }
    }
    assert!(worst > 1.0, "nothing was compared");
}
