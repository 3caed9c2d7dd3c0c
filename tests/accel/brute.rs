//! The tree gives the answers of brute force: the hit it finds is the nearest over all primitives tested alone, bit for bit, with the
//! lowest id among equals; and it agrees with exact geometry within a bound.

use std::cell::Cell;

use glam::{DVec3, Vec3};
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};

use crate::support::accel::{Answer, Primitives, Random, Singles, Tally, ask, bits, check};
use pointillist::tracer::accel::{Accel, Hit, PrimRange, Ray};
use pointillist::tracer::shape::{Cylinder, Disk, Sphere};

/// A parallelogram or a triangle: a corner and two sides.
type Shape = (bool, [Vec3; 3]);

/// Integers for the most part: vertices, edges and planes meet exactly.
fn coordinate() -> impl Strategy<Value = f32> + Clone {
    prop_oneof![5 => (-4i32..=4).prop_map(|i| i as f32), 1 => -4f32..4.0]
}

fn vertex() -> impl Strategy<Value = Vec3> + Clone {
    [coordinate(), coordinate(), coordinate()].prop_map(Vec3::from_array)
}

/// One shape, or a few that depend on each other.
fn shapes() -> impl Strategy<Value = Vec<Shape>> + Clone {
    let anywhere = ([vertex(), vertex(), vertex()], any::<bool>())
        .prop_map(|([a, b, c], quad)| vec![(quad, [a, b - a, c - a])]);
    // In a plane across an axis.
    let flat = ([vertex(), vertex(), vertex()], any::<bool>(), 0..3usize, -2i32..=2).prop_map(
        |(corners, quad, axis, at)| {
            let [a, b, c] = corners.map(|mut v| {
                v[axis] = at as f32;
                v
            });
            vec![(quad, [a, b - a, c - a])]
        },
    );
    // A rectangle along the axes, with a neighbour that shares an edge.
    let pair = (vertex(), 0..3usize, 1..4i32, 1..4i32, any::<[bool; 2]>()).prop_map(
        |(a, axis, width, height, quad)| {
            let (mut x, mut y) = (Vec3::ZERO, Vec3::ZERO);
            (x[(axis + 1) % 3], y[(axis + 2) % 3]) = (width as f32, height as f32);
            [(a, 0), (a + x, 1)].into_iter().flat_map(|(at, i)| rectangle(at, x, y, quad[i])).collect()
        },
    );
    let needle = (vertex(), vertex(), vertex(), -20..-2i32).prop_map(|(a, along, across, power)| {
        vec![(false, [a, along, along * 0.7 + across * 2f32.powi(power)])]
    });
    // Four around a point.
    let fan = vertex().prop_map(|p| {
        let corner = |i: i32| {
            Vec3::new([1.0, 0.0, -1.0, 0.0][i as usize % 4], [0.0, 1.0, 0.0, -1.0][i as usize % 4], 1.0)
        };
        (0..4).map(|i| (false, [p, corner(i), corner(i + 1)])).collect()
    });
    prop_oneof![3 => anywhere, 2 => flat, 2 => pair, 2 => needle, 1 => fan]
}

fn rectangle(a: Vec3, x: Vec3, y: Vec3, quad: bool) -> Vec<Shape> {
    if quad { vec![(true, [a, x, y])] } else { vec![(false, [a, x, x + y]), (false, [a, x + y, y])] }
}

/// A ray described relative to the scene, see [`aim`].
#[derive(Clone, Debug)]
struct Aim {
    /// From a point of the grid, or from a point of a primitive.
    origin: (Vec3, Option<(usize, [f32; 2])>),
    /// At a point of the grid, or at a corner, an edge or the inside of a primitive.
    target: (Vec3, Option<(usize, [f32; 2])>),
    /// Components of the direction that are made zero.
    zero: [bool; 3],
    t_max: f32,
}

