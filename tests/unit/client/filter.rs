//! Tests of `client::filter`.

use pointillist::client::filter::*;
use pointillist::client::settings::{CHUNK_SAMPLES, FilmSpec, ScaledFilter, SplatFilter};

const ALL: [SplatFilter; 3] = [SplatFilter::Gaussian, SplatFilter::Tent, SplatFilter::Box];

#[test]
fn taps_follow_the_formula() {
    let smoothstep = |t: f64| t * t * (3.0 - 2.0 * t);
    let raw: Vec<f64> =
        (0..3).map(|i| (-f64::from(i * i)).exp() * (1.0 - smoothstep(f64::from(i) / 3.0).powi(8))).collect();
    let sum = raw[0] + 2.0 * raw[1] + 2.0 * raw[2];
    for i in 0..3 {
        assert!((f64::from(GAUSSIAN_TAPS[i]) - raw[i] / sum).abs() < 3e-8, "g{i}");
    }
    let [g0, g1, g2, _] = GAUSSIAN_TAPS.map(f64::from);
    assert!((g0 + 2.0 * g1 + 2.0 * g2 - 1.0).abs() < 3e-8);
}

/// One sprite adds 1 in all wherever it lies, and a sprite of 5 texels would not.
#[test]
fn one_sprite_sums_to_one() {
    let mut worst_of_five = 0.0f32;
    for filter in ALL {
        for i in 0..40_000 {
            let p = 3.0 + i as f32 * (517.0 / 40_000.0);
            let taps = filter.taps(p);
            let sum: f32 = taps.weights.iter().sum();
            assert!((sum - 1.0).abs() < 3e-7, "{filter:?} at {p}: {sum}");
            assert!(taps.weights.iter().all(|&w| w >= 0.0));
            if filter == SplatFilter::Gaussian {
                worst_of_five = worst_of_five.max(1.0 - taps.weights[..5].iter().sum::<f32>());
            }
        }
    }
    assert!(worst_of_five > 5e-3);
}

#[test]
fn taps_equal_the_weight_function() {
    for filter in ALL {
        for i in 0..5_000 {
            let p = i as f32 * 0.003_7;
            let taps = filter.taps(p);
            for (k, &w) in taps.weights.iter().enumerate().take(filter.taps_per_axis()) {
                let d = (taps.first + k as i32) as f32 + 0.5 - p;
                assert!((filter.weight(d) - w).abs() < 2e-6, "{filter:?} p {p} tap {k}");
            }
        }
    }
}

#[test]
fn energy_is_the_mean_square() {
    for filter in ALL {
        let n = 10_000;
        let mean = (0..n)
            .map(|i| filter.taps(10.0 + (i as f32 + 0.5) / n as f32))
            .map(|t| t.weights.iter().map(|&w| f64::from(w * w)).sum::<f64>())
            .sum::<f64>()
            / f64::from(n);
        assert!((mean * mean - f64::from(filter.energy())).abs() < 1e-6, "{filter:?}");
    }
}

/// Filters of a size of their own: Mitsuba's values (`rfilter.eval`, 3.9.1) but for a factor, which makes the integral 1.
#[test]
fn scaled_filters_are_mitsubas() {
    let sizes = [100u16, 250, 500, 600, 750, 1000, 1500, 3000];
    let gaussians = sizes[..5].iter().map(|&stddev| ScaledFilter::Gaussian { stddev });
    let tents = sizes[1..].iter().map(|&radius| ScaledFilter::Tent { radius });
    for filter in gaussians.chain(tents).map(SplatFilter::Scaled) {
        let n = 40_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..n {
            let p = 10.0 + (f64::from(i) + 0.5) / f64::from(n);
            let taps = filter.taps(p as f32);
            for (k, &w) in taps.weights.iter().enumerate() {
                let d = f64::from(taps.first) + k as f64 + 0.5 - p;
                assert!(w >= 0.0 && (filter.weight(d as f32) - w).abs() < 2e-4, "{filter:?} p {p} tap {k}");
                sum += f64::from(w) / f64::from(n);
                squares += f64::from(w * w) / f64::from(n);
            }
            assert_eq!(filter.weight(3.1), 0.0, "{filter:?} reaches past three texels");
        }
        assert!((sum - 1.0).abs() < 1e-4, "{filter:?}: {sum}");
        let energy = f64::from(filter.energy());
        assert!((squares * squares / energy - 1.0).abs() < 1e-3, "{filter:?}: {squares} {energy}");
    }
    let relative = |filter: ScaledFilter, d: f32| {
        let filter = SplatFilter::Scaled(filter);
        filter.weight(d) / filter.weight(0.0)
    };
    for (d, value) in [(0.5, 0.606_423), (1.0, 0.134_960), (1.5, 0.010_758)] {
        let ours = relative(ScaledFilter::Gaussian { stddev: 500 }, d);
        assert!((ours - value / 0.999_247).abs() < 5e-4, "{d}: {ours}");
    }
    assert!((relative(ScaledFilter::Tent { radius: 1500 }, 0.75) - 0.5).abs() < 1e-6);
}

#[test]
fn window_reaches_the_padding() {
    let spec = FilmSpec {
        width: 64,
        height: 32,
        filter: SplatFilter::Gaussian,
        variance: Some(Default::default()),
        sums: Default::default(),
    };
    assert_eq!(spec.padded_extent(), [70, 38]);
    assert_eq!(spec.texel_position(spec.window().min), [0.0, 0.0]);
    assert_eq!(spec.texel_position(spec.window().max), [70.0, 38.0]);
}

/// A batch has half a sample per texel, in whole chunks from 1 to 64 of them; its densest texel gets no more additions than are allowed.
#[test]
fn batches_grow_with_the_film() {
    let spec = |width, height| FilmSpec {
        width,
        height,
        filter: SplatFilter::Gaussian,
        variance: None,
        sums: Default::default(),
    };
    for ([width, height], chunks) in [
        ([1, 1], 1),
        ([360, 280], 1),
        ([512, 512], 2),
        ([1920, 1080], 15),
        ([3840, 2160], 63),
        ([16_000, 16_000], 64),
    ] {
        let spec = spec(width, height);
        assert_eq!(spec.batch_capacity(), chunks * CHUNK_SAMPLES, "{width}×{height}");
        let texels: f64 = spec.padded_extent().map(f64::from).iter().product();
        let adds = spec.batch_capacity() as f64 * 36.0 / (texels * f64::from(spec.batch_slots()));
        assert!(adds <= ADDS_PER_SUM as f64, "{width}×{height}: {adds}");
    }
}
