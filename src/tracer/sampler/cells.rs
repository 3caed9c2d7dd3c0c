//! Cells of about a pixel, and the number of each visit to one.
//!
//! Block 0 of the sequence is even over the screen and, within each pixel, over all eight dimensions together. A padded block has no
//! dimension of the screen: enumerated by the index, the paths of one pixel take points of it at random. So the screen is
//! divided into cells of about a pixel each, elementary intervals of the sequence: of 2^n consecutive indices, aligned, one lies in each
//! of the 2^n cells. The number of this range is a **visit** to the cell. From the second visit on, padded blocks are enumerated by
//! visits, with a randomisation of each cell's own (of 32 bits), so that these paths of a pixel are a sequence of low discrepancy in each
//! block, short of its first point, as in samplers that begin anew in each pixel (pbrt-v4, `PaddedSobolSampler`). In the first visit padded
//! blocks are enumerated by the index, and so are even over the whole screen: until there is a path for each pixel, pictures are
//! those of a sequence without cells, or of a corner of it.
//!
//! Block 0 is even within cells of some sizes and lags in others: in squares of 2^9 cells to a side, as in a picture of 512², the first four paths
//! of a cell have the same leading binary digit in each of dimensions 2 to 5, light and bsdf of the first vertex, and in dimension 5 the first eight; with 2^10 to a
//! side they have not. So the screen may be a **corner** of that of the sequence, of 1/2 or 1/4 of its width and height, whichever lags least: paths
//! are those of the sequence that lie there, in its order. Which these are is linear in the index: the lowest digits of an index in the corner are parities of the others.
//! `tools/README.md`, “Cells of the sampler”, has the errors with and without it, and what was tried in its place.
//!
//! The cells of a group of consecutive paths are enumerated likewise. Block 0 is linear before it is scrambled: the cells of a group are a
//! coset of a space that is the same for all groups, so that two groups either visit the same cells or have none in common.
//!
//! # Two randomisations of a picture
//!
//! The second randomisation of a picture visits the cells in the order of the first, with the halves of each round exchanged, a round being 2^n consecutive
//! indices, one visit to each cell. So when each is half through a round it has visited the cells that the other has not: where cells
//! are pixels, a picture of one sample per pixel has a sample in each, while with unrelated orders a quarter of them has none. To this end the Owen scrambling of both has the
//! same leading digits on the screen, so many that they determine the cell. Further digits and all other numbers are scrambled by a seed of
//! its own, so that the values of both in any cell are independent.
//!
//! Both use the same point of the sequence in a cell. A leading digit of a dimension would then agree in every cell or in none, depending on the seeds,
//! and the error of their mean would vary with the seed: by a fifth in the Cornell box at 512². So the second assigns dimensions
//! 2 to 5, of light and bsdf at the first vertex, in another order (`ORDER`), and the digits agree in half of the cells.

use crate::math::bits::mix;
use crate::stream::UvWindow;

use super::nx8::{Coordinates, DIMENSIONS, point, point_reversed, reversed_halves};
use super::scramble::{BlockKey, owen, scramble};

/// At most 2^14 cells along each side.
const MAX_BITS: u32 = 14;

/// At most 4^2 times as many indices.
const MAX_ZOOM: u32 = 2;

/// Which dimensions of block 0 the second randomisation uses in place of these.
const ORDER: [usize; DIMENSIONS] = [0, 1, 4, 5, 3, 2, 6, 7];

/// Leading digits of a number that are to be even within a cell.
const DIGITS: u32 = 4;

/// A division of the screen into 2^x × 2^y cells, each of which is visited once in every 2^(x + y) consecutive indices, aligned, and the
/// part of the sequence by which the screen is enumerated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScreenCells {
    /// x and y.
    bits: [u32; 2],
    /// The screen is a corner of that of the sequence, of 2^−zoom its width and height.
    zoom: u32,
    /// The lowest `2 * zoom` bits of an index in the sequence are the parities of these bits of the index that it is enumerated by.
    low: [u64; 2 * MAX_ZOOM as usize],
    /// In the second randomisation of a picture the seed of the first.
    first_seed: Option<u32>,
}

