//! The map of costs: what paths take by region, only where somebody asks for it, and anew for every render.

use std::sync::Arc;
use std::time::Duration;

use pointillist::color::Xyz;
use pointillist::server::{COST_CELLS, CostMap, RenderJob, Server};
use pointillist::stream::{DrainOrder, Epoch, Lanes, PathCounts, SampleSink};
use pointillist::tracer::Integrator;

/// Costs ten times as much in the left half.
struct Lopsided;

impl Integrator for Lopsided {
    type Scratch = ();

    fn trace(&self, index: u64, _: &mut (), out: &mut impl SampleSink) {
        let turns = |by: f64| (index as f64 * by).fract() as f32;
        let uv = [turns(0.569_840_290_998_053_3), turns(0.754_877_666_246_692_8)];
        let work = if uv[0] < 0.5 { 20_000 } else { 2_000 };
        std::hint::black_box((0..work).fold(0u64, |sum, i| std::hint::black_box(sum ^ i)));
        out.camera(uv, Xyz::new(1.0, 1.0, 1.0), 1.0);
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 1, light: 0 }
    }
}

fn run(server: &Server, lanes: &mut Lanes, epoch: u64, paths: u64) -> CostMap {
    server.render(RenderJob::new(Arc::new(Lopsided), 0..paths), Epoch(epoch)).unwrap();
    lanes.follow(Epoch(epoch), DrainOrder::Arrival);
    while !lanes.is_drained() {
        lanes.wait(Duration::from_millis(100));
        lanes.drain(usize::MAX, |_| {});
    }
    server.cost_map()
}

#[test]
fn dear_regions_are_told_from_cheap_ones() {
    let (server, mut lanes) = Server::start(2).unwrap();
    assert!(run(&server, &mut lanes, 1, 2000).counts.iter().all(|count| *count == 0), "nobody asked");
    server.set_cost_map(true);
    let map = run(&server, &mut lanes, 2, 100_000);
    assert_eq!(map.counts.len(), COST_CELLS * COST_CELLS);
    let timed: u64 = map.counts.iter().sum();
    assert!((190..=200).contains(&timed), "{timed}");
    let mean = |left: bool| {
        let cells = (0..map.counts.len()).filter(|i| (i % COST_CELLS < COST_CELLS / 2) == left);
        let (time, n) = cells
            .fold((0.0, 0), |(time, n), i| (time + map.seconds[i] * map.counts[i] as f64, n + map.counts[i]));
        time / n as f64
    };
    let ratio = mean(true) / mean(false);
    assert!((4.0..25.0).contains(&ratio), "{ratio}");
    assert!((map.shares().iter().sum::<f64>() - 1.0).abs() < 1e-9);
    let fresh = run(&server, &mut lanes, 3, 1500);
    assert!(fresh.counts.iter().sum::<u64>() < 10, "a render begins with nothing");
}