fn weights() -> impl Strategy<Value = [f32; 2]> + Clone {
    let corner = prop_oneof![Just([0.0, 0.0]), Just([1.0, 0.0]), Just([0.0, 1.0])];
    let edge = (0f32..1.0, 0..3).prop_map(|(x, which)| [[x, 0.0], [0.0, x], [x, 1.0 - x]][which as usize]);
    let inside = (0f32..1.0, 0f32..1.0).prop_map(|(x, y)| [x, (1.0 - x) * y]);
    prop_oneof![2 => corner, 1 => Just([0.5, 0.0]), 2 => edge, 2 => inside]
}

fn aims() -> impl Strategy<Value = Aim> + Clone {
    let half = vertex().prop_map(|v| v * 0.5);
    let far = vertex().prop_map(|v| v * 3.0 + Vec3::Z * 0.25);
    let place = || proptest::option::weighted(0.6, (0..1000usize, weights()));
    let origin =
        (prop_oneof![half, far, vertex()], proptest::option::weighted(0.2, (0..1000usize, weights())));
    let zero = any::<[u8; 3]>().prop_map(|b| b.map(|b| b < 50));
    let t_max = prop_oneof![4 => Just(f32::INFINITY), 1 => Just(1.0), 1 => Just(0.5), 1 => 0f32..3.0];
    (origin, (vertex(), place()), zero, t_max).prop_map(|(origin, target, zero, t_max)| Aim {
        origin,
        target,
        zero,
        t_max,
    })
}

/// A scene and rays, and the copies, scale and shift that are applied to both.
#[derive(Clone, Debug)]
struct Case {
    shapes: Vec<Vec<Shape>>,
    /// Copies of shapes in the same place, with or without reversed orientation.
    again: Vec<(usize, bool)>,
    aims: Vec<Aim>,
    place: (i32, f32),
}

fn cases() -> impl Strategy<Value = Case> {
    let scale = prop_oneof![4 => Just(0), 1 => Just(-18), 1 => Just(16)];
    let shift = prop_oneof![4 => Just(0.0f32), 1 => Just(256.0), 1 => Just(-3.0)];
    let again = proptest::collection::vec((0..1000usize, any::<bool>()), 0..6);
    (
        proptest::collection::vec(shapes(), 1..14),
        again,
        proptest::collection::vec(aims(), 1..64),
        (scale, shift),
    )
        .prop_map(|(shapes, again, aims, place)| Case { shapes, again, aims, place })
}

impl Case {
    fn primitives(&self) -> Primitives {
        let mut shapes: Vec<Shape> = self.shapes.concat();
        for &(i, turned) in &self.again {
            let (quad, [a, x, y]) = shapes[i % shapes.len()];
            shapes.push((quad, if turned { [a, y, x] } else { [a, x, y] }));
        }
        let mut all = Primitives::default();
        let (size, shift) = (2f32.powi(self.place.0), Vec3::splat(self.place.1));
        for (quad, [a, x, y]) in shapes {
            let (a, x, y) = ((a + shift) * size, x * size, y * size);
            if quad { all.quad(a, x, y) } else { all.triangle([a, a + x, a + y]) }
        }
        all
    }

    fn rays(&self, all: &Primitives) -> Vec<Ray> {
        let (size, shift) = (2f32.powi(self.place.0), Vec3::splat(self.place.1));
        let on = |(grid, place): (Vec3, Option<(usize, [f32; 2])>)| match place {
            Some((i, [u, v])) if !all.triangles.is_empty() => {
                let [a, b, c] = all.triangles[i % all.triangles.len()];
                a + (b - a) * u + (c - a) * v
            }
            _ => (grid + shift) * size,
        };
        let ray = |aim: &Aim| {
            let origin = on(aim.origin);
            let mut direction = on(aim.target) - origin;
            (0..3).filter(|&i| aim.zero[i]).for_each(|i| direction[i] = 0.0);
            Ray { origin, direction, t_max: aim.t_max }
        };
        self.aims.iter().map(ray).collect()
    }
}

