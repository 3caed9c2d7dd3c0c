//! Integrators that now and then send a bad sample, are slow, or panic.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use pointillist::color::Xyz;
use pointillist::math::bits::mix;
use pointillist::stream::{PathCounts, SampleSink};
use pointillist::tracer::Integrator;

/// The message of a panic that is meant.
pub const PANIC: &str = "a panic of the soak";

/// What goes wrong in a render.
#[derive(Clone, Copy, Debug, Default)]
pub struct FaultPlan {
    /// Decides which paths have a bad sample.
    pub seed: u64,
    /// One path of so many sends a bad sample besides its own; 0 is none.
    pub bad: u64,
    /// The path that panics in the middle of its samples.
    pub panics: Option<u64>,
    /// One path of so many takes a few milliseconds; 0 is none.
    pub slow: u64,
}

/// Samples that were made, the bad ones among them, and paths begun.
#[derive(Debug, Default)]
pub struct Made {
    pub samples: AtomicU64,
    pub bad: AtomicU64,
    pub paths: AtomicU64,
}

/// An integrator with faults.
pub struct Faulty<I> {
    pub inner: I,
    pub plan: FaultPlan,
    pub made: Arc<Made>,
}

/// Counts what goes through, also when the path panics.
struct CountedSink<'a, S> {
    out: &'a mut S,
    count: u64,
    made: &'a Made,
}

impl<S> Drop for CountedSink<'_, S> {
    fn drop(&mut self) {
        self.made.samples.fetch_add(self.count, Ordering::Relaxed);
    }
}

impl<S: SampleSink> SampleSink for CountedSink<'_, S> {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.count += 1;
        self.out.camera(uv, value, weight);
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.count += 1;
        self.out.light(uv, value);
    }

    fn is_wanted(&self) -> bool {
        self.out.is_wanted()
    }
}

impl<I: Integrator> Integrator for Faulty<I> {
    type Scratch = I::Scratch;

    fn trace(&self, index: u64, scratch: &mut I::Scratch, out: &mut impl SampleSink) {
        let FaultPlan { seed, bad, panics, slow } = self.plan;
        self.made.paths.fetch_add(1, Ordering::Relaxed);
        let mut out = CountedSink { out, count: 0, made: &self.made };
        let dice = mix(index ^ seed);
        let hits = |one_in: u64, dice: u64| one_in > 0 && dice.is_multiple_of(one_in);
        if hits(slow, dice >> 8) {
            std::thread::sleep(Duration::from_millis(dice >> 60));
        }
        if hits(bad, dice) {
            self.made.bad.fetch_add(1, Ordering::Relaxed);
            let one = Xyz::new(1.0, 1.0, 1.0);
            match dice >> 61 {
                0 => out.camera([0.5; 2], Xyz::new(1.0, f32::NAN, 1.0), 1.0),
                1 => out.light([0.5; 2], Xyz::new(f32::INFINITY, 0.0, 0.0)),
                2 => out.camera([f32::NAN, 0.5], one, 1.0),
                3 => out.camera([0.5; 2], one, -1.0),
                4 => out.camera([0.5; 2], one, f32::NAN),
                5 => out.light([3.0, 0.5], one),
                6 => out.camera([0.5; 2], one * 1e36, 1.0),
                _ => out.light([0.5, f32::NEG_INFINITY], one * f32::NAN),
            }
        }
        self.inner.trace(index, scratch, &mut out);
        if panics == Some(index) {
            std::panic::panic_any(PANIC);
        }
    }

    fn paths_per_index(&self) -> PathCounts {
        self.inner.paths_per_index()
    }
}
