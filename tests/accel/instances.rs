//! A group shown by an instance is the group's primitives moved there, wherever and however: turned, stretched, mirrored,
//! sheared, far away.
//!
//! A ray is taken into the group's space and rounded there: as if every corner were moved in the world by the rounding
//! unit times the condition of the map times the reach of ray and instance. The test grants 16 such units.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use crate::support::accel::{
    Answer, Primitives, Random, Tally, Verdict, ask, ask_one, bits, check_verdicts, polygon, rounding,
};
use pointillist::tracer::accel::{Accel, Hit, Instance, PrimRange, PrimitiveGroup, Ray, Shapes};
use pointillist::tracer::shape::{Disk, Sphere};

const U: f64 = 1.0 / (1 << 24) as f64;

/// Primitives, groups of them, and instances.
#[derive(Default)]
struct World {
    all: Primitives,
    groups: Vec<PrimitiveGroup>,
    instances: Vec<Instance>,
}

impl World {
    fn accel(&self) -> Accel {
        let Primitives { triangles, quads, disks, spheres, .. } = &self.all;
        let (disks, spheres) = (disks.clone(), spheres.clone());
        let shapes = Shapes { triangles, quads, disks, spheres, ..Shapes::default() };
        Accel::new(shapes, &self.groups, &self.instances)
    }

    /// Adds `count` triangles, half as many parallelograms, disks and spheres in a ball of radius `size`; a group of them
    /// unless `direct`.
    fn add(&mut self, random: &mut Random, count: usize, size: f64, direct: bool) {
        let mut point = |reach: f64| (random.direction() * size * reach * random.f64()).as_vec3();
        let all = &mut self.all;
        let counts =
            |all: &Primitives| [all.triangles.len(), all.disks.len(), all.spheres.len()].map(|n| n as u32);
        let from = counts(all);
        for i in 0..count {
            let a = point(1.0);
            all.triangle([a, a + point(0.5), a + point(0.5)]);
            if i % 2 == 0 {
                all.quad(point(1.0), point(0.4), point(0.4));
                all.disks.extend(Disk::new(point(1.0), point(0.2), point(0.2), DVec3::Z));
                all.spheres.push(Sphere {
                    center: point(1.0),
                    radius: (0.1 * size) as f32,
                    inward: i % 4 == 0,
                });
            }
        }
        let to = counts(all);
        if !direct {
            let [triangles, disks, spheres] = [0, 1, 2].map(|i| from[i]..to[i]);
            self.groups.push(PrimitiveGroup { triangles, disks, spheres, ..PrimitiveGroup::default() });
        }
    }

    fn show(&mut self, group: usize, to_world: DAffine3) {
        self.instances.push(Instance { group: group as u32, to_world });
    }

    /// The verdict on every primitive in every place where an instance shows it.
    fn verdicts(&self, ray: &Ray) -> Vec<(u32, u32, Verdict)> {
        let all = &self.all;
        let (disks, spheres) = (all.triangles.len() as u32, (all.triangles.len() + all.disks.len()) as u32);
        let grouped = |of: fn(&PrimitiveGroup) -> &std::ops::Range<u32>, i: u32| {
            self.groups.iter().position(|g| of(g).contains(&i))
        };
        let mut found = Vec::new();
        let mut each = |id: u32, group: Option<usize>, judge: &dyn Fn(DAffine3, f64) -> Verdict| match group {
            None => found.push((id, Hit::DIRECT, judge(DAffine3::IDENTITY, 0.0))),
            Some(group) => {
                let shown = self.instances.iter().enumerate().filter(|(_, i)| i.group as usize == group);
                found.extend(
                    shown.map(|(i, shown)| (id, i as u32, judge(shown.to_world, slack(shown.to_world, ray)))),
                );
            }
        };
        for (id, corners) in all.polygons() {
            each(id, grouped(|g| &g.triangles, id), &|m, slack| {
                let corners: Vec<DVec3> = corners.iter().map(|c| m.transform_point3(c.as_dvec3())).collect();
                polygon(&corners, ray, slack + condition(m) * rounding(&corners, ray.origin.as_dvec3()))
            });
        }
        for (i, disk) in (0..).zip(&all.disks) {
            each(disks + i, grouped(|g| &g.disks, i), &|m, slack| on_disk(disk, m, ray, slack));
        }
        for (i, sphere) in (0..).zip(&all.spheres) {
            each(spheres + i, grouped(|g| &g.spheres, i), &|m, slack| on_sphere(sphere, m, ray, slack));
        }
        found
    }
}

