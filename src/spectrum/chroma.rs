//! Smooth spectra for the many colours of a picture: a table over chromaticity, filled as far as it is used.

use super::sigmoid::Sigmoid;
use super::upsample;
use glam::DVec3;

/// Nodes along each axis of the table.
const NODES: usize = 65;

/// Finds the [`Sigmoid`] of colours whose brightest component is ½, as emission is made of.
///
/// Such a colour is which component is the brightest, and how the other two compare with it: a table of two
/// dimensions for each of red, green and blue. Its nodes are fitted when they are first needed (some 20 µs each) and
/// lie densest where those ratios are near 0, where coefficients change most. Between nodes coefficients are
/// interpolated: colours are met within 10⁻³ of their brightest component (held by a test). Greys are exact.
#[derive(Debug)]
pub(super) struct ChromaTable {
    /// `[brightest][second ratio][first ratio]`.
    nodes: Vec<Option<[f32; 3]>>,
}

impl ChromaTable {
    /// An empty table.
    pub(super) fn new() -> Self {
        Self { nodes: vec![None; 3 * NODES * NODES] }
    }

    /// The smooth spectrum, with values around ½, of the chromaticity of `rgb`, whose components are finite and not
    /// negative and not all 0.
    pub(super) fn shape(&mut self, rgb: [f32; 3]) -> Sigmoid {
        let brightest = (1..3).fold(0, |m, i| if rgb[i] > rgb[m] { i } else { m });
        let ratio = |i: usize| (rgb[(brightest + i) % 3] / rgb[brightest]).sqrt() * (NODES - 1) as f32;
        let (a, b) = (ratio(1), ratio(2));
        let (x, y) = ((a as usize).min(NODES - 2), (b as usize).min(NODES - 2));
        let (s, t) = (a - x as f32, b - y as f32);
        let mut coefficients = [0.0; 3];
        for (dx, dy, weight) in
            [(0, 0, (1.0 - s) * (1.0 - t)), (1, 0, s * (1.0 - t)), (0, 1, (1.0 - s) * t), (1, 1, s * t)]
        {
            if weight > 0.0 {
                let node = self.node(brightest, x + dx, y + dy);
                (0..3).for_each(|i| coefficients[i] += weight * node[i]);
            }
        }
        Sigmoid { coefficients }
    }

    fn node(&mut self, brightest: usize, x: usize, y: usize) -> [f32; 3] {
        *self.nodes[(brightest * NODES + y) * NODES + x].get_or_insert_with(|| {
            if (x, y) == (NODES - 1, NODES - 1) {
                return [0.0; 3];
            }
            let component = |i: usize| 0.5 * (i as f64 / (NODES - 1) as f64).powi(2);
            let mut rgb = [0.5; 3];
            (rgb[(brightest + 1) % 3], rgb[(brightest + 2) % 3]) = (component(x), component(y));
            upsample::reflectance(DVec3::from_array(rgb)).coefficients
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spectrum::Spectrum;

    /// Colours on and off the nodes, saturated ones, greys: what the interpolated spectrum looks like under D65.
    #[test]
    fn colours_are_met() {
        let mut table = ChromaTable::new();
        let levels = [0.0f32, 1e-4, 1e-3, 0.013, 0.09, 0.3, 0.57, 0.93, 1.0];
        let mut worst = (0f32, [0.0; 3]);
        for brightest in 0..3 {
            for a in levels {
                for b in levels {
                    let mut rgb = [1.0; 3];
                    (rgb[(brightest + 1) % 3], rgb[(brightest + 2) % 3]) = (a, b);
                    let found = Spectrum::Scaled { scale: 2.0, shape: table.shape(rgb) }.reflected_rgb();
                    let off = (0..3).map(|i| (found[i] - rgb[i]).abs()).fold(0.0, f32::max);
                    if off > worst.0 {
                        worst = (off, rgb);
                    }
                }
            }
        }
        assert!(worst.0 < 1e-3, "{worst:?}");
        assert_eq!(table.shape([7.0; 3]).coefficients, [0.0; 3]);
    }
}
