//! Tests of `tracer::sampler::branch`.

use std::collections::BTreeSet;

use pointillist::tracer::Sampler;
use pointillist::tracer::sampler::VertexNumbers;

/// The elementary intervals of a vertex's numbers: of `side` by `side` cells for pairs, and of as many for single numbers.
fn cells(v: &VertexNumbers, side: f32) -> [u32; 5] {
    let square = |[x, y]: [f32; 2]| (x * side) as u32 + side as u32 * (y * side) as u32;
    let line = |x: f32| (x * side * side) as u32;
    [square(v.light), square(v.bsdf), line(v.light_choice as f32), line(v.lobe), line(v.roulette)]
}

#[test]
fn branches_of_one_path_share_out_every_number() {
    for (bits, side) in [(2, 2.0), (4, 4.0)] {
        for index in 0..500 {
            let path = Sampler::at(index * 7919, 5);
            for depth in [0, 1, 2, 9] {
                let mut seen: [BTreeSet<u32>; 5] = Default::default();
                for number in 0..1 << bits {
                    let vertex = path.branch(number, bits).vertex(depth);
                    seen.iter_mut().zip(cells(&vertex, side)).for_each(|(set, cell)| {
                        set.insert(cell);
                    });
                }
                assert!(seen.iter().all(|set| set.len() == 1 << bits), "{bits} {index} {depth}: {seen:?}");
            }
        }
    }
}

/// An aligned run of 4^k indices has one point in every cell of a grid with as many cells; so has one branch of them
/// at vertex 0, whose pairs belong to the first block.
#[test]
fn one_branch_is_as_even_as_a_path() {
    for number in 0..4 {
        let seen = |pair: usize| {
            let cell = |index| cells(&Sampler::at(index, 5).branch(number, 2).vertex(0), 32.0)[pair];
            (0..1024).map(cell).collect::<BTreeSet<_>>().len()
        };
        assert_eq!([seen(0), seen(1)], [1024; 2], "branch {number}");
    }
}

/// The quarter of a branch's BSDF samples is independent of that of its light samples.
#[test]
fn quarters_of_different_pairs_are_independent() {
    let mut count = [[0u32; 4]; 4];
    for index in 0..8000 {
        let [light, bsdf, ..] = cells(&Sampler::at(index, 5).branch(1, 2).vertex(3), 2.0);
        count[light as usize][bsdf as usize] += 1;
    }
    let chi2: f64 = count.as_flattened().iter().map(|&n| (f64::from(n) - 500.0).powi(2) / 500.0).sum();
    // 15 degrees of freedom; 0.01 % quantile 44.3 above. Points more even than random lie lower.
    assert!(chi2 < 44.3, "{chi2}: {count:?}");
}

/// Branch 0 exchanges no digits.
#[test]
fn the_first_branch_has_the_numbers_of_its_path() {
    for index in [0, 1, 77, 12_345] {
        let path = Sampler::at(index, 5);
        for bits in [1, 2, 4] {
            assert_eq!(cells(&path.branch(0, bits).vertex(3), 256.0), cells(&path.vertex(3), 256.0));
        }
    }
}
