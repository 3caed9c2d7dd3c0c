//! Tests of `client::reference::reconstruct`.

use glam::Vec4;
use pointillist::client::reference::reconstruct::*;
use pointillist::image::Grid;

/// Catmull–Rom splines reproduce polynomials up to the second degree, in either direction.
#[test]
fn splines_reproduce_quadratics() {
    let value = |x: f32, y: f32| Vec4::new(1.0 + x - 0.25 * x * x, y * y - 2.0 * y, x * y, 1.0);
    let centre = |i: usize| i as f32 + 0.5;
    let texels = (0..12 * 10).map(|i| value(centre(i % 12), centre(i / 12))).collect();
    let level = Grid::from_rows(12, 10, texels).expect("full rows");
    for i in 0..200 {
        // Where no tap lies beyond the edge.
        let p = [2.0 + 0.037 * i as f32, 2.0 + 0.029 * i as f32];
        let off = (catmull_rom(&level, p) - value(p[0], p[1])).abs().max_element();
        assert!(off < 2e-4, "{p:?}: off by {off}");
    }
}
