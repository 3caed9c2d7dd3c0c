//! Nanoseconds per path of server and stream around an empty integrator.

use std::sync::Arc;
use std::time::{Duration, Instant};

use pointillist::color::Xyz;
use pointillist::server::{RenderJob, Server};
use pointillist::stream::{DrainOrder, Epoch, PathCounts, SampleSink};
use pointillist::tracer::Integrator;

use super::common::Outcome;

/// Leaves `SAMPLES` samples per path and computes nothing.
struct Idle<const SAMPLES: usize>;

impl<const SAMPLES: usize> Integrator for Idle<SAMPLES> {
    type Scratch = ();

    fn trace(&self, index: u64, _: &mut (), out: &mut impl SampleSink) {
        let u = (index & 0xffff) as f32 / 65_536.0;
        for _ in 0..SAMPLES {
            out.camera([u, 0.5], Xyz::new(u, u, u), 1.0);
        }
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 1, light: 0 }
    }
}

/// Times zero to four samples per path, in order and in any order.
pub fn run() -> Outcome {
    println!("one tracing thread, the client drains and drops; ns per path");
    bench::<0>(false, false);
    bench::<1>(false, false);
    bench::<1>(false, true);
    bench::<1>(true, false);
    bench::<4>(false, false);
    Ok(())
}

fn bench<const SAMPLES: usize>(ordered: bool, timed: bool) {
    const PATHS: u64 = 8 << 20;
    let best = (1..=5)
        .map(|_| {
            let (server, mut lanes) = Server::start(1).expect("one thread");
            server.set_cost_map(timed);
            let start = Instant::now();
            let epoch = Epoch(1);
            let deadline = if ordered { None } else { Some(Duration::from_millis(2)) };
            let job = RenderJob { deadline, ..RenderJob::new(Arc::new(Idle::<SAMPLES>), 0..PATHS) };
            server.render(job, epoch).expect("first epoch");
            lanes.follow(epoch, if ordered { DrainOrder::Index { first: 0 } } else { DrainOrder::Arrival });
            while !lanes.is_drained() {
                lanes.wait(Duration::from_millis(100));
                lanes.drain(usize::MAX, |_| {});
            }
            let wall = start.elapsed().as_secs_f64();
            let total = server.stats().total();
            (wall, total.busy.as_secs_f64(), total.cpu.unwrap_or_default().as_secs_f64())
        })
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .expect("five runs");
    let ns = |seconds: f64| seconds * 1e9 / PATHS as f64;
    println!(
        "{SAMPLES} samples per path{}{}: busy {:5.1}  cpu {:5.1}  wall {:5.1}",
        if ordered { ", ordered" } else { "" },
        if timed { ", map of costs" } else { "" },
        ns(best.1),
        ns(best.2),
        ns(best.0)
    );
}