/// A visit to a cell, or of a group to its cells: what padded blocks are enumerated and randomised by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visit {
    /// Visits before this one; in the first visit the index, or the number of the group.
    pub number: u64,
    /// The seed of the cell or the cells; in the first visit that of the render.
    pub seed: u32,
}

impl ScreenCells {
    /// Cells of about the size of a pixel, where so many pixels cover the screen in width and height.
    pub fn of_pixels(pixels: [f64; 2]) -> Self {
        let [x, y] = pixels.map(|n| (n.max(1.0).log2().round() as u32).min(MAX_BITS));
        // Not every division has one point in each cell, but always one of these has.
        let divisions = [[x, y], [x, y + 1], [x + 1, y]];
        let zoomed = |bits| (0..=MAX_ZOOM).map(move |zoom| Self::new(bits, zoom)).filter(Self::is_elementary);
        let best = |bits| zoomed(bits).min_by_key(Self::lag);
        divisions.into_iter().find_map(best).unwrap_or_else(|| Self::new([x, y], 0))
    }

    /// Cells of about the size of a pixel of a picture of so many in width and height, where paths begin in `window`.
    pub fn of_picture(size: [u32; 2], window: &UvWindow) -> Self {
        let UvWindow { min, max } = window;
        Self::of_pixels([0, 1].map(|i| f64::from(size[i]) * f64::from(max[i] - min[i])))
    }

    fn new(bits: [u32; 2], zoom: u32) -> Self {
        let mut cells = Self { bits, zoom, low: [0; 2 * MAX_ZOOM as usize], first_seed: None };
        let corner = |index: u64| {
            let [x, y, ..] = point(index).map(|x| x.checked_shr(64 - zoom).unwrap_or(0));
            x << zoom | y
        };
        for bit in 2 * zoom..u64::BITS {
            // The first points lie one in each part of the screen.
            let low = (0..1 << (2 * zoom)).find(|low| corner(1 << bit | low) == 0).unwrap_or(0);
            for (i, parity) in cells.low.iter_mut().enumerate() {
                *parity |= (low >> i & 1) << (bit - 2 * zoom);
            }
        }
        cells
    }

    /// The same cells for the second randomisation of a picture, whose first one has this seed.
    pub fn beside(self, first_seed: u32) -> Self {
        Self { first_seed: Some(first_seed), ..self }
    }

    /// The index by which path `index` is enumerated: in a second randomisation the halves of each round are exchanged.
    #[inline]
    fn enumerated(&self, index: u64) -> u64 {
        match self.first_seed {
            Some(_) => index ^ (1 << self.count_bits() >> 1),
            None => index,
        }
    }

    /// The index in the sequence of path `index`.
    #[inline]
    fn index_in_sequence(&self, index: u64) -> u64 {
        let bits = 2 * self.zoom;
        let low = |bit: u32| u64::from((index & self.low[bit as usize]).count_ones() & 1) << bit;
        (0..bits).fold(index << bits, |i, bit| i | low(bit))
    }

    /// Block 0 of path `index` in a render of seed `seed`: its first coordinates are the place on the screen, as 32-bit fractions.
    #[inline]
    pub(super) fn first_block(&self, index: u64, seed: u32) -> Coordinates {
        let plain = point_reversed(reversed_halves(self.index_in_sequence(self.enumerated(index))));
        let mut point = scramble(plain, &BlockKey::new(seed, 0));
        if let Some(first_seed) = self.first_seed {
            let first = BlockKey::new(first_seed, 0).dimensions;
            for i in 0..2 {
                let within_cell = u32::MAX >> (self.zoom + self.bits[i]);
                let cell = owen(plain[i].reverse_bits(), first[i]);
                point[i] = cell & !within_cell | point[i] & within_cell;
            }
            point = ORDER.map(|d| point[d]);
        }
        point[0] <<= self.zoom;
        point[1] <<= self.zoom;
        point
    }

