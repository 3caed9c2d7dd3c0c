//! Mean luminance of a scene by path tracing.

use pointillist::color::Xyz;
use pointillist::scene::desc::SceneDesc;
use pointillist::stream::SampleSink;
use pointillist::tracer::Integrator;

use super::tracer;

/// Keeps every camera sample's luminance.
#[derive(Default)]
pub struct Luminances(pub Vec<f32>);

impl SampleSink for Luminances {
    fn camera(&mut self, _: [f32; 2], value: Xyz, weight: f32) {
        assert!(value.is_finite() && weight == 1.0);
        self.0.push(value.y);
    }
    fn light(&mut self, _: [f32; 2], _: Xyz) {
        panic!("path tracing has no light stream");
    }
}

/// The luminance of `n` paths.
pub fn luminances(desc: &SceneDesc, n: u64) -> Vec<f32> {
    let tracer = tracer(desc);
    let mut sink = Luminances::default();
    (0..n).for_each(|i| tracer.trace(i, &mut (), &mut sink));
    sink.0
}

/// Mean luminance over `n` paths and its standard error as if they were independent (the sequence does better).
pub fn mean(desc: &SceneDesc, n: u64) -> (f64, f64) {
    let all = luminances(desc, n);
    let mean = all.iter().map(|&y| f64::from(y)).sum::<f64>() / n as f64;
    let variance = all.iter().map(|&y| (f64::from(y) - mean).powi(2)).sum::<f64>() / (n - 1) as f64;
    (mean, (variance / n as f64).sqrt())
}

/// Asserts that the mean luminance is `expected` within 4 standard errors and within `tolerance` (relative).
pub fn assert_mean(desc: &SceneDesc, expected: f64, tolerance: f64, what: &str) {
    let (found, error) = mean(desc, 1 << 17);
    let off = (found - expected).abs();
    assert!(
        off <= 4.0 * error + 1e-5 * expected && off <= tolerance * expected,
        "{what}: {found} ± {error} instead of {expected}"
    );
}
