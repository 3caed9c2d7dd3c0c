//! The sequence of samples to its end: 2^64 indices.

use pointillist::math::bits::mix;
use pointillist::tracer::Sampler;
use pointillist::tracer::sampler::cells::Visit;
use pointillist::tracer::sampler::{unit_f32, unit_f64};

use crate::Row;

/// Indices where counters and floats end: 2^24, 2^32, 2^53, 2^63, 2^64.
const EDGES: [u64; 5] = [1 << 24, 1 << 32, 1 << 53, 1 << 63, u64::MAX - 8191];

/// Every number that camera, light and eight vertices of either take from a path.
fn numbers(index: u64, seed: u32) -> Vec<f64> {
    let (sampler, light) = (Sampler::at(index, seed), Sampler::at(index, seed).light());
    let (camera, emission) = (sampler.camera(), light.emission());
    let wavelength = Sampler::group_wavelength(Visit { number: index, seed });
    let mut singles = vec![camera.wavelength, camera.time, camera.connection, wavelength];
    singles.extend([camera.lens, emission.place, emission.direction].concat());
    let mut all = camera.screen.to_vec();
    all.push(emission.choice);
    for depth in 0..8 {
        for vertex in [sampler.vertex(depth), light.vertex(depth), sampler.branch(3, 2).vertex(depth)] {
            singles.extend([vertex.light, vertex.bsdf].concat());
            singles.extend([vertex.lobe, vertex.roulette]);
            all.push(vertex.light_choice);
        }
    }
    all.extend(singles.into_iter().map(f64::from));
    all
}

/// The words of the sequence that are rounded up to 1 by a plain conversion are the 128 largest of 2^32; a picture of 2^20
/// pixels takes one of them in each sample per pixel.
#[test]
fn p9_no_number_is_one() {
    let largest = || u32::MAX - 127..=u32::MAX;
    let share = |f: &dyn Fn(u32) -> bool| largest().filter(|&x| f(x)).count() as f64 / 128.0;
    Row {
        case: "P9 the 128 largest words",
        measure: "share that become 1",
        figure: share(&|x| unit_f32(x) >= 1.0 || unit_f64(x) >= 1.0),
        naive: ("x as f32 / 2^32", share(&|x| x as f32 / 4_294_967_296.0 >= 1.0)),
        bound: 0.0,
    }
    .check();
    assert!(unit_f32(0) == 0.0 && unit_f64(0) > 0.0);
    let random = (0..20_000).map(mix).chain(EDGES.into_iter().flat_map(|edge| edge - 500..edge + 500));
    for index in random {
        let numbers = numbers(index, mix(!index) as u32);
        assert!(numbers.iter().all(|u| (0.0..1.0).contains(u)), "{index}: {numbers:?}");
    }
}

/// Cells of a grid of 64×64 that the 4096 indices from `first` on leave empty.
fn empty_cells(first: u64, index: impl Fn(u64) -> u64) -> f64 {
    let mut hit = vec![false; 4096];
    for i in 0..4096 {
        let [x, y] = Sampler::at(index(first + i), 7).camera().screen.map(|u| (u * 64.0) as usize);
        hit[y * 64 + x] = true;
    }
    hit.iter().filter(|hit| !**hit).count() as f64
}

/// Samples go on after 2^24, 2^32, 2^53 and 2^63: they do not begin again, and 4096 from there on fill the picture as evenly
/// as the first.
#[test]
fn p9_indices_beyond_all_counters() {
    let pairs = EDGES.map(|edge| (0..1000).map(move |i| (i, edge + i)));
    let again = |wrap: &dyn Fn(u64) -> u64| {
        let same = |(a, b): &(u64, u64)| numbers(*a, 7)[..2] == numbers(wrap(*b), 7)[..2];
        pairs.clone().into_iter().flatten().filter(same).count() as f64 / 5000.0
    };
    Row {
        case: "P9 indices i and i + 2^24, 2^32, 2^53, 2^63, 2^64 − 2^13",
        measure: "share of equal screen positions",
        figure: again(&|i| i),
        naive: ("a counter of 32 bits", again(&|i| i & 0xffff_ffff)),
        bound: 0.0,
    }
    .check();
    Row {
        case: "P9 4096 indices from 2^24, 2^32, 2^53, 2^63, 2^64 − 2^13 on",
        measure: "empty cells of 64×64",
        figure: EDGES.map(|edge| empty_cells(edge, |i| i)).into_iter().sum(),
        naive: (
            "a counter in f64",
            EDGES.map(|edge| empty_cells(edge, |i| i as f64 as u64)).into_iter().sum(),
        ),
        bound: 0.0,
    }
    .check();
}
