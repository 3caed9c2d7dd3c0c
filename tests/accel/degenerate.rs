//! Degenerate scenes and rays: the builder and the traversal neither crash nor loop, the answer is right or a miss, and every kernel
//! gives the same one.

use std::collections::HashSet;

use glam::{DVec3, Vec3};

use crate::support::accel::{
    Primitives, Random, Tally, Verdict, ask, ask_one, bits, check, polygon, rounding,
};
use pointillist::tracer::accel::{Hit, PrimRange, Ray};
use pointillist::tracer::shape::{Disk, Sphere};

/// A triangle across the z axis at z = 2.
const FACE: [Vec3; 3] = [Vec3::new(-1.0, -1.0, 2.0), Vec3::new(1.0, -1.0, 2.0), Vec3::new(0.0, 1.0, 2.0)];

const AHEAD: Ray = Ray { origin: Vec3::ZERO, direction: Vec3::Z, t_max: f32::INFINITY };

#[test]
fn nothing_is_hit_where_nothing_is() {
    let mut empty = Primitives::default().accel();
    assert_eq!(empty.bounds(), (Vec3::ZERO, Vec3::ZERO));
    for direction in [Vec3::Z, Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::splat(-0.0)] {
        assert_eq!(ask_one(&mut empty, Ray::new(Vec3::ZERO, direction)), (None, false));
        assert_eq!(ask_one(&mut empty, Ray::new(direction, Vec3::X)), (None, false));
    }
}

/// One to twenty: every way a leaf or a node can be partly filled.
#[test]
fn a_few_primitives_are_all_found() {
    for n in 1..=20 {
        for quads in [false, true] {
            let mut all = Primitives::default();
            for i in 0..n {
                let z = Vec3::Z * ((i * 23) % n) as f32;
                if quads {
                    all.quad(FACE[0] + z, Vec3::X * 2.0, Vec3::Y * 2.0)
                } else {
                    all.triangle(FACE.map(|p| p + z))
                }
            }
            let mut accel = all.accel();
            let mut ray = AHEAD;
            for expected in 0..n {
                let (hit, occluded) = ask_one(&mut accel, ray);
                let hit = hit.unwrap_or_else(|| panic!("{expected} of {n}"));
                assert!(occluded && hit.t == 2.0 + expected as f32 - ray.origin.z, "{hit:?}");
                ray.origin.z = (2 + expected) as f32;
            }
            assert_eq!(ask_one(&mut accel, ray), (None, false));
        }
    }
}

/// Identical triangles end up deep in a tree that only splits what differs. The lowest id is the answer; skipping all
/// but one leaves one.
#[test]
fn identical_primitives_are_one_deep_and_the_first_is_hit() {
    for n in [1usize, 2, 3, 5, 8, 9, 64, 1000, 20_000] {
        let mut accel = Primitives::of(&vec![FACE; n]).accel();
        assert!(accel.bytes() < 1024 + 256 * n, "{n}: {} bytes", accel.bytes());
        let (hit, occluded) = ask_one(&mut accel, AHEAD);
        assert!(occluded);
        assert_eq!(hit.map(|h| (h.t, h.prim)), Some((2.0, 0)), "of {n}");
        assert_eq!(ask_one(&mut accel, Ray::new(Vec3::ZERO, -Vec3::Z)), (None, false));
        let n = n as u32;
        let skips = [(0, n), (0, n - 1), (1, n), (n / 2, n)].map(|(first, end)| PrimRange { first, end });
        let occluded = ask(&mut accel, &skips.map(|skip| (AHEAD, skip))).into_iter().map(|a| a.1);
        assert_eq!(occluded.collect::<Vec<_>>(), [false, true, true, n > 1], "of {n}");
    }
    // Of every kind, all at the same distance.
    let mut all = Primitives::of(&vec![FACE; 300]);
    (0..200).for_each(|_| all.quad(FACE[0], Vec3::X * 2.0, Vec3::Y * 2.0));
    all.disks.extend((0..300).filter_map(|_| Disk::new(Vec3::Z * 2.0, Vec3::X, Vec3::Y, DVec3::Z)));
    all.spheres.extend((0..300).map(|_| Sphere { center: Vec3::Z * 3.0, radius: 1.0, inward: false }));
    let mut accel = all.accel();
    assert_eq!(ask_one(&mut accel, AHEAD).0.map(|h| (h.t, h.prim)), Some((2.0, 0)));
    for (x, first) in [(0.95, 300), (0.0, 0)] {
        // Beside the triangles the parallelograms are the first.
        let ray = Ray { origin: Vec3::new(x, 0.1, 0.0), ..AHEAD };
        assert_eq!(ask_one(&mut accel, ray).0.map(|h| h.prim), Some(first));
    }
}