    /// Block 0 before scrambling of the path that is enumerated by `index`.
    pub(super) fn plain_block(&self, index: u64) -> Coordinates {
        let mut point = point_reversed(reversed_halves(self.index_in_sequence(index))).map(u32::reverse_bits);
        point[0] <<= self.zoom;
        point[1] <<= self.zoom;
        point
    }

    /// Whether each cell holds one of the first points, so many as there are cells: whether the generator matrix of the cells has full rank.
    fn is_elementary(&self) -> bool {
        // Of no digits: whichever dimension.
        self.points_until_even(2, 0) == self.count_bits()
    }

    /// How much later than in the best of sequences the numbers of block 0 become even within a cell.
    fn lag(&self) -> u32 {
        let late =
            |(dimension, digits)| self.points_until_even(dimension, digits) - self.count_bits() - digits;
        (2..6).flat_map(|d| (1..=DIGITS).map(move |digits| (d, digits))).map(late).sum()
    }

    /// Binary logarithm of the number of points that are needed until in each cell the leading digits of a dimension are even.
    fn points_until_even(&self, dimension: usize, digits: u32) -> u32 {
        let (mut basis, wanted) = (Basis::default(), self.count_bits() + digits);
        for bit in 0..u64::BITS - 2 * self.zoom {
            if basis.0.len() as u32 == wanted {
                return bit;
            }
            let point = self.plain_block(1 << bit);
            let leading = point[dimension].checked_shr(32 - digits).unwrap_or(0);
            basis.add(self.cell([point[0], point[1]]) << digits | u64::from(leading));
        }
        u64::BITS
    }

    /// Binary logarithm of the number of cells.
    fn count_bits(&self) -> u32 {
        self.bits[0] + self.bits[1]
    }

    /// The cell of a point, whose coordinates are 32-bit fractions.
    #[inline]
    fn cell(&self, [x, y]: [u32; 2]) -> u64 {
        let leading = |x: u32, bits: u32| u64::from(x.checked_shr(32 - bits).unwrap_or(0));
        leading(x, self.bits[0]) << self.bits[1] | leading(y, self.bits[1])
    }

    /// The cell before scrambling of the path that is enumerated by `index`.
    fn plain_cell(&self, index: u64) -> u64 {
        let [x, y, ..] = self.plain_block(index);
        self.cell([x, y])
    }

    /// The visit of path `index`, whose point of block 0 has these first coordinates.
    #[inline]
    pub(super) fn visit(&self, index: u64, point: [u32; 2], seed: u32) -> Visit {
        let index = self.enumerated(index);
        match index >> self.count_bits() {
            0 => Visit { number: index, seed },
            number => Visit { number, seed: seed_of(self.cell(point), seed) },
        }
    }

    /// The visit of group `group` of `1 << bits` consecutive indices to its cells. Where a group visits each cell several times, these count
    /// as one visit.
    #[inline]
    pub fn visit_of_group(&self, group: u64, bits: u32, seed: u32) -> Visit {
        let group = self.enumerated(group << bits) >> bits;
        let number = group >> self.count_bits().saturating_sub(bits);
        if number == 0 {
            return Visit { number: group, seed };
        }
        // The cells of all its paths are that of its first, moved by this space.
        let mut space = Basis::default();
        for bit in 0..bits {
            space.add(self.plain_cell(1 << bit));
        }
        let cells = space.reduce(self.plain_cell(group << bits));
        Visit { number, seed: seed_of(cells, seed) }
    }
}

/// The seed of a cell, or of all cells that a group visits, in a render of seed `seed`.
#[inline]
fn seed_of(cell: u64, seed: u32) -> u32 {
    mix(cell << 32 | u64::from(seed)) as u32
}

/// A basis of a space of bit vectors, in echelon form.
#[derive(Default)]
struct Basis(Vec<u64>);

