//! The photon map on inputs that are hard for a tree which splits space, against a loop over all photons.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use pointillist::color::Xyz;
use pointillist::math::random::Random;
use pointillist::scene::desc::{LightDesc, Place, ShapeKind, TwoSidedDesc};
use pointillist::spectrum::Spectrum;
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::integrator::{PhotonTracer, RenderContext};
use pointillist::tracer::photon_map::{
    Beam, Disc, Forest, LEAF, MAX_DEPTH, MortonGrid, Neighbour, Photon, PhotonLayer, QueryScratch, Schedule,
    SortedPhotons,
};
use pointillist::tracer::{Camera, Integrator, Scene};

use crate::Row;
use crate::photon_cases::{Case, by_loop, cases};
use crate::support::agreement::{Method, Plan, repeat};
use crate::support::scenes::{empty, grey, look, material, shape};

/// The points in `generations` parts of about equal size.
fn forest(case: &Case, generations: usize) -> Forest {
    let grid = MortonGrid::new(case.min, case.max);
    let photons = vec![Photon::default(); case.points.len()];
    let part = case.points.len().div_ceil(generations).max(1);
    let mut forest = Forest::default();
    for g in 0..generations {
        let range = (g * part).min(case.points.len())..((g + 1) * part).min(case.points.len());
        let run = SortedPhotons::sorted(&grid, &case.points[range.clone()], &photons[range]);
        forest = forest.grown(&grid, run, &|| true).expect("it is wanted");
    }
    assert_eq!(forest.len(), case.points.len());
    forest
}

/// Where to ask: at photons, near them, in the box, around it.
fn places(case: &Case) -> Vec<Vec3> {
    let mut r = Random(99);
    let side = case.max - case.min;
    let mut all = vec![case.min, case.max, case.min * 0.5 + case.max * 0.5];
    for i in 0..12 {
        if let Some(&p) = case.points.get(i * 251 % case.points.len().max(1)) {
            all.extend([p, p + side * (r.point() - 0.5) * 0.01]);
        }
        all.push(case.min + side * r.point());
        all.push(case.min + side * (r.point() * 3.0 - 1.0));
    }
    all
}

/// The points that a tree keeps whose leaves hold at most [`LEAF`] photons, also where its depth ends.
fn kept_by_short_leaves(case: &Case) -> Vec<Vec3> {
    let grid = MortonGrid::new(case.min, case.max);
    let mut leaves: BTreeMap<u64, u32> = BTreeMap::new();
    let kept = case.points.iter().filter(|&&p| {
        let count = leaves.entry(grid.code(p)).or_default();
        *count += 1;
        *count <= LEAF
    });
    kept.copied().collect()
}

/// Photons that coincide, lie on a line, on a splitting plane, in one cell, outside the box, that are denormal or as large as
/// f32 allows: the nearest are those of a loop over all. A tree of short leaves, as the paper has them, loses what its depth
/// cannot part.
#[test]
fn p8_n21_queries_equal_a_loop_over_all() {
    let mut scratch = QueryScratch::default();
    let (mut queries, mut wrong, mut naive) = (0.0, 0.0, 0.0);
    for case in cases() {
        let short = kept_by_short_leaves(&case);
        let forests = [1, 7, 32].map(|generations| forest(&case, generations));
        let side = (case.max - case.min).max_element().min(f32::MAX);
        let mut found_any = 0;
        for at in places(&case) {
            for radius in [0.0, 0.003 * side, 0.2 * side, 3.0 * side, f32::INFINITY] {
                for wanted in [0, 1, 6, 50, 5000] {
                    let expected = by_loop(&case.points, at, wanted, radius);
                    found_any += expected.len();
                    naive += f64::from(u8::from(by_loop(&short, at, wanted, radius) != expected));
                    let sorted = |found: &[Neighbour]| {
                        let mut d: Vec<f32> = found.iter().map(|n| n.distance2).collect();
                        assert!(d.is_empty() || d.iter().all(|&x| x <= d[0]), "the farthest comes first");
                        d.sort_by(f32::total_cmp);
                        d
                    };
                    for f in &forests {
                        let found = f.nearest(at, radius, wanted, &mut scratch, |_| true).to_vec();
                        queries += 1.0;
                        wrong += f64::from(u8::from(sorted(&found) != expected));
                        for near in &found {
                            assert_eq!((f.position(near) - at).length_squared(), near.distance2);
                        }
                    }
                }
                let expected = by_loop(&case.points, at, usize::MAX, radius);
                for f in &forests {
                    let all = f.nearest(at, radius, usize::MAX, &mut scratch, |_| true);
                    let mut all: Vec<f32> = all.iter().map(|near| near.distance2).collect();
                    all.sort_by(f32::total_cmp);
                    assert_eq!(all, expected, "{}: within {radius} of {at}", case.name);
                }
            }
        }
        assert!(found_any > 0 || case.points.is_empty() || side < 1e-20, "{}: nothing asked", case.name);
    }
    Row {
        case: "P8 N21 photons that coincide, are collinear, in one cell, outside",
        measure: "share of wrong queries",
        figure: wrong / queries,
        // Each was asked of three forests.
        naive: ("leaves of at most 6 photons", 3.0 * naive / queries),
        bound: 0.0,
    }
    .check();
}