/// A thousand nested triangles: every box holds all smaller ones.
#[test]
fn nested_triangles_are_peeled_one_by_one() {
    let (n, ratio) = (1000, 1.01f32);
    let nested: Vec<[Vec3; 3]> = (0..n).map(|i| FACE.map(|p| p * ratio.powi(i - n / 2))).collect();
    let mut accel = Primitives::of(&nested).accel();
    let mut ray = Ray { origin: Vec3::new(0.0, 0.0, 1e4), direction: -Vec3::Z, t_max: f32::INFINITY };
    for expected in (0..n).rev() {
        let (hit, _) = ask_one(&mut accel, ray);
        let hit = hit.unwrap_or_else(|| panic!("{expected}"));
        assert_eq!(hit.prim, expected as u32);
        let z = nested[hit.prim as usize][0].z;
        assert!((ray.origin.z - hit.t - z).abs() <= 2e-7 * ray.origin.z, "{hit:?}");
        ray.origin.z = z;
    }
    assert_eq!(ask_one(&mut accel, ray), (None, false));
}

/// Spaced exponentially from 1e-30 to 1e12: splits by area or by the middle peel one triangle off at a time, down to
/// the depth from which on sets are halved. From outside and from 0, right in every kernel. The products in a distance
/// underflow for triangles below 1e-12: they may be missed, but nothing else is.
#[test]
fn scenes_over_forty_decades_are_walked_to_the_bottom() {
    for steps in [3, 24, 100] {
        let ratio = 10f64.powf(1.0 / f64::from(steps));
        let sizes: Vec<f64> = (-30 * steps..12 * steps).map(|i| ratio.powi(i) * 0.3).collect();
        let nested: Vec<[Vec3; 3]> =
            sizes.iter().map(|&s| FACE.map(|p| (p.as_dvec3() * s).as_vec3())).collect();
        let all = Primitives::of(&nested);
        let (mut accel, singles, polygons) = (all.accel(), all.singles(), all.polygons());
        let random = &mut Random(3);
        let mut tally = Tally::default();
        for i in 0..600 {
            let scale = 10f64.powf(random.f64() * 40.0 - 29.0);
            let tilt = random.direction() * 0.1 * scale;
            let (origin, direction) = match i % 3 {
                0 => (DVec3::ZERO, DVec3::Z + tilt / scale),
                1 => (DVec3::Z * scale, DVec3::Z + tilt / scale),
                _ => (tilt + DVec3::Z * scale, -DVec3::Z),
            };
            let ray = Ray::new(origin.as_vec3(), direction.as_vec3());
            let answer = ask_one(&mut accel, ray);
            let brute = singles.hits(&ray);
            assert_eq!(bits(answer.0), bits(brute.first().copied()), "{ray:?}");
            assert_eq!(answer.1, !brute.is_empty());
            check(&polygons, &ray, answer, &mut tally);
        }
        println!("{} triangles: {tally:?}", nested.len());
        assert!(tally.hits > 400 && tally.unsure < 100, "{tally:?}");
    }
}

/// Points on a line, which have no area and are never hit, and small triangles whose centres lie on one: boxes
/// without extent and centres that no axis but one tells apart.
#[test]
fn points_on_a_line_hide_nothing() {
    for direction in [Vec3::X, Vec3::Z, Vec3::new(1.0, -2.0, 0.5)] {
        let points: Vec<[Vec3; 3]> = (0..2000).map(|i| [direction * (i as f32 - 1000.0); 3]).collect();
        assert_eq!(
            ask_one(&mut Primitives::of(&points).accel(), Ray::new(-direction * 2e3, direction)),
            (None, false)
        );
        let mut all = Primitives::of(&points);
        all.triangles.insert(700, FACE);
        assert_eq!(ask_one(&mut all.accel(), AHEAD).0.map(|h| (h.t, h.prim)), Some((2.0, 700)));
    }
    let row: Vec<[Vec3; 3]> = (0..2000).map(|i| FACE.map(|p| p * 0.25 + Vec3::Z * i as f32)).collect();
    let mut accel = Primitives::of(&row).accel();
    for i in 0..2000 {
        let ray = Ray { origin: Vec3::Z * i as f32, ..AHEAD };
        assert_eq!(ask_one(&mut accel, ray).0.map(|h| (h.t, h.prim)), Some((0.5, i)));
    }
}