fn norm(m: DMat3) -> f64 {
    m.to_cols_array().iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn condition(m: DAffine3) -> f64 {
    if m == DAffine3::IDENTITY { 1.0 } else { norm(m.matrix3) * norm(m.matrix3.inverse()) }
}

fn slack(m: DAffine3, ray: &Ray) -> f64 {
    16.0 * U * condition(m) * (ray.origin.as_dvec3().length() + m.translation.length())
}

/// Judges what is far from grazing only. `t` is a root of `a t² + 2 b t + c` or of a plane; `room` says how far the
/// ray passes inside (positive) in units of the extent.
fn curved(roots: &[f64], room: f64, ray: &Ray, off: f64) -> Verdict {
    let known = |t: f64| {
        if t < -off || t > f64::from(ray.t_max) + off {
            Some(false)
        } else {
            (t > off && t < f64::from(ray.t_max) - off).then_some(true)
        }
    };
    if room < -0.05 {
        return Verdict::Miss;
    }
    if room < 0.05 {
        return Verdict::Unsure;
    }
    for &t in roots {
        match known(t) {
            None => return Verdict::Unsure,
            Some(true) => return Verdict::Hit { t, off, uv: [0.0; 2], uv_off: 0.0 },
            Some(false) => {}
        }
    }
    Verdict::Miss
}

fn on_sphere(sphere: &Sphere, m: DAffine3, ray: &Ray, slack: f64) -> Verdict {
    let to_group = m.inverse();
    let o = to_group.transform_point3(ray.origin.as_dvec3()) - sphere.center.as_dvec3();
    let d = to_group.transform_vector3(ray.direction.as_dvec3());
    let (a, b, r) = (d.length_squared(), o.dot(d), f64::from(sphere.radius));
    let nearest = (o - d * (b / a)).length();
    let half = (r * r - nearest * nearest).max(0.0).sqrt() / a.sqrt();
    // Seen at a cosine of at least 0.3, where the room is 0.05.
    let off = 4.0 * granted(m, ray, slack, o.length()) / ray.direction.as_dvec3().length();
    curved(&[-b / a - half, -b / a + half], 1.0 - nearest / r, ray, off)
}

fn on_disk(disk: &Disk, m: DAffine3, ray: &Ray, slack: f64) -> Verdict {
    let to_group = m.inverse();
    let o = to_group.transform_point3(ray.origin.as_dvec3()) - disk.center.as_dvec3();
    let d = to_group.transform_vector3(ray.direction.as_dvec3());
    let (x, y) = (disk.a.as_dvec3(), disk.b.as_dvec3());
    let n = x.cross(y);
    if (o - d * (o.dot(d) / d.length_squared())).length() > 1.1 * x.length().hypot(y.length()) {
        return Verdict::Miss;
    }
    let t = -o.dot(n) / d.dot(n);
    let p = DMat3::from_cols(x, y, n).inverse() * (o + d * t);
    let cosine = (d.dot(n) / (d.length() * n.length())).abs();
    // A thin ellipse, or one seen edge-on, may be hit or not.
    if cosine < 0.05 || n.length() < 0.05 * x.length().max(y.length()).powi(2) {
        return Verdict::Unsure;
    }
    let off = 2.0 * granted(m, ray, slack, o.length()) / cosine / ray.direction.as_dvec3().length();
    curved(&[t], 1.0 - p.x.hypot(p.y), ray, off)
}

/// Rounding along the ray, in the world: that of the ray's way into the group and that of the distance `reach` there.
fn granted(m: DAffine3, ray: &Ray, slack: f64, reach: f64) -> f64 {
    let stretch = if slack == 0.0 { 1.0 } else { norm(m.matrix3) * condition(m) };
    slack * condition(m) + 16.0 * U * (stretch * reach + ray.origin.as_dvec3().length())
}

/// Maps of every kind.
fn maps(random: &mut Random) -> Vec<(&'static str, DAffine3)> {
    let turn = |random: &mut Random| DAffine3::from_axis_angle(random.direction(), 6.0 * random.f64());
    let shear = DMat3::from_cols(DVec3::X, DVec3::new(0.8, 1.0, 0.0), DVec3::new(-0.5, 0.3, 1.0));
    let at = |v: DVec3| DAffine3::from_translation(v);
    vec![
        ("moved", at(DVec3::new(0.7, -0.3, 0.2))),
        ("turned", at(DVec3::X) * turn(random)),
        ("stretched", turn(random) * DAffine3::from_scale(DVec3::new(0.2, 1.0, 3.0)) * turn(random)),
        ("mirrored", at(DVec3::Y * 0.5) * DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0)) * turn(random)),
        ("sheared", DAffine3::from_mat3(shear) * turn(random)),
        ("far away", at(DVec3::new(3e3, -2e3, 1e3)) * turn(random)),
        ("tiny", turn(random) * DAffine3::from_scale(DVec3::splat(1e-4))),
        ("huge and inside out", at(DVec3::Z * 1e3) * DAffine3::from_scale(DVec3::splat(-1e4)) * turn(random)),
    ]
}