/// Asserts that the answers are those of the single primitives; returns how many stand at the nearest distance.
fn check_singles(singles: &Singles, (ray, skip): (Ray, PrimRange), (hit, occluded): Answer) -> usize {
    let hits = singles.hits(&ray);
    let first: Option<Hit> = hits.first().copied();
    assert_eq!(bits(hit), bits(first), "{hit:?} instead of {first:?}, {ray:?}");
    assert_eq!(occluded, hits.iter().any(|h| !skip.contains(h.prim)), "{ray:?} {skip:?} {hits:?}");
    hits.iter().filter(|h| h.t == hits[0].t).count()
}

/// Asks rays with nothing skipped, then with what was hit, and all up to it, skipped.
fn check_all(accel: &mut Accel, singles: &Singles, rays: &[Ray]) -> (Vec<Answer>, usize) {
    let asked: Vec<_> = rays.iter().map(|&r| (r, PrimRange::NONE)).collect();
    let answers = ask(accel, &asked);
    let ties = answers.iter().zip(&asked).filter(|(a, q)| check_singles(singles, **q, **a) > 1).count();
    let hits = answers.iter().zip(rays).filter_map(|(a, &ray)| Some((ray, a.0?.prim)));
    let skipped: Vec<_> =
        hits.flat_map(|(ray, id)| [id, 0].map(|first| (ray, PrimRange { first, end: id + 1 }))).collect();
    for (answer, question) in ask(accel, &skipped).into_iter().zip(skipped) {
        check_singles(singles, question, answer);
    }
    (answers, ties)
}

/// Small scenes on the integer grid, with planes, needles, copies and shared edges; rays along edges, within planes, at
/// corners. Every kernel.
#[test]
fn small_scenes_are_brute_force_and_exact() {
    let config = ProptestConfig { cases: 6_000, failure_persistence: None, ..ProptestConfig::default() };
    let mut runner = TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha));
    let (total, tied) = (Cell::new(Tally::default()), Cell::new(0));
    let passed = runner.run(&cases(), |case| {
        let all = case.primitives();
        let rays = case.rays(&all);
        let (answers, ties) = check_all(&mut all.accel(), &all.singles(), &rays);
        tied.set(tied.get() + ties);
        let polygons = all.polygons();
        let mut tally = total.get();
        rays.iter().zip(answers).for_each(|(ray, answer)| check(&polygons, ray, answer, &mut tally));
        total.set(tally);
        Ok(())
    });
    let tally = total.get();
    println!("{tally:?}, {} ties", tied.get());
    passed.unwrap_or_else(|e| panic!("{e}"));
    assert!(tally.hits > 40_000 && tally.misses > 40_000 && tied.get() > 10_000, "the cases are too easy");
    // The reference is not silent about most of it.
    assert!(tally.unsure < tally.hits + tally.misses, "{tally:?}");
}

