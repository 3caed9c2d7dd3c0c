//! The numbers of a path that has split.

use super::tables::Lanes;

/// One branch of a path that has split into `1 << bits`, at most 16.
///
/// All branches use the numbers of their path, with the leading binary digits exchanged: of 4 branches one lies in each
/// quarter of the square of every pair, and in each quarter of the interval of every single number. Exchanging digits is
/// itself a scrambling, so the numbers of one branch are as evenly distributed as those of the path, and
/// together they are stratified. Which branch has which quarter is drawn anew for every pair, by digits of a dimension that
/// is used for nothing else: a branch that looks up need not be the one whose light samples lie on the left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Branch {
    pub(super) number: u32,
    pub(super) bits: u32,
}

impl Branch {
    /// The numbers of this branch, from those of its path.
    #[inline(always)]
    pub(super) fn of(self, [a, b, c, d, e, f, g, h]: Lanes) -> Lanes {
        // Low digits of the unused dimension: they differ from path to path and are the same for all its branches.
        let turned = |turn: u32| (self.number ^ (g >> turn)) & ((1 << self.bits) - 1);
        let pair = |turn| {
            let n = turned(turn);
            [(n & 1) << 31 | (n & 4) << 28, (n & 2) << 30 | (n & 8) << 27]
        };
        let single = |turn| turned(turn) << (32 - self.bits);
        let ([x, y], [z, w]) = (pair(0), pair(4));
        [a ^ x, b ^ y, c ^ z, d ^ w, e ^ single(8), f ^ single(12), g, h ^ single(16)]
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use crate::tracer::Sampler;
    use crate::tracer::sampler::VertexNumbers;

    /// The cells that the numbers of a vertex lie in, of `side` by `side` for pairs and as many for single numbers.
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
            let mut seen = BTreeSet::new();
            for index in 0..1024 {
                seen.insert(cells(&Sampler::at(index, 5).branch(number, 2).vertex(0), 32.0)[1]);
            }
            // The quarters are dealt by lot, so that cells collide now and then; random points would fill 647 of 1024.
            assert!(seen.len() > 700, "branch {number}: {} cells", seen.len());
        }
    }

    /// Which branch looks where says nothing about where its light samples lie.
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