/// Rays between points around what `m` shows, not all of unit length, some that end.
fn rays(random: &mut Random, m: DAffine3, count: usize) -> Vec<Ray> {
    let mut point =
        |reach: f64| m.transform_point3(random.direction() * (reach * random.f64().cbrt())).as_vec3();
    (0..count)
        .map(|i| {
            let (origin, target) = (point(1.8), point(1.0));
            let direction = if i % 3 == 0 { target - origin } else { (target - origin).normalize() };
            Ray { origin, direction, t_max: if i % 6 == 3 { 1.0 } else { f32::INFINITY } }
        })
        .collect()
}

/// Asks, and asserts that the answers are right, also with what was hit skipped.
fn check_world(world: &World, accel: &mut Accel, rays: &[Ray], tally: &mut Tally) -> Vec<Answer> {
    let asked: Vec<_> = rays.iter().map(|&r| (r, PrimRange::NONE)).collect();
    let answers = ask(accel, &asked);
    for (ray, &answer) in rays.iter().zip(&answers) {
        let verdicts = world.verdicts(ray);
        check_verdicts(verdicts.iter().copied(), ray, answer, tally);
        let Some(hit) = answer.0 else { continue };
        let skip = PrimRange { first: hit.prim.saturating_sub(2), end: hit.prim + 1 };
        let (_, occluded) = ask(accel, &[(*ray, skip)])[0];
        let mut others = verdicts.iter().filter(|v| !skip.contains(v.0)).map(|v| v.2);
        if others.clone().any(|v| matches!(v, Verdict::Hit { .. })) {
            assert!(occluded, "{ray:?} {skip:?}");
        } else if others.all(|v| matches!(v, Verdict::Miss)) {
            assert!(!occluded, "{ray:?} {skip:?}");
        }
    }
    answers
}

/// One group, one instance and one kind of map at a time, beside primitives of the top level.
#[test]
fn an_instance_is_its_group_moved() {
    let random = &mut Random(2);
    for (kind, m) in maps(random) {
        let mut world = World::default();
        world.add(random, 5, 1.0, true);
        world.add(random, 24, 1.0, false);
        world.show(0, m);
        let mut tally = Tally::default();
        let answers = check_world(&world, &mut world.accel(), &rays(random, m, 1500), &mut tally);
        let shown = answers.iter().filter(|a| a.0.is_some_and(|h| h.instance == 0)).count();
        println!("{kind}: {tally:?}, {shown} of the instance");
        assert!(shown > 300 && tally.hits > 200, "the case is too easy");
        assert!(tally.unsure < 500, "the bound says too little: {tally:?}");
    }
}

