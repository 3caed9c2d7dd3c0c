//! Nanoseconds per block and per path of the sampler.

use std::hint::black_box;
use std::time::Instant;

use pointillist::tracer::Sampler;

use super::common::Outcome;

const PATHS: u64 = 1 << 20;

/// Times paths of three lengths.
pub fn run() -> Outcome {
    let time = |name: &str, blocks: f64, path: &dyn Fn(u64) -> f32| {
        let best = (0..7)
            .map(|round| {
                let start = Instant::now();
                let sum: f32 = (0..PATHS).map(|i| path(black_box(i + round * PATHS))).sum();
                black_box(sum);
                start.elapsed().as_secs_f64() * 1e9 / PATHS as f64
            })
            .fold(f64::INFINITY, f64::min);
        println!("{name:<28} {best:7.1} ns per path {:7.1} ns per block", best / blocks);
    };
    time("camera and first vertex", 2.0, &|index| walk(index, 1));
    time("path of five vertices", 6.0, &|index| walk(index, 5));
    time("path of ten vertices", 11.0, &|index| walk(index, 10));
    Ok(())
}

fn walk(index: u64, vertices: u32) -> f32 {
    let sampler = Sampler::at(index, 1);
    let camera = sampler.camera();
    let mut sum = (camera.screen[0] + camera.screen[1]) as f32 + camera.wavelength;
    for depth in 0..vertices {
        let n = sampler.vertex(depth);
        sum += n.light[0] + n.light[1] + n.bsdf[0] + n.bsdf[1] + n.light_choice as f32 + n.lobe + n.roulette;
    }
    sum
}
