//! Reflectance spectra of the many colours of a texture: a table of fits that is made once.

use std::sync::LazyLock;

use glam::DVec3;

use super::upsample::{self, Sigmoid};

/// Nodes along each ratio of components, and along the brightest component.
const RATIOS: usize = 33;
const VALUES: usize = 33;

/// Least and largest value of the brightest component in the table. Other colours are those of the nearest nodes, scaled: beyond,
/// coefficients grow without bound.
const DARKEST: f32 = 1.0 / 256.0;
const LIGHTEST: f32 = 0.95;

/// The first ratio, which stands for all smaller ones.
const LEAST_RATIO: f64 = 1e-3;

/// The [`Sigmoid`] of every linear Rec.709 colour in [0, 1]³, by interpolation between fits (Jakob and Hanika 2019, §3.3).
///
/// A colour is which component is the brightest, its value, and how the other two compare with it: a table of three dimensions for
/// each of red, green and blue. Nodes lie densest where coefficients change most: where ratios are near 0, and values near 0 and 1.
#[derive(Debug)]
pub(super) struct ReflectanceTable {
    /// `[brightest][value][second ratio][first ratio]`.
    nodes: Vec<[f32; 3]>,
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
    let first = LEAST_RATIO.sqrt();
    (first + (1.0 - first) * i as f64 / (RATIOS - 1) as f64).powi(2)
}

/// The place among the nodes of a value from [`DARKEST`] to [`LIGHTEST`], as a node and an offset to the next one in [0, 1].
#[inline]
fn value_cell(v: f32) -> (usize, f32) {
    static NODES: LazyLock<[f32; VALUES]> = LazyLock::new(|| std::array::from_fn(|i| value(i) as f32));
    let nodes = &*NODES;
    let after = nodes.partition_point(|node| *node <= v).clamp(1, VALUES - 1);
    let (a, b) = (nodes[after - 1], nodes[after]);
    (after - 1, ((v - a) / (b - a)).clamp(0.0, 1.0))
}

/// As [`value_cell`], for a ratio in [0, 1].
#[inline]
fn ratio_cell(r: f32) -> (usize, f32) {
    let first = LEAST_RATIO.sqrt() as f32;
    let at = (r.sqrt() - first).max(0.0) * ((RATIOS - 1) as f32 / (1.0 - first));
    let cell = (at as usize).min(RATIOS - 2);
    (cell, at - cell as f32)
}

impl ReflectanceTable {
    /// The table, made on the first call.
    pub(super) fn get() -> &'static Self {
        static TABLE: LazyLock<ReflectanceTable> = LazyLock::new(ReflectanceTable::new);
        &TABLE
    }

    fn new() -> Self {
        let mut nodes = Vec::with_capacity(3 * VALUES * RATIOS * RATIOS);
        for brightest in 0..3 {
            for z in 0..VALUES {
                for y in 0..RATIOS {
                    for x in 0..RATIOS {
                        let mut rgb = [value(z); 3];
                        rgb[(brightest + 1) % 3] *= ratio(x);
                        rgb[(brightest + 2) % 3] *= ratio(y);
                        let (rgb, before) = (DVec3::from_array(rgb), nodes.last().filter(|_| x > 0));
                        let shape = match before {
                            Some(&coefficients) => upsample::reflectance_near(rgb, Sigmoid { coefficients }),
                            None => upsample::reflectance(rgb),
                        };
                        nodes.push(shape.coefficients);
                    }
                }
            }
        }
        Self { nodes }
    }

    /// The smooth reflectance of `rgb`, linear and in [0, 1], and a factor on it.
    #[inline]
    pub(super) fn find(&self, rgb: [f32; 3]) -> (Sigmoid, f32) {
        let brightest = (1..3).fold(0, |m, i| if rgb[i] > rgb[m] { i } else { m });
        let v = rgb[brightest];
        if v <= 0.0 {
            return (Sigmoid { coefficients: [0.0; 3] }, 0.0);
        }
        let cell = |i: usize| ratio_cell(rgb[(brightest + i) % 3] / v);
        let in_table = v.clamp(DARKEST, LIGHTEST);
        let ((x, r), (y, s), (z, t)) = (cell(1), cell(2), value_cell(in_table));
        let mut coefficients = [0.0; 3];
        for (dz, wz) in [(0, 1.0 - t), (1, t)] {
            let row = (brightest * VALUES + z + dz) * RATIOS;
            for (dy, wy) in [(0, wz * (1.0 - s)), (1, wz * s)] {
                let first = (row + y + dy) * RATIOS + x;
                let (a, b) = (self.nodes[first], self.nodes[first + 1]);
                (0..3).for_each(|i| coefficients[i] += wy * (a[i] * (1.0 - r) + b[i] * r));
            }
        }
        (Sigmoid { coefficients }, v / in_table)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Random;
    use crate::spectrum::Spectrum;

    /// Random colours of all kinds are met within .01 of linear Rec.709, and on average within .0008.
    #[test]
    fn colors_are_met() {
        let table = ReflectanceTable::get();
        let mut random = Random(3);
        let (mut sum, n) = (0.0, 4000);
        for i in 0..n {
            let power = [1.0, 2.2, 4.0][i % 3];
            let rgb = [0; 3].map(|_| random.f64().powf(power) as f32);
            let (shape, scale) = table.find(rgb);
            let found = Spectrum::Scaled { scale, shape }.reflected_rgb();
            let error = (0..3).map(|i| (found[i] - rgb[i]).abs()).fold(0.0, f32::max);
            sum += error / n as f32;
            assert!(error < 1e-2, "{error} at {rgb:?}");
        }
        assert!(sum < 8e-4, "{sum}");
    }
}