/// Three groups, ten instances that reach into each other, and primitives of the world between them.
#[test]
fn instances_overlap() {
    let random = &mut Random(5);
    let mut world = World::default();
    world.add(random, 6, 1.0, false);
    world.add(random, 8, 1.5, true);
    world.add(random, 9, 1.0, false);
    world.add(random, 12, 0.5, false);
    let maps: Vec<DAffine3> = maps(random).into_iter().map(|m| m.1).collect();
    for (i, &m) in maps[..5].iter().enumerate() {
        world.show(i % 3, m);
        world.show((i + 1) % 3, m * DAffine3::from_translation(DVec3::splat(0.2)));
    }
    let mut tally = Tally::default();
    let answers = check_world(
        &world,
        &mut world.accel(),
        &rays(random, DAffine3::from_scale(DVec3::splat(1.5)), 2500),
        &mut tally,
    );
    let hits: Vec<Hit> = answers.into_iter().filter_map(|a| a.0).collect();
    println!("{tally:?}");
    for instance in (0..10).chain([Hit::DIRECT]) {
        let count = hits.iter().filter(|h| h.instance == instance).count();
        assert!(count > 20, "instance {instance} was hit {count} times");
    }
    let disks = world.all.triangles.len() as u32;
    let spheres = disks + world.all.disks.len() as u32;
    let kinds = [0..disks, disks..spheres, spheres..u32::MAX]
        .map(|k| hits.iter().filter(|h| k.contains(&h.prim)).count());
    assert!(kinds.iter().all(|&n| n > 100), "{kinds:?}");
    assert!(tally.unsure < 700, "{tally:?}");
}

/// An instance that does not move its group changes no digit; directions twice as long halve every distance exactly.
#[test]
fn where_nothing_is_rounded_no_digit_changes() {
    let random = &mut Random(8);
    let mut world = World::default();
    world.add(random, 60, 1.0, false);
    world.show(0, DAffine3::IDENTITY);
    let (mut shown, mut direct) = (world.accel(), world.all.accel());
    let mut hits = 0;
    for ray in rays(random, DAffine3::IDENTITY, 3000) {
        let (answer, expected) = (ask_one(&mut shown, ray), ask_one(&mut direct, ray));
        let expected = expected.0.map(|h| Hit { instance: 0, ..h });
        assert_eq!((bits(answer.0), answer.1), (bits(expected), expected.is_some()), "{ray:?}");
        let long = Ray { direction: ray.direction * 4.0, t_max: ray.t_max * 0.25, ..ray };
        let quarter = expected.map(|h| Hit { t: h.t * 0.25, ..h });
        assert_eq!(bits(ask_one(&mut shown, long).0), bits(quarter), "{ray:?}");
        hits += u32::from(expected.is_some());
    }
    assert!(hits > 1000, "{hits}");
}

/// The same place many times: equal distances, the first instance is the answer; the world's own primitives win by id alone.
#[test]
fn coincident_instances_have_one_answer() {
    let face = [Vec3::new(-1.0, -1.0, 2.0), Vec3::new(1.0, -1.0, 2.0), Vec3::new(0.0, 1.0, 2.0)];
    let ray = Ray::new(Vec3::ZERO, Vec3::Z);
    for (count, own) in [(1, 0), (2, 0), (1000, 0), (3, 1), (1000, 1)] {
        // Id `own` is in the group, the other one stands in the world.
        let group = PrimitiveGroup { triangles: own..own + 1, ..PrimitiveGroup::default() };
        let mut world = World { all: Primitives::of(&[face, face]), groups: vec![group], ..World::default() };
        (0..count).for_each(|_| world.show(0, DAffine3::IDENTITY));
        let mut accel = world.accel();
        let instance = if own == 0 { 0 } else { Hit::DIRECT };
        let hit = ask_one(&mut accel, ray).0.map(|h| (h.t, h.prim, h.instance));
        assert_eq!(hit, Some((2.0, 0, instance)), "{count} times {own}");
        for (first, end, occluded) in [(0, 1, true), (1, 2, true), (0, 2, false)] {
            assert_eq!(ask(&mut accel, &[(ray, PrimRange { first, end })])[0].1, occluded);
        }
    }
}