/// Photons that a lookup refuses, as those of the other side of a wall, are not among the k.
#[test]
fn refused_photons_do_not_use_up_neighbours() {
    let case = &cases()[0];
    let forest = forest(case, 5);
    let mut scratch = QueryScratch::default();
    let turn = Cell::new(0);
    // Refuses every photon but one in three: eight are found nevertheless.
    let found = forest.nearest(Vec3::splat(0.5), 10.0, 8, &mut scratch, |_| {
        turn.set(turn.get() + 1);
        turn.get() % 3 == 0
    });
    assert_eq!(found.len(), 8);
}

#[test]
fn not_a_number_finds_nothing() {
    let case = &cases()[0];
    let forest = forest(case, 3);
    let mut scratch = QueryScratch::default();
    assert!(forest.nearest(Vec3::NAN, 1.0, 5, &mut scratch, |_| true).is_empty());
    assert!(forest.nearest(Vec3::ZERO, f32::NAN, 5, &mut scratch, |_| true).is_empty());
}

/// The depth at which halving the longest side has parted the points into leaves of [`LEAF`]; it ends at 4 times [`MAX_DEPTH`].
fn unbounded_depth(points: &[Vec3], [lo, hi]: [Vec3; 2], depth: u32) -> u32 {
    if points.len() <= LEAF as usize || depth >= 4 * MAX_DEPTH {
        return depth;
    }
    let axis = (hi - lo).max_position();
    let middle = 0.5 * lo[axis] + 0.5 * hi[axis];
    let (left, right): (Vec<Vec3>, Vec<Vec3>) = points.iter().partition(|p| p[axis] < middle);
    let (mut below, mut above) = (hi, lo);
    (below[axis], above[axis]) = (middle, middle);
    unbounded_depth(&left, [lo, below], depth + 1).max(unbounded_depth(&right, [above, hi], depth + 1))
}

/// The depth is bounded whatever the photons do: each level is a bit of a code of 64.
#[test]
fn p8_n21_depth() {
    let (mut deepest, mut naive) = (0, 0);
    for case in cases() {
        naive = naive.max(unbounded_depth(&case.points, [case.min, case.max], 0));
        for generations in [1, 5] {
            for tree in forest(&case, generations).trees() {
                deepest = deepest.max(tree.depth());
            }
        }
    }
    Row {
        case: "P8 N21 photons that coincide, are collinear, in one cell, outside",
        measure: "depth of the tree",
        figure: f64::from(deepest),
        naive: ("halving until leaves are short, to at most 256", f64::from(naive)),
        bound: f64::from(MAX_DEPTH),
    }
    .check();
    // Evenly spread photons are split down to the leaf's size in about log₂(n / LEAF) steps.
    let even = &cases()[0];
    let f = forest(even, 1);
    let depth = f.trees().next().unwrap().depth();
    let least = (even.points.len() as f32 / LEAF as f32).log2() as u32;
    assert!((least..=least + 8).contains(&depth), "{depth} against {least}");
}

/// A million photons in one point: one long leaf, of which a query looks at no more than it wants where it can, and a density
/// that is finite although the k-th distance is 0.
#[test]
fn n21_a_million_photons_in_one_point() {
    let (mut weighed, mut naive) = (0, 0);
    let n = 1_000_000;
    let p = Vec3::new(0.3, 0.4, 0.5);
    let mut points = vec![p; n];
    points.extend((0..1000).map(|i| Random(i).point()));
    let case = Case { name: "million", min: Vec3::ZERO, max: Vec3::ONE, points };
    let forest = forest(&case, 3);
    for tree in forest.trees() {
        assert!(tree.depth() <= MAX_DEPTH);
    }
    let mut scratch = QueryScratch::default();
    for at in [p, p + Vec3::splat(1e-3), Vec3::ZERO] {
        let taken = Cell::new(0);
        let found = forest.nearest(at, 1.0, 50, &mut scratch, |_| {
            taken.set(taken.get() + 1);
            true
        });
        let mut distances: Vec<f32> = found.iter().map(|n| n.distance2).collect();
        distances.sort_by(f32::total_cmp);
        assert_eq!(distances, by_loop(&case.points, at, 50, 1.0));
        weighed = weighed.max(taken.get());
        let farthest = distances[49];
        naive = naive.max(case.points.iter().filter(|&&q| (q - at).length_squared() <= farthest).count());
        let disc = Disc::new(found, 50, 1.0, 1e-4).unwrap();
        assert_eq!(disc.counted.len(), 49);
        if at == p {
            // 49 photons in the least disc.
            Row {
                case: "N21 k-th distance 0",
                measure: "density, photons per m²",
                figure: 49.0 / f64::from(disc.area),
                naive: ("k / (π r²)", 50.0 / (PI * f64::from(farthest))),
                bound: 2e9,
            }
            .check();
        }
    }
    // Photons no nearer than the farthest found cost a comparison and nothing else. The first levels of three trees are
    // weighed.
    Row {
        case: "N21 a million photons in one point",
        measure: "photons weighed by a query for 50",
        figure: weighed as f64,
        naive: ("all not farther than the 50th", naive as f64),
        bound: 2000.0,
    }
    .check();
    assert_eq!(forest.nearest(p, 1e-6, usize::MAX, &mut scratch, |_| true).len(), n);
}

