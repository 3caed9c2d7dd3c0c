//! Small pictures by any method, from independent seeds: mean and variance of the mean in every pixel.

use std::sync::Arc;

use pointillist::color::Xyz;
use pointillist::image::compare::{Measured, ZTest, z_test};
use pointillist::scene::desc::SceneDesc;
use pointillist::stream::{SampleSink, UvWindow, eye};
use pointillist::tracer::integrator::{
    BidirectionalTracer, ParticleTracer, PhotonTracer, RenderContext, Stereo, VcmTracer,
};
use pointillist::tracer::sampler::cells::ScreenCells;
use pointillist::tracer::{Camera, Integrator, PathTracer, Scene};

use super::welch;

/// Which method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    Path,
    Particle,
    Bidirectional,
    Photon,
    Vcm,
}

/// Sums of luminance over the pixels of a picture.
struct Pixels {
    side: usize,
    camera: Vec<[f64; 2]>,
    light: Vec<f64>,
}

impl Pixels {
    fn of(&self, uv: [f32; 2]) -> Option<usize> {
        let [x, y] = uv.map(|c| (f64::from(c) * self.side as f64).floor());
        let inside = |c: f64| (0.0..self.side as f64).contains(&c);
        (inside(x) && inside(y)).then_some(y as usize * self.side + x as usize)
    }
}

impl Pixels {
    fn new(side: usize) -> Self {
        let pixels = side * side;
        Self { side, camera: vec![[0.0; 2]; pixels], light: vec![0.0; pixels] }
    }

    /// The picture of so many light paths.
    fn picture(&self, light_paths: u64) -> Vec<f64> {
        let pixels = self.side * self.side;
        let mean = |[sum, weight]: [f64; 2]| if weight > 0.0 { sum / weight } else { 0.0 };
        let per_path = pixels as f64 / light_paths.max(1) as f64;
        (0..pixels).map(|i| mean(self.camera[i]) + self.light[i] * per_path).collect()
    }
}

impl SampleSink for Pixels {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        assert!(value.is_finite(), "{value:?}");
        if let Some(i) = self.of(uv) {
            self.camera[i][0] += f64::from(value.y * weight);
            self.camera[i][1] += f64::from(weight);
        }
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        assert!(value.is_finite(), "{value:?}");
        if let Some(i) = self.of(uv) {
            self.light[i] += f64::from(value.y);
        }
    }
}

/// Sums of both eyes: that of the path in progress first.
struct PixelPair<'a> {
    eyes: [&'a mut Pixels; 2],
    /// Camera samples of the path's own eye, and of the other.
    samples: &'a mut [u64; 2],
}

impl SampleSink for PixelPair<'_> {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.samples[0] += 1;
        self.eyes[0].camera(uv, value, weight);
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.eyes[0].light(uv, value);
    }

    fn camera_of_other_eye(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.samples[1] += 1;
        self.eyes[1].camera(uv, value, weight);
    }

    fn light_of_other_eye(&mut self, uv: [f32; 2], value: Xyz) {
        self.eyes[1].light(uv, value);
    }
}

/// What a tracer of two eyes has made.
pub struct PairPicture {
    /// Luminance of the left and the right picture, one after the other.
    pub eyes: Vec<f64>,
    /// Camera paths that gave a sample to both eyes, over all; 0 of none.
    pub shared: f64,
}

/// Indices of so many paths.
fn indices<I: Integrator>(tracer: &I, paths: u64) -> u64 {
    let counts = tracer.paths_per_index();
    paths.div_ceil(counts.camera.max(counts.light))
}

fn trace<I: Integrator>(tracer: &I, side: usize, paths: u64) -> Vec<f64> {
    let (mut sums, mut scratch) = (Pixels::new(side), I::Scratch::default());
    let indices = indices(tracer, paths);
    (0..indices).for_each(|index| tracer.trace(index, &mut scratch, &mut sums));
    sums.picture(tracer.paths_per_index().light * indices)
}

fn trace_pair<I: Integrator>(tracer: &I, side: usize, paths: u64) -> PairPicture {
    let (mut eyes, mut samples) = ([Pixels::new(side), Pixels::new(side)], [0; 2]);
    let mut scratch = I::Scratch::default();
    let indices = indices(tracer, paths);
    for index in 0..indices {
        let [left, right] = &mut eyes;
        let own_first = if eye(index).0 == 0 { [left, right] } else { [right, left] };
        tracer.trace(index, &mut scratch, &mut PixelPair { eyes: own_first, samples: &mut samples });
    }
    let light_paths = tracer.paths_per_index().light * indices;
    PairPicture {
        eyes: eyes.iter().flat_map(|eye| eye.picture(light_paths)).collect(),
        shared: samples[1] as f64 / samples[0].max(1) as f64,
    }
}

/// One picture of a scene: side length in pixels, paths per pixel of one seed, seeds.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    pub side: usize,
    pub paths_per_pixel: u64,
    pub seeds: u32,
    pub window: UvWindow,
}

/// One picture of luminance per seed. Two threads.
pub fn repeat(desc: &SceneDesc, method: Method, plan: Plan) -> Vec<Vec<f64>> {
    repeat_through(&Camera::of(desc).expect("the camera is valid"), desc, method, plan)
}