impl Basis {
    /// The one vector of those that differ from `vector` by one of the space that has none of the basis' leading bits.
    fn reduce(&self, vector: u64) -> u64 {
        self.0.iter().fold(vector, |vector, b| vector.min(vector ^ b))
    }

    /// Adds a vector, and returns false where it lies in the space already.
    fn add(&mut self, vector: u64) -> bool {
        let reduced = self.reduce(vector);
        if reduced != 0 {
            self.0.push(reduced);
        }
        reduced != 0
    }
}

#[cfg(test)]
mod tests {
    use std::collections::{HashMap, HashSet};

    use super::*;
    use crate::tracer::Sampler;

    const SEED: u32 = 3;

    fn visit(cells: &ScreenCells, index: u64) -> Visit {
        let [x, y, ..] = cells.first_block(index, SEED);
        cells.visit(index, [x, y], SEED)
    }

    fn cell_of(cells: &ScreenCells, index: u64) -> [u32; 2] {
        let screen = Sampler::in_cells(index, SEED, cells).camera().screen;
        [0, 1].map(|i| (screen[i] * f64::from(1u32 << cells.bits[i])) as u32)
    }

    #[test]
    fn cells_are_about_as_large_as_pixels() {
        for (pixels, bits) in [
            ([1.0, 1.0], [0, 0]),
            ([128.0, 128.0], [7, 7]),
            ([516.0, 516.0], [9, 9]),
            ([96.0, 54.0], [7, 6]),
            ([33.0, 16.0], [5, 4]),
            ([1920.0, 1080.0], [11, 10]),
            ([1e9, 1e9], [14, 14]),
        ] {
            assert_eq!(ScreenCells::of_pixels(pixels).bits, bits, "{pixels:?}");
        }
    }

    /// Whatever the size of the picture, each cell is visited once in as many indices as there are cells, and from the second visit on has a seed
    /// of its own.
    #[test]
    fn each_cell_is_visited_in_turn() {
        let all = (0..=MAX_BITS).flat_map(|x| (0..=MAX_BITS).map(move |y| [x, y]));
        for [x, y] in all.clone() {
            let cells = ScreenCells::of_pixels([x, y].map(|bits| f64::from(1 << bits)));
            assert!(cells.is_elementary() && cells.count_bits() <= x + y + 1, "{x} {y} {cells:?}");
        }
        let small = all.filter(|bits| bits.iter().all(|&bits| bits < 8));
        let cells = small.map(|bits| ScreenCells::of_pixels(bits.map(|bits| f64::from(1 << bits))));
        for cells in cells.flat_map(|cells| [cells, cells.beside(77)]) {
            let bits = cells.count_bits();
            let mut seeds: HashMap<[u32; 2], u32> = HashMap::new();
            for number in [0, 1, 6, 1 << 40 | 5] {
                let mut visited = HashSet::new();
                for index in number << bits..(number + 1) << bits {
                    let (visit, cell) = (visit(&cells, index), cell_of(&cells, index));
                    assert!(visited.insert(cell), "{cells:?}: {cell:?} twice");
                    if number == 0 {
                        assert_eq!(visit, Visit { number: cells.enumerated(index), seed: SEED });
                    } else {
                        assert_eq!(visit.number, number);
                        assert_eq!(*seeds.entry(cell).or_insert(visit.seed), visit.seed);
                    }
                }
            }
            let different: HashSet<u32> = seeds.values().copied().collect();
            assert!(different.len() + 1 >= seeds.len(), "{cells:?}: {} seeds", different.len());
        }
    }

