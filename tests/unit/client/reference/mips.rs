//! Tests of `client::reference::mips`.

use pointillist::client::reference::mips::*;
use pointillist::image::Grid;

/// Totals stay at odd sizes, where the plain 2×2 average loses the last row and column.
#[test]
fn every_level_has_the_mean() {
    for (w, h) in [(1, 1), (7, 5), (13, 1), (1, 9), (518, 518), (33, 64)] {
        let data: Vec<f32> =
            (0..w * h).map(|i| if i == w * h - 1 { 1000.0 } else { (i % 7) as f32 }).collect();
        let mean = data.iter().sum::<f32>() / data.len() as f32;
        let levels = pyramid(Grid::from_rows(w, h, data).expect("w·h pixels")).expect("memory");
        assert_eq!(levels.len(), w.max(h).ilog2() as usize + 1);
        for level in &levels {
            let m = level.pixels().iter().sum::<f32>() / level.pixels().len() as f32;
            assert!((m / mean - 1.0).abs() < 1e-4, "{w}×{h} level {}×{}", level.width(), level.height());
        }
        if w % 2 == 1 && w > 1 && h > 1 {
            let (base, half) = (&levels[0], &levels[1]);
            let naive: f32 = (0..half.width() * half.height())
                .map(|i| (2 * (i % half.width()), 2 * (i / half.width())))
                .map(|(x, y)| 0.25 * (base.at(x, y) + base.at(x + 1, y) + base.at(x, y + 1)))
                .sum();
            assert!((naive / half.pixels().len() as f32 / mean - 1.0).abs() > 0.05);
        }
    }
}

#[test]
fn trilinear_of_a_ramp_is_the_ramp() {
    let data = (0..64 * 64).map(|i| (i % 64) as f32 + 0.5).collect();
    let levels = pyramid(Grid::from_rows(64, 64, data).expect("4096 pixels")).expect("memory");
    for lod in [0.0, 0.3, 1.0, 2.7] {
        assert!((trilinear(&levels, [0.5, 0.25], lod) - 32.0).abs() < 1e-4);
    }
}
