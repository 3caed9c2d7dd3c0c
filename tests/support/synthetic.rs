//! Integrators that need no scene, and loops that a client of the server would run.

use std::sync::Arc;
use std::time::{Duration, Instant};

use pointillist::color::Xyz;
use pointillist::math::bits::mix;
use pointillist::server::{RenderJob, Server};
use pointillist::stream::{
    Block, DrainOrder, Epoch, Event, FinishReason, Lanes, PathCounts, Sample, SampleSink,
};
use pointillist::tracer::Integrator;

/// An integrator made of a function of (index, sink).
pub struct Synthetic<F>(pub F);

/// The sink as an object, so that a closure can take it.
pub trait Out {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32);
    fn light(&mut self, uv: [f32; 2], value: Xyz);
}

impl<S: SampleSink> Out for S {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        SampleSink::camera(self, uv, value, weight);
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        SampleSink::light(self, uv, value);
    }
}

impl<F: Fn(u64, &mut dyn Out) + Send + Sync + 'static> Integrator for Synthetic<F> {
    type Scratch = ();

    fn trace(&self, index: u64, _: &mut (), out: &mut impl SampleSink) {
        (self.0)(index, out);
    }

    fn paths_per_index(&self) -> PathCounts {
        PathCounts { camera: 1, light: 2 }
    }
}

/// Shorthand that fixes the type of the closure.
pub fn synthetic<F: Fn(u64, &mut dyn Out) + Send + Sync + 'static>(f: F) -> Arc<Synthetic<F>> {
    Arc::new(Synthetic(f))
}

/// Zero to three samples a path, on both streams, that name their index.
pub fn varied(index: u64, out: &mut dyn Out) {
    let h = mix(index);
    for i in 0..h % 4 {
        let uv = [(h >> 40) as f32 / 16_777_216.0, i as f32 / 4.0];
        let value = Xyz::new((index % 65_536) as f32, (index / 65_536) as f32, i as f32);
        if (h >> 20 ^ i) & 1 == 0 {
            out.camera(uv, value, 1.0);
        } else {
            out.light(uv, value);
        }
    }
}

/// One sample with value `y`.
pub fn flat(y: f32) -> impl Fn(u64, &mut dyn Out) + Send + Sync + 'static {
    move |_, out| out.camera([0.5, 0.5], Xyz::new(y, y, y), 1.0)
}

/// The blocks and samples that a client has received.
#[derive(Default)]
pub struct Gathered {
    pub samples: Vec<Sample>,
    pub blocks: Vec<pointillist::stream::Header>,
    pub lens: Vec<usize>,
}

impl Gathered {
    pub fn take(&mut self, block: &Block) {
        self.samples.extend_from_slice(block.samples());
        self.blocks.push(block.header);
        self.lens.push(block.samples().len());
    }

    pub fn paths(&self) -> PathCounts {
        self.blocks.iter().fold(PathCounts::default(), |sum, block| PathCounts {
            camera: sum.camera + block.paths.camera,
            light: sum.light + block.paths.light,
        })
    }

    pub fn indices(&self) -> u64 {
        self.blocks.iter().map(|block| block.index_count).sum()
    }

    /// The samples as sorted bit patterns: a multiset.
    pub fn multiset(&self) -> Vec<[u32; 6]> {
        let mut bits: Vec<_> = self.samples.iter().map(bits).collect();
        bits.sort_unstable();
        bits
    }

    /// The samples as bit patterns, in order.
    pub fn sequence(&self) -> Vec<[u32; 6]> {
        self.samples.iter().map(bits).collect()
    }
}

fn bits(s: &Sample) -> [u32; 6] {
    [s.uv[0], s.uv[1], s.xyz.x, s.xyz.y, s.xyz.z, s.w].map(f32::to_bits)
}

const BUDGET: usize = 64 * 1024;
const STEP: Duration = Duration::from_millis(50);
/// A time that passes only when something hangs.
const HANG: Duration = Duration::from_secs(120);

/// Drains until the render of `epoch` has finished.
pub fn gather(server: &Server, lanes: &mut Lanes, epoch: Epoch) -> (Gathered, FinishReason) {
    gather_in(DrainOrder::Arrival, server, lanes, epoch)
}

/// Drains in a given order until the render of `epoch` has finished.
pub fn gather_in(
    order: DrainOrder,
    server: &Server,
    lanes: &mut Lanes,
    epoch: Epoch,
) -> (Gathered, FinishReason) {
    let mut gathered = Gathered::default();
    let start = Instant::now();
    lanes.follow(epoch, order);
    while start.elapsed() < HANG {
        while lanes.drain(BUDGET, |block| gathered.take(block)).blocks > 0 {}
        if !lanes.is_drained() {
            lanes.wait(STEP);
            continue;
        }
        while let Some(Event::Finished { epoch: ended, reason, .. }) = server.event() {
            if ended == epoch {
                assert_eq!(lanes.drain(BUDGET, |_| {}).blocks, 0, "drained, but a block was left");
                return (gathered, reason);
            }
        }
        panic!("render {epoch:?} is drained, but there is no event");
    }
    panic!("render {epoch:?} does not finish; stands at {}", lanes.next_index());
}

/// Waits for the finish event without draining.
pub fn finish_of(server: &Server, epoch: Epoch) -> FinishReason {
    let start = Instant::now();
    while start.elapsed() < HANG {
        if let Some(Event::Finished { epoch: ended, reason, .. }) = server.wait_event(STEP)
            && ended == epoch
        {
            return reason;
        }
    }
    panic!("render {epoch:?} does not finish");
}

/// Starts a server and renders one job on it to the end.
pub fn render_all<I: Integrator>(threads: usize, job: RenderJob<I>) -> (Gathered, FinishReason) {
    let (server, mut lanes) = Server::start(threads).expect("threads");
    server.render(job, Epoch(1)).expect("first epoch");
    gather(&server, &mut lanes, Epoch(1))
}
