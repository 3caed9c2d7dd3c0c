//! Tests of `tracer::photon_map::schedule`.

use pointillist::tracer::photon_map::*;

const SCHEDULE: Schedule = Schedule {
    paths_per_generation: 1024,
    samples_per_generation: 3000,
    radius: 0.1,
    beam_radius: 0.1,
    alpha: 2.0 / 3.0,
    neighbours: 50,
};

#[test]
fn radius_is_the_product() {
    for alpha in [0.0, 0.5, 2.0 / 3.0, 0.9] {
        let schedule = Schedule { alpha, ..SCHEDULE };
        let mut r2 = 0.01;
        for g in 1..=200_000u64 {
            if g.is_power_of_two() || g % 997 == 0 {
                let error = f64::from(schedule.radius(g)) / f64::sqrt(r2) - 1.0;
                assert!(error.abs() < 2e-7, "α {alpha} generation {g}: {error:e}");
            }
            r2 *= (g as f64 + alpha) / (g as f64 + 1.0);
        }
    }
}

#[test]
fn radius_ends_above_zero() {
    let last = SCHEDULE.lookup(u64::MAX);
    assert!(last.radius > 0.0 && last.radius < 1e-3, "{last:?}");
    assert_eq!(Schedule { alpha: 0.0, ..SCHEDULE }.radius(u64::MAX), 0.1 / 2f32.powi(32));
}

#[test]
fn paths_are_a_linear_function_of_samples() {
    let mut before = 0;
    for index in 0..20_000 {
        let ahead = SCHEDULE.paths_ahead(index);
        let needed = SCHEDULE.generations(index) * 1024;
        assert!(ahead >= before && ahead >= needed && ahead <= needed + 1024, "{index}: {ahead}");
        assert!(ahead - before <= 2 || index == 0 || index % 3000 == 0, "{index}: {before} to {ahead}");
        let line = 1024.0 * (1.0 + index as f64 / 3000.0);
        assert!((ahead as f64 - line).abs() <= 1024.0, "{index}: {ahead} against {line}");
        before = ahead;
    }
    // At the border nothing is missing.
    assert_eq!(SCHEDULE.paths_ahead(2999), SCHEDULE.generations(3000) * 1024);
}