/// The same through another camera than the scene's.
pub fn repeat_through(camera: &Camera, desc: &SceneDesc, method: Method, plan: Plan) -> Vec<Vec<f64>> {
    let paths = plan.paths_per_pixel * (plan.side as u64).pow(2);
    // Different methods get different seeds: what they share would not show.
    repeat_seeds(desc, camera, plan, 1000 * (method as u32 + 1), |context| match method {
        Method::Path => trace(&PathTracer { context }, plan.side, paths),
        Method::Particle => trace(&ParticleTracer { context }, plan.side, paths),
        Method::Bidirectional => trace(&BidirectionalTracer { context }, plan.side, paths),
        Method::Photon => trace(&PhotonTracer::new(context, true), plan.side, paths),
        Method::Vcm => trace(&VcmTracer::new(context, true), plan.side, paths),
    })
}

/// The pictures of both eyes per seed, from one tracer. `plan` has the paths of both together.
pub fn repeat_pair(
    desc: &SceneDesc,
    [left, right]: &[Camera; 2],
    method: Method,
    plan: Plan,
) -> Vec<PairPicture> {
    let paths = plan.paths_per_pixel * (plan.side as u64).pow(2);
    repeat_seeds(desc, left, plan, 1000 * (method as u32 + 11), |context| {
        let eyes = &context;
        match method {
            Method::Path => trace_pair(&Stereo::new(eyes, right, PathTracer::from), plan.side, paths),
            Method::Particle => trace_pair(&Stereo::new(eyes, right, ParticleTracer::from), plan.side, paths),
            Method::Bidirectional => {
                trace_pair(&Stereo::new(eyes, right, BidirectionalTracer::from), plan.side, paths)
            }
            Method::Photon => {
                trace_pair(&Stereo::new(eyes, right, |eye| PhotonTracer::new(eye, true)), plan.side, paths)
            }
            Method::Vcm => {
                trace_pair(&Stereo::new(eyes, right, |eye| VcmTracer::new(eye, true)), plan.side, paths)
            }
        }
    })
}

/// One picture for each seed of the plan, on two threads; `first` is added to the seeds.
fn repeat_seeds<T: Send>(
    desc: &SceneDesc,
    camera: &Camera,
    plan: Plan,
    first: u32,
    picture: impl Fn(RenderContext) -> T + Sync,
) -> Vec<T> {
    let scene = Arc::new(Scene::prepare(desc).expect("the scene is valid"));
    let picture = |seed: u32| {
        let context =
            RenderContext::new(scene.clone(), camera.clone(), &desc.integrator, first + seed, plan.window);
        picture(RenderContext { cells: ScreenCells::of_pixels([plan.side as f64; 2]), ..context })
    };
    let half = plan.seeds / 2;
    std::thread::scope(|scope| {
        let other = scope.spawn(|| (half..plan.seeds).map(&picture).collect::<Vec<_>>());
        let mut all: Vec<_> = (0..half).map(&picture).collect();
        all.extend(other.join().expect("no path panics"));
        all
    })
}

/// Mean over the seeds and the variance of that mean.
pub fn measure(desc: &SceneDesc, method: Method, plan: Plan) -> Measured {
    measured(&repeat(desc, method, plan))
}

/// Mean over square pictures and the variance of that mean.
pub fn measured(pictures: &[Vec<f64>]) -> Measured {
    let r = pictures.len() as f64;
    let (mut mean, mut variance) = (Vec::new(), Vec::new());
    let pixels = pictures[0].len();
    let side = pixels.isqrt();
    for pixel in 0..pixels {
        let average = pictures.iter().map(|p| p[pixel]).sum::<f64>() / r;
        mean.push(average);
        variance.push(pictures.iter().map(|p| (p[pixel] - average).powi(2)).sum::<f64>() / (r - 1.0) / r);
    }
    Measured { width: side, height: side, mean, variance }
}

/// The picture of a scene by path tracing, rendered once for all methods that are compared with it.
pub struct PathReference<'a> {
    desc: &'a SceneDesc,
    plan: Plan,
    picture: Measured,
}

impl<'a> PathReference<'a> {
    pub fn new(desc: &'a SceneDesc, plan: Plan) -> Self {
        Self { desc, plan, picture: measure(desc, Method::Path, plan) }
    }

    /// Compares a method with path tracing, and prints the result.
    ///
    /// Variances come from as many pictures as there are seeds, so pixels are accepted by Student's distribution, at a level of 1 %
    /// for all of them together.
    pub fn compare(&self, method: Method) -> ZTest {
        let (path, other) = (&self.picture, measure(self.desc, method, self.plan));
        let mut test = z_test(&other, path, 0.01).expect("equal sizes");
        let agrees = |i: &usize| {
            let [a, b] = [&other, path].map(|of| (of.mean[*i], of.variance[*i]));
            let (t, freedom) = welch::t(a, b, 0.0, f64::from(self.plan.seeds));
            welch::p_value(t, freedom) >= 0.01 / other.mean.len() as f64
        };
        test.accepted = (0..other.mean.len()).filter(agrees).count() as f64 / other.mean.len() as f64;
        println!(
            "{method:?}: ratio {:.5} ± {:.5}, mean z² {:.3}, largest {:.2}, accepted {:.4}; variances {:.3e} {:.3e}",
            test.mean_ratio,
            test.mean_ratio_error,
            test.mean_z2,
            test.largest_z,
            test.accepted,
            other.variance.iter().sum::<f64>(),
            path.variance.iter().sum::<f64>(),
        );
        test
    }

    /// Asserts the same expectation in at least `share` of the pixels, and means within `within` of each other.
    pub fn assert_mostly(&self, method: Method, share: f64, within: f64) {
        let test = self.compare(method);
        assert!(test.accepted >= share, "{method:?}: {test:?}");
        let off = (test.mean_ratio - 1.0).abs();
        assert!(off <= 4.0 * test.mean_ratio_error && off <= within, "{method:?}: {test:?}");
    }
}