/// Counting k − 1 of the k nearest is unbiased for scattered points, counting k is not.
#[test]
fn p8_density_of_the_nearest() {
    let (maps, per_map, k) = (400, 2000, 8);
    let mut scratch = QueryScratch::default();
    let (mut sum, mut sum2) = (0.0, 0.0);
    for map in 0..maps {
        let mut r = Random(1000 + map);
        let points = (0..per_map).map(|_| Vec3::new(r.f32(), r.f32(), 0.0)).collect();
        let case = Case { name: "even", min: Vec3::ZERO, max: Vec3::new(1.0, 1.0, 0.0), points };
        let forest = forest(&case, 3);
        let at = Vec3::new(0.5, 0.5, 0.0);
        let found = forest.nearest(at, 0.2, k, &mut scratch, |_| true);
        let disc = Disc::new(found, k, 0.2, 1e-6).unwrap();
        let density = f64::from(disc.counted.len() as f32 / disc.area) / f64::from(per_map as u32);
        sum += density;
        sum2 += density * density;
    }
    let n = maps as f64;
    let mean = sum / n;
    let error = ((sum2 / n - mean * mean) / (n - 1.0)).sqrt();
    // 2000 points are binomial, not Poisson: (k − 1)/(π r²) is off by less than 1/2000.
    Row {
        case: "P8 density of the 8 nearest of scattered photons",
        measure: "bias",
        figure: (mean - 1.0).abs(),
        naive: ("all 8 count", (mean * k as f64 / (k as f64 - 1.0) - 1.0).abs()),
        bound: 4.0 * error + 5e-4,
    }
    .check();
}

/// A query along a beam finds what a loop over all photons finds, wherever the beam lies, and each once.
#[test]
fn beams_find_what_a_loop_finds() {
    let mut scratch = QueryScratch::default();
    // Squared distances are numbers.
    let ordinary = |case: &Case| (1e-15..1e15).contains(&(case.max - case.min).max_element());
    for case in cases().into_iter().filter(|case| ordinary(case) && !case.points.is_empty()) {
        let forest = forest(&case, 3);
        let (center, side) = (0.5 * (case.min + case.max), (case.max - case.min).max_element());
        for i in 0..60 {
            let mut r = Random(900 + i);
            let axis = [Vec3::X, -Vec3::Y, Vec3::Z, (r.point() - 0.5).normalize_or(Vec3::X)][i as usize % 4];
            let origin = match i % 3 {
                0 => case.points[r.below(case.points.len())],
                _ => center + side * (r.point() - 0.5),
            };
            let length = if i % 5 == 0 { f32::INFINITY } else { side * r.f32() };
            let beam = Beam { origin, direction: axis, length };
            let radius = side * 0.1 * r.f32();
            let mut found: Vec<f32> = Vec::new();
            forest.along(&beam, radius, &mut scratch, |_, t| found.push(t));
            let places = case.points.iter().filter_map(|p| {
                let offset = *p - origin;
                let t = offset.dot(axis);
                let beside = (offset - t * axis).length_squared() < radius * radius;
                (beside && t > 0.0 && t < length).then_some(t)
            });
            let mut expected: Vec<f32> = places.collect();
            found.sort_by(f32::total_cmp);
            expected.sort_by(f32::total_cmp);
            assert_eq!(found, expected, "{}: {beam:?} {radius}", case.name);
        }
    }
}