    /// Whenever both randomisations of a picture are half through a round, they have visited each cell equally often, and in half of the
    /// cells they are on the same side of a dimension.
    #[test]
    fn two_randomisations_share_out_the_cells() {
        for pixels in [[1.0, 2.0], [33.0, 16.0], [64.0, 64.0], [128.0, 128.0]] {
            let first = ScreenCells::of_pixels(pixels);
            let second = first.beside(SEED);
            let point = |r: usize, index| [&first, &second][r].first_block(index, SEED ^ r as u32);
            let half = 1u64 << first.count_bits() >> 1;
            for round in [0, 1, 5] {
                let of_half = |r, half_round: u64| {
                    let indices = half_round * half..(half_round + 1) * half;
                    indices
                        .map(|i| point(r, i))
                        .map(|p| (first.cell([p[0], p[1]]), p))
                        .collect::<HashMap<_, _>>()
                };
                for late in 0..2 {
                    let visited = [0, 1].map(|r| of_half(r, 2 * round + late));
                    assert!(visited.iter().all(|cells| cells.len() as u64 == half));
                    assert!(visited[0].keys().all(|cell| !visited[1].contains_key(cell)), "{first:?}");
                }
                if half < 64 {
                    continue;
                }
                let whole = [0, 1].map(|r| {
                    let mut cells = of_half(r, 2 * round);
                    cells.extend(of_half(r, 2 * round + 1));
                    cells
                });
                let agree = |of: &dyn Fn(&Coordinates) -> u32| {
                    let same = whole[0].iter().filter(|(cell, p)| (of(p) ^ of(&whole[1][*cell])) >> 31 == 0);
                    same.count() as f64 / (2 * half) as f64
                };
                for d in 2..6 {
                    assert_eq!(agree(&|p| p[d]), 0.5, "{first:?}, dimension {d}");
                }
                // Within a cell they are where they happen to be.
                for i in 0..2 {
                    let share = agree(&|p| p[i] << first.bits[i]);
                    assert!((share - 0.5).abs() < 0.2, "{first:?}: {share} in the same half of the cell");
                }
            }
        }
    }

    /// In a picture of any usual size, of 64 visits to a cell, aligned, some lie in each quarter of each dimension of the first vertex' light and bsdf,
    /// and in squares with 2^k pixels along a side 16 visits do. With 512 that needs a corner of the sequence.
    #[test]
    fn first_vertices_are_even_within_a_cell() {
        assert_eq!(ScreenCells::of_pixels([512.0; 2]).zoom, 1);
        assert!(ScreenCells::new([9, 9], 0).lag() > 4 * ScreenCells::of_pixels([512.0; 2]).lag());
        let squares = (4..=10).map(|bits| ([f64::from(1 << bits); 2], 16));
        let others = [[640.0, 480.0], [1280.0, 720.0], [960.0, 540.0], [800.0, 200.0]].map(|size| (size, 64));
        for (pixels, visits) in squares.chain(others) {
            let cells = ScreenCells::of_pixels(pixels);
            let bits = cells.count_bits();
            let of = |[x, y, ..]: Coordinates| cells.cell([x, y]);
            let cell = of(cells.first_block(12345, SEED));
            for first in [0, 128] {
                let own: Vec<Coordinates> = (first << bits..(first + visits) << bits)
                    .map(|index| cells.first_block(index, SEED))
                    .filter(|&point| of(point) == cell)
                    .collect();
                assert_eq!(own.len() as u64, visits);
                for d in 2..6 {
                    let quarters: HashSet<u32> = own.iter().map(|point| point[d] >> 30).collect();
                    assert_eq!(quarters.len(), 4, "{cells:?}, dimension {d}");
                }
            }
        }
    }

    /// The part of the sequence that is taken is all of a corner of its screen, in its order.
    #[test]
    fn a_corner_is_taken_in_order() {
        for zoom in 0..=MAX_ZOOM {
            let cells = ScreenCells::new([6, 6], zoom);
            let in_corner = |index: &u64| {
                let [x, y, ..] = point(*index);
                (x | y).checked_shr(64 - zoom).unwrap_or(0) == 0
            };
            let wanted: Vec<u64> = (0..1 << (12 + 2 * zoom)).filter(in_corner).collect();
            let taken: Vec<u64> = (0..1 << 12).map(|index| cells.index_in_sequence(index)).collect();
            assert_eq!(taken, wanted, "zoom {zoom}");
        }
    }