/// Random triangles, parallelograms, disks, spheres and cylinders by the hundred: trees of several levels.
#[test]
fn the_tree_is_brute_force() {
    for count in [1usize, 2, 3, 7, 40, 700] {
        let random = &mut Random(count as u64);
        let mut point = |size: f64| (random.direction() * size * random.f64()).as_vec3();
        let mut all = Primitives::default();
        for i in 0..count {
            let p = point(10.0);
            match i % 4 {
                0 => all.quad(p, point(2.0), point(2.0)),
                _ => all.triangle([p, p + point(2.0), p + point(2.0)]),
            }
            if i % 5 == 0 {
                all.disks.extend(Disk::new(point(10.0), point(1.0), point(1.0), DVec3::Z));
                all.spheres.push(Sphere { center: point(10.0), radius: 0.4, inward: false });
                all.cylinders.extend(Cylinder::new(point(10.0), [point(0.5), point(0.5), point(3.0)], false));
            }
        }
        let mut rays: Vec<Ray> = (0..2000)
            .map(|i| {
                let o = point(12.0);
                // Every fourth ray aims at a triangle: a scene of one shape is hardly ever hit by chance.
                let [a, b, c] = all.triangles[i % all.triangles.len()];
                let target = if i % 4 == 0 { (a + b + c) / 3.0 } else { point(8.0) };
                Ray { origin: o, direction: (target - o).normalize(), t_max: 15.0 }
            })
            .collect();
        let (answers, _) = check_all(&mut all.accel(), &all.singles(), &rays);
        assert!(answers.iter().any(|a| a.0.is_some()), "the case is too easy");
        // From where they hit: the sign of the distance to what was hit is rounding.
        let hit = rays.iter().zip(&answers).filter_map(|(r, a)| Some(r.origin + r.direction * a.0?.t));
        let spawned: Vec<Ray> = hit.map(|p| Ray::new(p, point(1.0))).collect();
        check_all(&mut all.accel(), &all.singles(), &spawned);
        rays.truncate(1000);
        all = Primitives { disks: Vec::new(), spheres: Vec::new(), cylinders: Vec::new(), ..all };
        let (polygons, mut tally) = (all.polygons(), Tally::default());
        let answers = check_all(&mut all.accel(), &all.singles(), &rays).0;
        rays.iter().zip(answers).for_each(|(ray, answer)| check(&polygons, ray, answer, &mut tally));
        println!("{count} of each: {tally:?}");
        // Without vertices in common hardly a random ray comes near an edge.
        assert!(tally.hits > 0 && tally.misses > 0 && tally.unsure <= 2, "{tally:?}");
    }
}

/// Flat scenes of a thousand and more: a grid of unit squares, all in one plane or in stacked planes, some squares twice;
/// rays at vertices from everywhere, within the plane too. Ties are the rule.
#[test]
fn grids_are_brute_force() {
    let random = &mut Random(29);
    let (mut ties, mut tally) = (0, Tally::default());
    for (axis, layers) in [(0, 1), (1, 1), (2, 1), (2, 4)] {
        let mut all = Primitives::default();
        let side = |i: usize, length: f32| {
            let mut v = Vec3::ZERO;
            v[(axis + i) % 3] = length;
            v
        };
        for i in 0..24 * 24 {
            let at =
                side(1, (i % 24 - 12) as f32) + side(2, (i / 24 - 12) as f32) + side(0, (i % layers) as f32);
            if (i * 7 + i / 24) % 3 == 0 {
                all.quad(at, side(1, 1.0), side(2, 1.0));
            }
            if (i * 7 + i / 24) % 3 != 1 || i % 5 == 0 {
                all.triangle([at, at + side(1, 1.0), at + side(1, 1.0) + side(2, 1.0)]);
                all.triangle([at, at + side(1, 1.0) + side(2, 1.0), at + side(2, 1.0)]);
            }
        }
        let mut grid = |reach: f64| ((random.f64() * 2.0 - 1.0) * reach).round() as f32;
        let rays: Vec<Ray> = (0..1500)
            .map(|i| {
                let mut origin = Vec3::new(grid(13.0), grid(13.0), grid(13.0)) * 0.5;
                if i % 4 == 0 {
                    origin[axis] = 0.0;
                }
                let target = side(1, grid(12.0)) + side(2, grid(12.0)) + side(0, grid(3.0));
                Ray {
                    origin,
                    direction: target - origin,
                    t_max: if i % 3 == 0 { 1.5 } else { f32::INFINITY },
                }
            })
            .collect();
        let (answers, tied) = check_all(&mut all.accel(), &all.singles(), &rays);
        ties += tied;
        let polygons = all.polygons();
        rays.iter().zip(answers).for_each(|(ray, answer)| check(&polygons, ray, answer, &mut tally));
    }
    println!("{ties} ties, {tally:?}");
    assert!(ties > 1000 && tally.hits > 500, "the case is too easy: {ties}");
}
