//! Reflectance spectra of the many colours of a texture: a table of fits that is made once.

use std::sync::LazyLock;

use glam::{DVec3, Vec2, Vec3, Vec3A, Vec4};

use super::upsample::{self, Sigmoid};

/// Nodes along each ratio of components, and along the brightest component.
const RATIOS: usize = 33;
const VALUES: usize = 33;

/// Least and largest value of the brightest component in the table. Other colours are those of the nearest nodes, scaled: beyond,
/// coefficients grow without bound.
const DARKEST: f32 = 1.0 / 256.0;
const LIGHTEST: f32 = 0.95;

/// Root of the first ratio, which stands for all smaller ones.
const LEAST_RATIO_ROOT: f32 = 1.0 / 32.0;

/// The [`Sigmoid`] of every linear Rec.709 colour in [0, 1]³, by interpolation between fits (Jakob and Hanika 2019, §3.3).
///
/// A colour is which component is the brightest, its value, and how the other two compare with it: a table of three dimensions for
/// each of red, green and blue. Nodes lie densest where coefficients change most: where ratios are near 0, and values near 0 and 1.
#[derive(Debug)]
pub(super) struct ReflectanceTable {
    /// `[brightest][value][second ratio][first ratio]`: c₀, c₁, c₂ and nothing, so that a node is one load.
    nodes: Vec<Vec4>,
    values: ValueCells,
}

/// The value of node `i`. The argument of the sigmoid of a grey grows as a hyperbolic sine from node to node.
fn value(i: usize) -> f64 {
    let argument = |y: f64| ((y - 0.5) / (y * (1.0 - y)).sqrt()).asinh();
    let [first, last] = [DARKEST, LIGHTEST].map(|y| argument(f64::from(y)));
    let p = (first + (last - first) * i as f64 / (VALUES - 1) as f64).sinh();
    0.5 + p / (2.0 * (1.0 + p * p).sqrt())
}

/// The ratio of node `i`.
fn ratio(i: usize) -> f64 {
    let first = f64::from(LEAST_RATIO_ROOT);
    (first + (1.0 - first) * i as f64 / (RATIOS - 1) as f64).powi(2)
}

/// The values of nodes, and where to look for the cell of a value.
#[derive(Debug)]
struct ValueCells {
    nodes: [f32; VALUES],
    /// 1 over the distance to the next node.
    inverse: [f32; VALUES - 1],
    /// By the upper bits of a number: the cell of the least number that has them.
    first: [u8; 1 << 9],
}

impl ValueCells {
    /// So many upper bits of the significand tell the part of an octave: a part holds one node at most.
    const PART_BITS: u32 = 6;

    fn new() -> Self {
        let nodes: [f32; VALUES] = std::array::from_fn(|i| value(i) as f32);
        let inverse = std::array::from_fn(|i| 1.0 / (nodes[i + 1] - nodes[i]));
        let first = std::array::from_fn(|part| {
            let least = f32::from_bits((part as u32 + Self::part(DARKEST)) << (23 - Self::PART_BITS));
            nodes.partition_point(|node| *node <= least).clamp(1, VALUES - 1) as u8 - 1
        });
        Self { nodes, inverse, first }
    }

    fn part(v: f32) -> u32 {
        v.to_bits() >> (23 - Self::PART_BITS)
    }

    /// The place among the nodes of a value from [`DARKEST`] to [`LIGHTEST`], as a node and an offset to the next one in [0, 1].
    #[inline(always)]
    fn find(&self, v: f32) -> (usize, f32) {
        let first = usize::from(self.first[(Self::part(v) - Self::part(DARKEST)) as usize & 0x1ff]);
        let cell = (first + usize::from(self.nodes[first + 1] <= v)).min(VALUES - 2);
        (cell, ((v - self.nodes[cell]) * self.inverse[cell]).clamp(0.0, 1.0))
    }
}

/// The places of ratios in [0, 1] among the nodes, as nodes and offsets to the next ones in [0, 1].
#[inline(always)]
fn ratio_cells(ratios: Vec2) -> ([usize; 2], [f32; 2]) {
    let first = LEAST_RATIO_ROOT;
    let at = (ratios.map(f32::sqrt) - first) * ((RATIOS - 1) as f32 / (1.0 - first));
    let at = at.to_array().map(|at| at.max(0.0));
    let cells = at.map(|at| (at as i32).min(RATIOS as i32 - 2));
    (cells.map(|cell| cell as usize), std::array::from_fn(|i| at[i] - cells[i] as f32))
}