/// Ten thousand instances on a grid: each is found where it stands, and nothing between them.
#[test]
fn ten_thousand_instances_are_found() {
    let random = &mut Random(10);
    let mut world = World::default();
    let top = [Vec3::new(-0.3, -0.3, 0.1), Vec3::new(0.3, -0.3, 0.1), Vec3::new(0.0, 0.4, 0.1)];
    world.all = Primitives::of(&[top, top.map(|p| p - Vec3::Z * 0.2)]);
    world.all.spheres.push(Sphere { center: Vec3::ZERO, radius: 0.05, inward: false });
    world.groups.push(PrimitiveGroup { triangles: 0..2, spheres: 0..1, ..PrimitiveGroup::default() });
    let place = |i: usize| DVec3::new((i % 100) as f64, (i / 100) as f64, (i % 7) as f64);
    for i in 0..10_000 {
        let turn = DAffine3::from_rotation_z(6.0 * random.f64());
        world.show(0, DAffine3::from_translation(place(i)) * turn);
    }
    let mut accel = world.accel();
    for i in 0..10_000 {
        let from = |z: f32| place(i).as_vec3() + Vec3::new(0.01, 0.02, z);
        for (z, prim) in [(3.0, 0), (0.0, 1), (-0.03, 1)] {
            let z = if prim == 1 { z - 0.06 } else { z };
            let hit = ask_one(&mut accel, Ray::new(from(z), -Vec3::Z)).0.unwrap_or_else(|| panic!("{i}"));
            let plane = if prim == 0 { 0.1 } else { -0.1 };
            assert_eq!((hit.instance, hit.prim), (i as u32, prim));
            assert!((hit.t - (z - plane)).abs() < 2e-5, "{hit:?}");
        }
        let between = Ray::new(from(9.0) + Vec3::new(0.5, 0.5, 0.0), -Vec3::Z);
        assert_eq!(ask_one(&mut accel, between), (None, false));
    }
}

/// Empty groups, groups without instances, and scenes that hold nothing else.
#[test]
fn empty_and_hidden_groups_are_not_seen() {
    let random = &mut Random(12);
    let ray = Ray::new(Vec3::new(0.0, 0.0, -5.0), Vec3::Z);
    let mut world = World { groups: vec![PrimitiveGroup::default()], ..World::default() };
    assert_eq!(ask_one(&mut world.accel(), ray), (None, false));
    world.show(0, DAffine3::IDENTITY);
    world.show(0, DAffine3::from_scale(DVec3::splat(2.0)));
    assert_eq!(ask_one(&mut world.accel(), ray), (None, false));
    // A group that nothing shows stands nowhere.
    world.add(random, 50, 1.0, false);
    let many = rays(random, DAffine3::IDENTITY, 500);
    let asked: Vec<_> = many.iter().map(|&r| (r, PrimRange::NONE)).collect();
    assert!(ask(&mut world.accel(), &asked).iter().all(|&a| a == (None, false)));
    world.show(1, DAffine3::IDENTITY);
    let hits =
        ask(&mut world.accel(), &asked).iter().filter(|a| a.0.is_some_and(|h| h.instance == 2)).count();
    assert!(hits > 100, "{hits}");
    for odd in [Vec3::NAN, Vec3::INFINITY, Vec3::ZERO] {
        assert_eq!(ask_one(&mut world.accel(), Ray::new(Vec3::ZERO, odd)), (None, false));
    }
}
