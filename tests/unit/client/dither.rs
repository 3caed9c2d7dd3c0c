//! Tests of `client::dither`.

use pointillist::client::dither::*;
use pointillist::client::settings::Dither;

#[test]
fn thresholds_are_spread_evenly() {
    for (kind, side) in [(Dither::Ordered, 8), (Dither::BlueNoise, MASK_SIDE)] {
        let count = side * side;
        for c in 0..3 {
            let mut seen = vec![false; count];
            (0..count)
                .for_each(|i| seen[(thresholds(kind, i % side, i / side)[c] * count as f32) as usize] = true);
            assert!(seen.iter().all(|s| *s), "{kind:?}: some threshold is missing");
        }
    }
    assert_eq!(thresholds(Dither::None, 5, 9), [0.5; 3]);
}

/// Zero mean error, for every value between two steps.
#[test]
fn the_mean_is_kept() {
    for kind in [Dither::Ordered, Dither::BlueNoise] {
        for i in 0..=20 {
            let value = 100.0 + i as f32 / 20.0;
            let at = |i: usize| (value + thresholds(kind, i % 64, i / 64)[1]).floor();
            let mean = (0..4096).map(at).sum::<f32>() / 4096.0;
            assert!((mean - value).abs() <= 0.5 / 64.0 + 1e-4, "{kind:?}: {value} became {mean}");
        }
    }
}

/// What makes noise blue: averages over squares of `n` texels are nearly the same. White noise deviates by 0.289 / n,
/// this mask by 42 % of it for 4×4, 27 % for 8×8 and 24 % for 16×16.
#[test]
fn the_mask_has_no_low_frequencies() {
    let mask = blue_noise();
    for (n, part_of_white) in [(4, 0.5), (8, 0.3), (16, 0.3)] {
        let across = MASK_SIDE / n;
        let mean = |b: usize| {
            let at = |i: usize| mask[n * (b % across) + i % n + MASK_SIDE * (n * (b / across) + i / n)];
            (0..n * n).map(at).sum::<f32>() / (n * n) as f32
        };
        let squares: f32 = (0..across * across).map(|b| (mean(b) - 0.5).powi(2)).sum();
        let deviation = (squares / (across * across) as f32).sqrt();
        let white = 1.0 / 12f32.sqrt() / n as f32;
        assert!(deviation < part_of_white * white, "{n}: {deviation}, white {white}");
    }
}
