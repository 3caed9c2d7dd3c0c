//! The share of the largest sample of a pixel in its sum.
//!
//! Shared by a test and by the tool that measures it at full length.

use std::sync::Arc;

use pointillist::color::Xyz;
use pointillist::scene::desc::{IntegratorKind, SceneDesc};
use pointillist::stream::{PathCounts, SampleSink, UvWindow};
use pointillist::tracer::integrator::{BidirectionalTracer, ParticleTracer, PhotonTracer, RenderContext};
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

/// Sum and largest of what samples add to a pixel.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    pub sum: f64,
    pub largest: f64,
    pub samples: u64,
}

impl Tally {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.largest = self.largest.max(value);
        self.samples += 1;
    }

    fn join(&mut self, other: &Tally) {
        self.sum += other.sum;
        self.largest = self.largest.max(other.largest);
        self.samples += other.samples;
    }

    /// The share of the largest sample; of nothing it is 0.
    pub fn share(&self) -> f64 {
        if self.sum > 0.0 { self.largest / self.sum } else { 0.0 }
    }
}

/// One pixel: camera samples count as they are, light samples by its area.
struct Pixel {
    tally: Tally,
    area: f64,
}

impl SampleSink for Pixel {
    fn camera(&mut self, _: [f32; 2], value: Xyz, weight: f32) {
        self.tally.add(f64::from(value.y * weight));
    }

    fn light(&mut self, _: [f32; 2], value: Xyz) {
        self.tally.add(f64::from(value.y) / self.area);
    }
}

/// All pixels of a small picture, light samples only.
struct Picture {
    side: usize,
    tallies: Vec<Tally>,
}

impl SampleSink for Picture {
    fn camera(&mut self, _: [f32; 2], _: Xyz, _: f32) {}

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        let [x, y] = uv.map(|c| (c * self.side as f32) as usize);
        if x < self.side && y < self.side {
            self.tallies[y * self.side + x].add(f64::from(value.y));
        }
    }
}

fn render_context(desc: &SceneDesc, window: UvWindow) -> RenderContext {
    let scene = Arc::new(Scene::prepare(desc).expect("the scene is valid"));
    let camera = Camera::of(desc).expect("the camera is valid");
    RenderContext::new(scene, camera, &desc.integrator, 1, window)
}

/// The pixels of a grid of `side` × `side` over a picture of 512 × 512, by `paths` camera paths within each: by path tracing,
/// by photon mapping, each pixel with a map of its own, or bidirectionally, with its share of light subpaths, whose samples in the
/// pixel count, too. Two threads.
pub fn by_pixel(desc: &SceneDesc, method: IntegratorKind, side: usize, paths: u64) -> Vec<Tally> {
    let whole = render_context(desc, UvWindow::PICTURE);
    let pixel = |i: usize| {
        let at = |k: usize| ((k as f32 + 0.5) / side as f32 * 512.0).floor() / 512.0;
        let min = [at(i % side), at(i / side)];
        let window = UvWindow { min, max: min.map(|c| c + 1.0 / 512.0) };
        let context = RenderContext { window, ..whole.clone() };
        let mut sink = Pixel { tally: Tally::default(), area: 512f64.powi(-2) };
        match method {
            IntegratorKind::Bidirectional => {
                let tracer = BidirectionalTracer { context };
                let PathCounts { camera, light } = tracer.paths_per_index();
                // A light path stands for so many camera paths.
                sink.area *= light as f64 / camera as f64;
                trace(&tracer, 0..paths / camera, &mut sink);
            }
            IntegratorKind::Photon => trace(&PhotonTracer::new(context, true), 0..paths, &mut sink),
            _ => trace(&PathTracer { context }, 0..paths, &mut sink),
        }
        sink.tally
    };
    std::thread::scope(|scope| {
        let odd = scope.spawn(|| (1..side * side).step_by(2).map(pixel).collect::<Vec<_>>());
        let even: Vec<_> = (0..side * side).step_by(2).map(pixel).collect();
        let mut odd = odd.join().expect("no path panics").into_iter();
        even.into_iter().flat_map(|t| [Some(t), odd.next()]).flatten().collect()
    })
}

/// The pixels of a picture of `side` × `side` by particle tracing: `paths` light paths for each pixel. Two threads.
pub fn by_particles(desc: &SceneDesc, side: usize, paths: u64) -> Vec<Tally> {
    let tracer = ParticleTracer { context: render_context(desc, UvWindow::PICTURE) };
    let total = paths * (side * side) as u64;
    let part = |range: std::ops::Range<u64>| {
        let mut sink = Picture { side, tallies: vec![Tally::default(); side * side] };
        trace(&tracer, range, &mut sink);
        sink.tallies
    };
    std::thread::scope(|scope| {
        let second = scope.spawn(|| part(total / 2..total));
        let mut all = part(0..total / 2);
        let second = second.join().expect("no path panics");
        all.iter_mut().zip(&second).for_each(|(a, b)| a.join(b));
        all
    })
}

fn trace<I: Integrator>(tracer: &I, range: std::ops::Range<u64>, sink: &mut impl SampleSink) {
    let mut scratch = I::Scratch::default();
    range.for_each(|index| tracer.trace(index, &mut scratch, sink));
}

/// The largest share of all pixels, and which pixel has it.
pub fn worst(tallies: &[Tally]) -> (usize, f64) {
    let shares = tallies.iter().map(Tally::share).enumerate();
    shares.fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a })
}
