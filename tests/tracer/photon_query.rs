//! Photon queries against a loop over all photons, on inputs that are hard for a tree which splits space.

use std::cell::Cell;

use crate::photon_cases::{Case, any_photon, by_loop, cases};
use glam::Vec3;
use pointillist::math::random::Random;
use pointillist::tracer::photon_map::{
    Disc, Forest, LEAF, MAX_DEPTH, MortonGrid, Neighbour, QueryScratch, SortedPhotons,
};

/// The points in `generations` parts of about equal size.
fn forest(case: &Case, generations: usize) -> Forest {
    let grid = MortonGrid::new(case.min, case.max);
    let photons = vec![any_photon(); case.points.len()];
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

#[test]
fn queries_equal_a_loop_over_all() {
    let mut scratch = QueryScratch::default();
    for case in cases() {
        let forests = [1, 7, 32].map(|generations| forest(&case, generations));
        let side = (case.max - case.min).max_element().min(f32::MAX);
        let mut found_any = 0;
        for at in places(&case) {
            for radius in [0.0, 0.003 * side, 0.2 * side, 3.0 * side, f32::INFINITY] {
                for wanted in [0, 1, 6, 50, 5000] {
                    let expected = by_loop(&case.points, at, wanted, radius);
                    found_any += expected.len();
                    let sorted = |found: &[Neighbour]| {
                        let mut d: Vec<f32> = found.iter().map(|n| n.distance2).collect();
                        assert!(d.is_empty() || d.iter().all(|&x| x <= d[0]), "the farthest comes first");
                        d.sort_by(f32::total_cmp);
                        d
                    };
                    for f in &forests {
                        let found = f.nearest(at, radius, wanted, &mut scratch, |_| true).to_vec();
                        assert_eq!(sorted(&found), expected, "{}: {wanted} at {at}, {radius}", case.name);
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
}

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

#[test]
fn depth_is_bounded_and_leaves_are_small() {
    for case in cases() {
        for generations in [1, 5] {
            for tree in forest(&case, generations).trees() {
                assert!(tree.depth() <= MAX_DEPTH, "{}: depth {}", case.name, tree.depth());
            }
        }
    }
    // Evenly spread photons are split down to the leaf's size in about log₂(n / LEAF) steps.
    let even = &cases()[0];
    let f = forest(even, 1);
    let depth = f.trees().next().unwrap().depth();
    let least = (even.points.len() as f32 / LEAF as f32).log2() as u32;
    assert!((least..=least + 8).contains(&depth), "{depth} against {least}");
}

/// A million photons in one point: one long leaf, of which a query looks at no more than it wants where it can.
#[test]
fn a_million_photons_in_one_point() {
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
        // Photons no nearer than the farthest found cost a comparison and nothing else.
        assert!(taken.get() < 2000, "{at}: {} photons were weighed", taken.get());
        let disc = Disc::new(found, 50, 1.0, 1e-4).unwrap();
        assert!(disc.area >= 3.1e-8 && disc.area.is_finite());
        assert_eq!(disc.counted.len(), 49);
    }
    assert_eq!(forest.nearest(p, 1e-6, usize::MAX, &mut scratch, |_| true).len(), n);
}

/// Counting k − 1 of the k nearest is unbiased for scattered points, counting k is not.
#[test]
fn density_of_the_nearest_is_unbiased() {
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
    assert!((mean - 1.0).abs() < 4.0 * error + 5e-4, "{mean} ± {error}");
    let naive = mean * k as f64 / (k as f64 - 1.0);
    assert!((naive - 1.0).abs() > 4.0 * error, "the case is too easy: {naive} ± {error}");
}