/// Coordinates up to 1e12, the documented limit, beside ordinary ones: nothing overflows, the small are hit where the
/// large leave them room.
#[test]
fn coordinates_up_to_1e12_are_right() {
    let random = &mut Random(19);
    let mut all = Primitives::default();
    for i in 0..200 {
        let size = 10f64.powf(random.f64() * 13.0 - 1.0);
        let mut corner = || (random.direction() * size).as_vec3();
        let (a, b, c) = (corner(), corner(), corner());
        if i % 3 == 0 { all.quad(a, (b - a) * 0.4, (c - a) * 0.4) } else { all.triangle([a, b, c]) }
    }
    let far = 1e12;
    all.triangle([Vec3::new(-far, -far, far), Vec3::new(far, -far, far), Vec3::new(0.0, far, far)]);
    let (mut accel, singles, polygons) = (all.accel(), all.singles(), all.polygons());
    let (mut tally, mut prims) = (Tally::default(), HashSet::new());
    for i in 0..3000 {
        let origin = (random.direction() * 10f64.powf(random.f64() * 14.0 - 2.0)).as_vec3();
        let target = (random.direction() * 10f64.powf(random.f64() * 13.0 - 1.0)).as_vec3();
        let direction = if i % 2 == 0 { target - origin } else { (target - origin).normalize() };
        let ray = Ray::new(origin, direction);
        let answer = ask_one(&mut accel, ray);
        assert_eq!(bits(answer.0), bits(singles.hits(&ray).first().copied()), "{ray:?}");
        check(&polygons, &ray, answer, &mut tally);
        prims.extend(answer.0.map(|h| h.prim));
    }
    println!("{tally:?}, {} primitives", prims.len());
    assert!(tally.hits > 2000 && tally.unsure < 100, "the case is too easy: {tally:?}");
    assert!(prims.len() > 60, "only {} primitives are seen", prims.len());
}

/// A triangle so small and far that its edge functions round to zero is not hit by rays that pass far beside it: alone, as
/// one of a few in a leaf, and behind a large one. (Zero counts as inside, for the sake of shared edges.)
#[test]
fn small_triangles_are_not_hit_from_beside() {
    let random = &mut Random(43);
    let (mut naive, mut tally) = (0, Tally::default());
    for i in 0..3000 {
        let place = random.direction();
        let mut corner = || (place + random.direction() * 1e-7).as_vec3();
        let mut all = Primitives::default();
        if i % 2 == 0 {
            all.triangle([corner(), corner(), corner()])
        } else {
            all.quad(corner(), corner() - corner(), corner() - corner())
        }
        if i % 3 == 0 {
            all.triangle(FACE.map(|p| p * 5.0 - Vec3::Z * 15.0));
        }
        let (mut accel, polygons) = (all.accel(), all.polygons());
        for _ in 0..100 {
            let ray = Ray::new((random.direction() * 3.0).as_vec3(), random.direction().as_vec3());
            naive += u32::from(!polygons.is_empty() && zero_edges(&polygons[0].1, &ray));
            check(&polygons, &ray, ask_one(&mut accel, ray), &mut tally);
        }
    }
    println!("{naive} rays beside with all signs right or zero, {tally:?}");
    assert!(naive > 100 && tally.misses > 100_000, "the case is too easy: {naive}, {tally:?}");
}

/// The naive rule: inside when no two edge functions, rounded, have different signs and one is not zero.
fn zero_edges(corners: &[Vec3], ray: &Ray) -> bool {
    let sheared: Vec<_> = corners
        .iter()
        .map(|&c| {
            let v = c - ray.origin;
            let slope = ray.direction / ray.direction.z;
            (v.x - slope.x * v.z, v.y - slope.y * v.z)
        })
        .collect();
    let edges = (0..sheared.len()).map(|i| (sheared[i], sheared[(i + 1) % sheared.len()]));
    let signs: Vec<f32> = edges.map(|(a, b)| b.0 * a.1 - b.1 * a.0).collect();
    let (low, high) = signs.iter().fold((0f32, 0f32), |(l, h), &s| (l.min(s), h.max(s)));
    (low == 0.0) != (high == 0.0)
}

/// Triangles, parallelograms, disks and spheres around 0, seen along every axis.
fn around() -> Primitives {
    let mut all = Primitives::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let turn = |p: Vec3| {
                let mut q = Vec3::ZERO;
                (q[axis], q[(axis + 1) % 3], q[(axis + 2) % 3]) = (p.z * side, p.x, p.y);
                q
            };
            all.triangle(FACE.map(turn));
            all.quad(turn(FACE[0] * 2.0), turn(Vec3::X * 4.0), turn(Vec3::Y * 4.0));
            all.disks.extend(Disk::new(turn(Vec3::Z * 5.0), turn(Vec3::X), turn(Vec3::Y), DVec3::Z));
            all.spheres.push(Sphere { center: turn(Vec3::Z * 9.0), radius: 2.0, inward: false });
        }
    }
    all
}