    /// Groups have the same seed where they visit the same cells, else another; and their visits are counted.
    #[test]
    fn visits_of_groups_are_counted() {
        let bits = 5;
        let cells = [[1.0, 1.0], [4.0, 4.0], [16.0, 8.0], [64.0, 64.0]].map(ScreenCells::of_pixels);
        for cells in cells.into_iter().flat_map(|cells| [cells, cells.beside(77)]) {
            let different = 1u64 << cells.count_bits().saturating_sub(bits);
            let mut visits: HashMap<Vec<[u32; 2]>, (u64, u32)> = HashMap::new();
            for group in 0..8 * different {
                let mut visited: Vec<_> =
                    (0..1 << bits).map(|i| cell_of(&cells, group << bits | i)).collect();
                visited.sort_unstable();
                let visit = cells.visit_of_group(group, bits, SEED);
                if group < different {
                    let number = cells.enumerated(group << bits) >> bits;
                    assert_eq!(visit, Visit { number, seed: SEED });
                    visits.insert(visited, (1, 0));
                    continue;
                }
                let (count, seed) = visits.get_mut(&visited).expect("each of these cells was visited");
                if *count == 1 {
                    *seed = visit.seed;
                }
                assert_eq!(visit, Visit { number: *count, seed: *seed }, "{cells:?}, group {group}");
                *count += 1;
            }
            // The same far out in the sequence.
            let far = 1 << 40;
            for group in far..far + different {
                let mut visited: Vec<_> =
                    (0..1 << bits).map(|i| cell_of(&cells, group << bits | i)).collect();
                visited.sort_unstable();
                let expected = Visit { number: far / different, seed: visits[&visited].1 };
                assert_eq!(cells.visit_of_group(group, bits, SEED), expected, "{cells:?}, group {group}");
            }
            let seeds: HashSet<u32> = visits.values().map(|v| v.1).collect();
            assert_eq!((visits.len() as u64, seeds.len()), (different, visits.len()), "{cells:?}");
        }
    }

    /// In each padded block four visits to a cell, aligned, have one point in each quarter of every dimension. By the index they seldom do. The first
    /// visits to all cells have one point in each part of a dimension, so many as there are cells.
    #[test]
    fn visits_to_a_cell_and_the_first_to_all_are_even() {
        let cells = ScreenCells::of_pixels([32.0, 32.0]);
        let numbers = |sampler: Sampler| {
            let v = sampler.vertex(2);
            [v.light[0], v.light[1], v.bsdf[0], v.bsdf[1], v.light_choice as f32]
        };
        let even = |points: &[[f32; 5]]| {
            (0..5).all(|d| {
                let parts: HashSet<_> = points.iter().map(|p| (p[d] * points.len() as f32) as u32).collect();
                parts.len() == points.len()
            })
        };
        let (mut even_by_index, mut of) = (0, 0);
        for index in [0, 1, 77, 1023] {
            let cell = cell_of(&cells, index);
            for start in [4, 64, 1 << 30] {
                let visits = (start << 10..(start + 4) << 10).filter(|&i| cell_of(&cells, i) == cell);
                let visits: Vec<u64> = visits.collect();
                let points = |at: &dyn Fn(u64) -> Sampler| -> Vec<_> {
                    visits.iter().map(|&i| numbers(at(i))).collect()
                };
                assert!(even(&points(&|i| Sampler::in_cells(i, SEED, &cells))), "{cell:?}, visit {start}");
                even_by_index += u32::from(even(&points(&|i| Sampler::at(i, SEED))));
                of += 1;
            }
        }
        assert!(even_by_index < of / 2, "{even_by_index} of {of}");
        let first: Vec<_> = (0..1024).map(|i| numbers(Sampler::in_cells(i, SEED, &cells))).collect();
        assert!(even(&first));
    }
}
