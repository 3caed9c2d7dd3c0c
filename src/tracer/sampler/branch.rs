//! The random numbers of a path that has split.

use super::nx8::Coordinates;

/// One branch of a path that has split into `1 << bits` branches, at most 16.
///
/// All branches use the numbers of their path with the leading binary digits exchanged: of 4 branches one lies in each quarter
/// of the square of every pair, and in each quarter of the interval of every single number. A branch exchanges the same digits
/// in all paths, so its points are as evenly distributed as those of the paths, in all dimensions together. (A new random
/// assignment for every path and pair destroys this: Veach's plates lose 5 % of their efficiency.)
#[derive(Clone, Copy, Debug)]
pub(super) struct Branch {
    pub(super) number: u32,
    pub(super) bits: u32,
}

impl Branch {
    /// The coordinates of this branch, from those of its path.
    #[inline(always)]
    pub(super) fn of(self, [a, b, c, d, e, f, g, h]: Coordinates) -> Coordinates {
        let n = self.number;
        let [x, y] = [(n & 1) << 31 | (n & 4) << 28, (n & 2) << 30 | (n & 8) << 27];
        let single = n << (32 - self.bits);
        [a ^ x, b ^ y, c ^ x, d ^ y, e ^ single, f ^ single, g, h ^ single]
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use crate::tracer::Sampler;
    use crate::tracer::sampler::VertexNumbers;

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
                    assert!(
                        seen.iter().all(|set| set.len() == 1 << bits),
                        "{bits} {index} {depth}: {seen:?}"
                    );
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
}
