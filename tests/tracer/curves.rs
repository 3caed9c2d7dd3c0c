//! Curves with a thickness: hits against Mitsuba, and against distances from the curve.

use glam::{DVec3, DVec4, Vec3};

use crate::support::accel::{Random, ask_one};
use crate::support::scenes::in_world_space;
use pointillist::scene;
use pointillist::scene::desc::{CurveBasis, ShapeKind};
use pointillist::tracer::Scene;
use pointillist::tracer::accel::{Accel, Ray, Shapes};
use pointillist::tracer::curve::CurvePiece;

const FILE: &str = "0 0 0 0.3\n1 0 0 0.3\n2 1 0 0.1\n3 1 0 0.1\n4 1 0 .2\n";

/// A scene of one file of curves.
fn prepared(name: &str, plugin: &str, text: &str, more: &str) -> (Scene, scene::Loaded) {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).expect("a writable folder");
    std::fs::write(folder.join("c.txt"), text).expect("a writable folder");
    let xml = format!(
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"/><emitter type=\"constant\"/><shape type=\"{plugin}\">\
         <string name=\"filename\" value=\"c.txt\"/>{more}</shape></scene>"
    );
    let path = folder.join("scene.xml");
    std::fs::write(&path, xml).expect("a writable folder");
    let mut loaded = scene::load(&path, &[]).expect("valid");
    loaded.desc = in_world_space(loaded.desc);
    (Scene::prepare(&loaded.desc).expect("valid"), loaded)
}

/// Points and normals of Mitsuba 3.9.1 (`scalar_rgb`) on the same file.
#[test]
fn hits_are_those_of_mitsuba() {
    type Seen = Option<([f32; 3], [f32; 3])>;
    let down = Vec3::NEG_Y;
    let straight: [([f32; 3], Vec3, Seen); 8] = [
        ([-0.1, 3.0, 0.0], down, Some(([-0.1, 0.282843, 0.0], [-0.333333, 0.942809, 0.0]))),
        ([0.5, 3.0, 0.0], down, Some(([0.5, 0.3, 0.0], [0.0, 1.0, 0.0]))),
        ([1.1, 3.0, 0.0], down, Some(([1.1, 0.45, 0.0], [-0.6, 0.8, 0.0]))),
        ([1.5, 0.6, 3.0], Vec3::NEG_Z, Some(([1.5, 0.6, 0.178429], [-0.157895, 0.357895, 0.920316]))),
        ([3.9, 3.0, 0.0], down, Some(([3.9, 1.19096, 0.0], [-0.1, 0.994987, 0.0]))),
        ([4.1, 3.0, 0.0], down, Some(([4.1, 1.17321, 0.0], [0.5, 0.866026, 0.0]))),
        ([4.3, 3.0, 0.0], down, None),
        // From inside nothing is seen.
        ([1.5, 0.5, 0.0], Vec3::Y, None),
    ];
    let cubic: [([f32; 3], Vec3, Seen); 8] = [
        ([0.7, 3.0, 0.0], down, None),
        ([0.9, 3.0, 0.0], down, Some(([0.9, 0.412461, 0.0], [-0.360801, 0.932643, 0.0]))),
        ([1.5, 3.0, 0.0], down, Some(([1.5, 0.729212, 0.0], [-0.496896, 0.86781, 0.0]))),
        ([2.1, 3.0, 0.0], down, Some(([2.1, 1.00833, 0.0], [-0.286065, 0.95821, 0.0]))),
        ([2.9, 3.0, 0.0], down, Some(([2.9, 1.11204, 0.0], [-0.0440358, 0.99903, 0.0]))),
        ([1.9, 0.6, 3.0], Vec3::NEG_Z, Some(([1.9, 0.6, 0.0287914], [0.627728, -0.756109, 0.185083]))),
        ([3.1, 3.0, 0.0], down, None),
        ([1.5, 0.5, 0.0], Vec3::Y, None),
    ];
    for (plugin, rays) in [("linearcurve", straight), ("bsplinecurve", cubic)] {
        let (scene, loaded) = prepared(&format!("mitsuba_{plugin}"), plugin, FILE, "");
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        let (flipped, _) = prepared(
            &format!("flipped_{plugin}"),
            plugin,
            FILE,
            "<boolean name=\"flip_normals\" value=\"true\"/>",
        );
        for (origin, direction, seen) in rays {
            let ray = Ray::new(Vec3::from(origin), direction);
            let hit = scene.closest(&ray).map(|hit| (hit.point.p, hit.point.ng));
            let same = match (hit, seen) {
                (None, None) => true,
                (Some((p, n)), Some((wanted_p, wanted_n))) => {
                    p.distance(wanted_p.into()) < 2e-5 && n.distance(wanted_n.into()) < 2e-4
                }
                _ => false,
            };
            assert!(same, "{plugin} {origin:?}: {hit:?} {seen:?}");
            let turned = flipped.closest(&ray).map(|hit| (hit.point.p, -hit.point.ng));
            assert_eq!(turned, hit, "{plugin}");
        }
    }
}