impl ReflectanceTable {
    /// The table, made on the first call.
    pub(super) fn get() -> &'static Self {
        static TABLE: LazyLock<ReflectanceTable> = LazyLock::new(ReflectanceTable::new);
        &TABLE
    }

    fn new() -> Self {
        let mut nodes: Vec<Vec4> = Vec::with_capacity(3 * VALUES * RATIOS * RATIOS);
        for brightest in 0..3 {
            for z in 0..VALUES {
                for y in 0..RATIOS {
                    for x in 0..RATIOS {
                        let mut rgb = [value(z); 3];
                        rgb[(brightest + 1) % 3] *= ratio(x);
                        rgb[(brightest + 2) % 3] *= ratio(y);
                        let (rgb, before) = (DVec3::from_array(rgb), nodes.last().filter(|_| x > 0));
                        let shape = match before {
                            Some(node) => {
                                let coefficients = node.truncate().to_array();
                                upsample::reflectance_near(rgb, Sigmoid { coefficients })
                            }
                            None => upsample::reflectance(rgb),
                        };
                        nodes.push(Vec3::from(shape.coefficients).extend(0.0));
                    }
                }
            }
        }
        Self { nodes, values: ValueCells::new() }
    }

    /// The smooth reflectance of `rgb`, linear and in [0, 1], and a factor on it.
    #[inline]
    pub(super) fn find(&self, rgb: Vec3A) -> (Sigmoid, f32) {
        let [r, g, b] = rgb.to_array();
        // Which is the brightest is different at every texel: selected, not branched upon.
        let (brightest, v, others) = if g > r { (1, g, [b, r]) } else { (0, r, [g, b]) };
        let (brightest, v, others) = if b > v { (2, b, [r, g]) } else { (brightest, v, others) };
        if v <= 0.0 {
            return (Sigmoid { coefficients: [0.0; 3] }, 0.0);
        }
        let in_table = v.clamp(DARKEST, LIGHTEST);
        let ([x, y], [s, t]) = ratio_cells(Vec2::from(others) / v);
        let (z, u) = self.values.find(in_table);
        let first = ((brightest * VALUES + z) * RATIOS + y) * RATIOS + x;
        let near = &self.nodes[first..first + (RATIOS + 1) * RATIOS + 2];
        let row = |at: usize| near[at] + (near[at + 1] - near[at]) * s;
        let layer = |at: usize| {
            let (a, b) = (row(at), row(at + RATIOS));
            a + (b - a) * t
        };
        let (a, b) = (layer(0), layer(RATIOS * RATIOS));
        let coefficients = (a + (b - a) * u).truncate().to_array();
        (Sigmoid { coefficients }, v / in_table)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::spectrum::Spectrum;

    #[test]
    fn cells_of_values_are_found() {
        let (cells, mut random) = (ValueCells::new(), Random(5));
        let between = |u: f32| DARKEST + (LIGHTEST - DARKEST) * u * u;
        let values =
            (0..100_000).map(|_| between(random.f32())).chain(cells.nodes).chain([DARKEST, LIGHTEST]);
        for v in values.filter(|v| (DARKEST..=LIGHTEST).contains(v)) {
            let (cell, offset) = cells.find(v);
            let [a, b] = [cells.nodes[cell], cells.nodes[cell + 1]];
            assert!(a <= v.max(cells.nodes[0]) && (v < b || v <= b && cell == VALUES - 2), "{v}: {a} to {b}");
            assert!((a + (b - a) * offset - v).abs() <= 1e-6, "{v}: {offset}");
        }
    }

    /// Random colours of all kinds are met within .01 of linear Rec.709, and on average within .0008.
    #[test]
    fn colors_are_met() {
        let table = ReflectanceTable::get();
        let mut random = Random(3);
        let (mut sum, n) = (0.0, 4000);
        for i in 0..n {
            let power = [1.0, 2.2, 4.0][i % 3];
            let rgb = [0; 3].map(|_| random.f64().powf(power) as f32);
            let (shape, scale) = table.find(rgb.into());
            let found = Spectrum::Scaled { scale, shape }.reflected_rgb();
            let error = (0..3).map(|i| (found[i] - rgb[i]).abs()).fold(0.0, f32::max);
            sum += error / n as f32;
            assert!(error < 1e-2, "{error} at {rgb:?}");
        }
        assert!(sum < 8e-4, "{sum}");
    }
}