/// Where light is not even, a lookup of radius r is wrong by a multiple of r². The radius falls with the number n of light
/// paths so that the bias falls as 1/n: at generation 16 it is a 16th of that at the first, besides noise. A radius that stays
/// keeps the bias.
#[test]
fn p8_bias_falls_with_n() {
    let schedule = Schedule {
        paths_per_generation: 1024,
        samples_per_generation: 4096,
        radius: 0.5,
        beam_radius: 0.5,
        alpha: 0.0,
        neighbours: usize::MAX,
    };
    let mut scratch = QueryScratch::default();
    let mut bias = |generations: u64, radius: f32| {
        let (maps, n) = (64, 1024 * generations);
        let mut sum = 0.0;
        for map in 0..maps {
            let mut r = Random(5000 + map);
            // Density 3/8 (x² + y²) over the square of side 2: 0 in its middle, where the lookup is.
            let mut points = Vec::with_capacity(n as usize);
            while (points.len() as u64) < n {
                let p = Vec3::new(2.0 * r.f32() - 1.0, 2.0 * r.f32() - 1.0, 0.0);
                if 2.0 * r.f32() < p.length_squared() {
                    points.push(p);
                }
            }
            let (min, max) = (Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, 1.0, 0.0));
            let forest = forest(&Case { name: "bowl", min, max, points }, 3);
            let found = forest.nearest(Vec3::ZERO, radius, usize::MAX, &mut scratch, |_| true);
            let disc = Disc::new(found, usize::MAX, radius, 1e-6);
            sum += disc.map_or(0.0, |disc| disc.counted.len() as f64 / f64::from(disc.area)) / n as f64;
        }
        sum / maps as f64
    };
    let first = bias(1, schedule.radius(1));
    // ∫ 3/8 r² over the disc.
    assert!((first / (3.0 / 16.0 * 0.25) - 1.0).abs() < 0.1, "{first}");
    Row {
        case: "P8 density of uneven light, 16 times the light paths",
        measure: "bias over that of the first",
        figure: bias(16, schedule.radius(16)) / first,
        naive: ("the same radius", bias(16, schedule.radius(1)) / first),
        // A 16th, and 3 standard errors: the discs of 64 maps hold about 150 photons in all.
        bound: 1.3 / 16.0,
    }
    .check();
}

/// Two white sheets with a lamp between them, and a camera that sees the outside of one, on which no light falls: photons of
/// its inside, at distance 0, are on the other side.
#[test]
fn n21_photons_from_the_other_side() {
    let mut desc = empty();
    (desc.film.width, desc.film.height) = (8, 8);
    let front = material(&mut desc, grey(0.7));
    let white = material(&mut desc, TwoSidedDesc { front, back: front }.into());
    for (z, turn) in [(0.0, 0.0), (1.0, std::f64::consts::PI)] {
        let place = DAffine3::from_translation(DVec3::Z * z) * DAffine3::from_rotation_x(turn);
        shape(&mut desc, ShapeKind::Rectangle, place * DAffine3::from_scale(DVec3::splat(2.0)), white, 0.0);
    }
    let position = DVec3::new(0.0, 0.0, 0.5);
    desc.lights.push(LightDesc::Point {
        position,
        intensity: Spectrum::Constant(1.0),
        place: Place::default(),
    });
    let plan = Plan { side: 8, paths_per_pixel: 64, seeds: 2, window: UvWindow::PICTURE };
    let mean = |from: f64, towards: f64| {
        let mut desc = desc.clone();
        desc.camera = look(DVec3::new(0.1, 0.2, from), DVec3::Z * towards, 30.0);
        let pictures = repeat(&desc, Method::Photon, plan);
        pictures.iter().flatten().sum::<f64>() / (plan.seeds * 64) as f64
    };
    let (inside, outside) = (mean(0.9, -1.0), mean(-2.0, 1.0));
    // Without the test of sides a lookup at the sheet finds the same photons from both.
    let tracer = {
        let scene = Arc::new(Scene::prepare(&desc).unwrap());
        let context =
            RenderContext::new(scene, Camera::of(&desc).unwrap(), &desc.integrator, 1, UvWindow::PICTURE);
        PhotonTracer::new(context, true)
    };
    struct Nothing;
    impl SampleSink for Nothing {
        fn camera(&mut self, _: [f32; 2], _: Xyz, _: f32) {}
        fn light(&mut self, _: [f32; 2], _: Xyz) {}
    }
    tracer.trace(0, &mut Default::default(), &mut Nothing);
    let snapshot = tracer.map.latest();
    let mut scratch = QueryScratch::default();
    let mut count = |accept: &dyn Fn(&Photon) -> bool| {
        snapshot.layer(PhotonLayer::Global).nearest(Vec3::ZERO, 0.5, usize::MAX, &mut scratch, accept).len()
    };
    let (all, seen) = (count(&|_| true), count(&|photon| photon.normal().z > 0.5));
    assert!(seen > 10 && count(&|photon| photon.normal().z < -0.5) == 0, "{seen}");
    Row {
        case: "N21 photons on the other side of a thin wall",
        measure: "light outside over that inside",
        figure: outside / inside,
        naive: ("the nearest of either side", all as f64 / seen as f64),
        bound: 0.0,
    }
    .check();
}