/// A ray along the inner side of a bend comes nearer, goes away and then hits; where is from Mitsuba 3.9.1.
#[test]
fn inner_sides_of_bends_are_met() {
    let desc = scene::load("scenes/plugins/shape_bsplinecurve.xml".as_ref(), &[]).expect("valid").desc;
    let desc = in_world_space(desc);
    let scene = Scene::prepare(&desc).expect("valid");
    let direction = Vec3::new(-0.292756, -0.301424, -0.907435).normalize();
    let hit = scene.closest(&Ray::new(Vec3::new(-0.402967, 1.29694, 3.1908), direction)).expect("a hit");
    assert!(hit.point.p.distance(Vec3::new(-1.47901, 0.189044, -0.144522)) < 1e-4, "{:?}", hit.point);
    assert!(hit.point.ng.distance(Vec3::new(-0.656511, -0.486777, 0.57623)) < 1e-3, "{:?}", hit.point);
}

/// Radii stay when control points are scaled.
#[test]
fn transforms_leave_radii() {
    let more = "<transform name=\"to_world\"><scale x=\"2\" y=\"3\" z=\"4\"/></transform>";
    let (scene, loaded) = prepared("scaled", "linearcurve", "0 0 0 .5\n1 0 0 .5\n", more);
    let ShapeKind::Curves(curves) = &loaded.desc.shapes[0].kind else { panic!("curves") };
    assert_eq!((curves.basis, curves.points.len()), (CurveBasis::Linear, 2));
    let (lo, hi) = scene.accel().bounds();
    assert!(lo.distance(Vec3::splat(-0.5)) < 1e-5 && hi.distance(Vec3::new(2.5, 0.5, 0.5)) < 1e-5);
}

/// Random curves of one radius: their surface is where the distance to the curve is the radius, and no ray passes it by.
#[test]
fn hits_are_where_the_curve_is_near() {
    let mut random = Random(11);
    let mut hits = 0;
    for round in 0..40 {
        let radius = 0.02 + 0.1 * random.f64();
        let places = [0; 4].map(|_| [0; 3].map(|_| random.f64()));
        // Gentle bends: their radii are larger than the tube's.
        let points = [0, 1, 2, 3].map(|i| {
            let [x, y, z] = places[i];
            DVec4::new(x, 2.0 * i as f64 + y, z, radius)
        });
        let linear = round % 2 == 0;
        let curves: Vec<CurvePiece> = match linear {
            true => CurvePiece::linear([points[0], points[3]], false).into_iter().collect(),
            false => CurvePiece::cubic(&points, false).collect(),
        };
        let mut accel = Accel::new(Shapes { curves, ..Shapes::default() }, &[], &[]);
        let center = |t: f64| {
            let [a, b, c, d] = points.map(|p| p.truncate());
            if linear {
                return a.lerp(d, t);
            }
            let s = 1.0 - t;
            let weights = [
                s * s * s,
                3.0 * t * t * t - 6.0 * t * t + 4.0,
                3.0 * s * s * s - 6.0 * s * s + 4.0,
                t * t * t,
            ];
            (a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3]) / 6.0
        };
        // The distance to the curve, and where on it the nearest point is.
        let nearest = |p: DVec3| {
            let at = |i: usize| (center(i as f64 / 8000.0).distance(p), i);
            (0..=8000).map(at).fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a })
        };
        for _ in 0..60 {
            let target = center(random.f64());
            let [x, y, z] = [0; 3].map(|_| random.f64() * 2.0 - 1.0);
            let origin = target + DVec3::new(x, y, z).normalize_or(DVec3::X) * 3.0;
            let [x, y, z] = [0; 3].map(|_| (random.f64() * 2.0 - 1.0) * 1.2 * radius);
            let direction = (target + DVec3::new(x, y, z) - origin).normalize();
            let ray = Ray::new(origin.as_vec3(), direction.as_vec3());
            let (hit, occluded) = ask_one(&mut accel, ray);
            assert_eq!(hit.is_some(), occluded);
            let end = hit.map_or(6.0, |hit| f64::from(hit.t));
            if hit.is_some() {
                hits += 1;
                let p = origin + direction * end;
                let (distance, at) = nearest(p);
                // In the plane across the curve there: not beyond an open end.
                let at = at as f64 / 8000.0;
                let tangent = (center(at + 1e-4) - center(at - 1e-4)).normalize();
                assert!(linear || (p - center(at)).dot(tangent).abs() < 2e-3, "beyond the end");
                assert!((distance - radius).abs() < 2e-5, "{distance} {radius}");
            }
            // Through an open end a ray comes into a tube unseen.
            let passes = |end: DVec3| (end - origin).reject_from(direction).length() < 1.5 * radius;
            if !linear && (passes(center(0.0)) || passes(center(1.0))) {
                continue;
            }
            for i in 0..200 {
                let t = 2.0 + i as f64 / 50.0;
                let (distance, at) = nearest(origin + direction * t.min(end - 1e-3));
                let inside = distance < radius - 1e-3 && (linear || (1..8000).contains(&at));
                assert!(!inside || t > end, "{distance} of {radius} at {t} before {end}");
                if t > end {
                    break;
                }
            }
        }
    }
    assert!(hits > 1000, "{hits}");
}
