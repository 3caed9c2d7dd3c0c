//! Clocks, order statistics, a straight line through points, scenes ready to render, and a sink that keeps nothing.

use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use pointillist::color::Xyz;
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::integrator::RenderContext;
use pointillist::tracer::{Camera, Scene};

/// What a benchmark returns.
pub type Outcome<T = ()> = Result<T, Box<dyn std::error::Error>>;

/// CPU time of this thread, seconds; wall time where the system does not tell.
pub fn thread_seconds() -> f64 {
    #[cfg(target_os = "linux")]
    return seconds(rustix::time::ClockId::ThreadCPUTime);
    #[cfg(not(target_os = "linux"))]
    wall_seconds()
}

/// CPU time of all threads of this process, seconds; wall time where the system does not tell.
pub fn process_seconds() -> f64 {
    #[cfg(target_os = "linux")]
    return seconds(rustix::time::ClockId::ProcessCPUTime);
    #[cfg(not(target_os = "linux"))]
    wall_seconds()
}

#[cfg(target_os = "linux")]
fn seconds(clock: rustix::time::ClockId) -> f64 {
    let now = rustix::time::clock_gettime(clock);
    now.tv_sec as f64 + 1e-9 * now.tv_nsec as f64
}

#[cfg(not(target_os = "linux"))]
fn wall_seconds() -> f64 {
    static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
    START.elapsed().as_secs_f64()
}

/// The result of `work`, and the wall time it took in seconds.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64())
}

/// The number of cores that this process may use.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The values at these quantiles, each the nearest of the sorted values.
pub fn quantiles<const N: usize>(mut values: Vec<f64>, at: [f64; N]) -> [f64; N] {
    values.sort_by(f64::total_cmp);
    at.map(|q| values[((values.len() - 1) as f64 * q).round() as usize])
}

/// The value in the middle, or the mean of the two in the middle.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 { f64::NAN } else { 0.5 * (values[(n - 1) / 2] + values[n / 2]) }
}

/// Slope and value at 0 of the least-squares line through points.
pub fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (mx, my) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
    let (xy, xx) =
        points.iter().fold((0.0, 0.0), |(xy, xx), p| (xy + (p.0 - mx) * (p.1 - my), xx + (p.0 - mx).powi(2)));
    let slope = if xx > 0.0 { xy / xx } else { 0.0 };
    (slope, my - slope * mx)
}

/// A scene file, prepared with its own camera and integrator, seed 0, the whole picture.
pub fn context(path: &Path) -> Outcome<RenderContext> {
    let desc = pointillist::scene::load(path, &[])?.desc;
    let scene = Arc::new(Scene::prepare(&desc)?);
    Ok(RenderContext::new(scene, Camera::of(&desc)?, &desc.integrator, 0, UvWindow::PICTURE))
}

/// Takes samples and forgets them.
pub struct Nowhere;

impl SampleSink for Nowhere {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        black_box((uv, value, weight));
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        black_box((uv, value));
    }
}