/// NaN, infinities, zeros of both signs, denormal and huge numbers, in every place of a ray.
#[test]
fn strange_rays_are_answered_rightly_or_miss() {
    let values = [0.0, -0.0, 1.0, -1.0, 0.3, 1e-42, -1e-42, 1e-30, 1e-20, 1e-7, 1e12, 1e30, -1e30, f32::MAX];
    let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
    let values: Vec<f32> = values.into_iter().chain(odd).collect();
    let (all, random) = (around(), &mut Random(31));
    let mut pick = || values[(random.f64() * values.len() as f64) as usize];
    let mut asked = Vec::new();
    for i in 0..60_000 {
        let mut ray = Ray::new(Vec3::new(0.1, 0.2, -0.15), Vec3::new(0.2, -0.1, 1.0));
        match i % 4 {
            0 => ray.direction = Vec3::new(pick(), pick(), pick()),
            1 => ray.origin = Vec3::new(pick(), pick(), pick()),
            2 => ray.direction[i / 4 % 3] = pick(),
            _ => {
                (ray.origin, ray.direction) =
                    (Vec3::new(pick(), pick(), pick()), Vec3::new(pick(), pick(), pick()))
            }
        }
        if i % 5 == 0 {
            ray.t_max = pick();
        }
        asked.push((ray, PrimRange::NONE));
    }
    let answers = ask(&mut all.accel(), &asked);
    let (singles, polygons) = (all.singles(), all.polygons());
    let (mut hits, mut strange) = (0, 0);
    for ((ray, _), (hit, occluded)) in asked.iter().zip(answers) {
        assert_eq!(hit.is_some(), occluded, "{ray:?}");
        if !(ray.origin.is_finite() && ray.direction.is_finite())
            || ray.t_max.is_nan()
            || ray.direction == Vec3::ZERO
        {
            strange += 1;
            assert_eq!(hit, None, "{ray:?}");
        }
        let Some(hit) = hit else { continue };
        hits += 1;
        assert!(hit.t > 0.0 && hit.t < ray.t_max, "{hit:?} {ray:?}");
        assert!(singles.hits(ray).iter().any(|h| bits(Some(*h)) == bits(Some(hit))), "{hit:?} {ray:?}");
        if let Some((_, corners)) = polygons.iter().find(|p| p.0 == hit.prim) {
            let corners: Vec<DVec3> = corners.iter().map(|c| c.as_dvec3()).collect();
            let slack = rounding(&corners, ray.origin.as_dvec3());
            match polygon(&corners, ray, slack) {
                Verdict::Miss => panic!("nothing is there: {hit:?} {ray:?}"),
                Verdict::Hit { t, off, .. } => {
                    assert!((f64::from(hit.t) - t).abs() <= off, "{t}: {hit:?} {ray:?}")
                }
                Verdict::Unsure => {}
            }
        }
    }
    println!("{hits} hits, {strange} that cannot hit");
    assert!(hits > 5_000 && strange > 10_000, "the case is too easy: {hits} {strange}");
}

/// Directions need not be unit vectors: from 1e-10 to 1e30 the nearest is found, at a distance to match. Zero components
/// of either sign make no difference.
#[test]
fn directions_of_any_length_find_the_same() {
    let (mut accel, random) = (around().accel(), &mut Random(37));
    let mut zeros = 0;
    for i in 0..3000 {
        let origin = (random.direction() * 1.9 * random.f64()).as_vec3();
        let mut direction = random.direction().as_vec3();
        if i % 3 == 0 {
            direction[i / 3 % 3] = 0.0;
            direction[i / 5 % 3] = 0.0;
            direction = direction.normalize();
        }
        let reference = ask_one(&mut accel, Ray::new(origin, direction)).0;
        for length in [1e-10f32, 1e-5, 3.0, 1e9, 1e30] {
            let hit = ask_one(&mut accel, Ray::new(origin, direction * length)).0;
            let same = |h: Hit, r: Hit| h.prim == r.prim && (h.t * length / r.t - 1.0).abs() < 1e-4;
            let clear = |r: Hit| r.uv[0] > 1e-4 && r.uv[1] > 1e-4 && r.uv[0] + r.uv[1] < 0.9999;
            match (hit, reference) {
                (Some(h), Some(r)) if same(h, r) => {}
                (None, None) => {}
                // At an edge the rounding of the direction decides.
                (_, Some(r)) => assert!(!clear(r), "{hit:?} instead of {r:?}, {length}"),
                (Some(h), None) => assert!(!clear(h), "{h:?} instead of nothing, {length}"),
            }
        }
        let turned = direction.map(|x| if x == 0.0 { -x } else { x });
        zeros += u32::from(direction.min_element() == 0.0 || direction.max_element() == 0.0 || i % 3 == 0);
        let other = ask_one(&mut accel, Ray::new(origin, turned)).0;
        assert_eq!(other.map(|h| (h.t, h.prim)), reference.map(|h| (h.t, h.prim)), "{origin} {direction}");
    }
    assert!(zeros > 500);
}
