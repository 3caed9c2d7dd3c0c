//! Independent small renderings of a scene: their mean is the picture, their spread its error.
//!
//! Shared by the golden test and by the tool that makes the golden pictures.

use std::path::Path;
use std::sync::Arc;

use pointillist::client::develop::linear_rgb;
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{Film, FilmSpec, SplatFilter, VarianceForm};
use pointillist::color::{Profile, Xyz};
use pointillist::image::compare::Measured;
use pointillist::stream::{PathCounts, Sample, SampleSink, UvWindow};
use pointillist::tracer::integrator::{PathTracer, RenderContext};
use pointillist::tracer::{Camera, Integrator, Scene};

/// What is rendered: side length in pixels, samples per pixel of one replicate, seeds.
pub struct Plan {
    pub side: u32,
    pub samples_per_pixel: u64,
    pub seeds: std::ops::Range<u32>,
}

struct Collect(Vec<Sample>);

impl SampleSink for Collect {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.0.push(Sample { uv, xyz: value * weight, w: weight });
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.0.push(Sample { uv, xyz: value, w: -1.0 });
    }
}

/// Names of the channels of a golden picture: linear Rec.709 and the variance of each mean.
pub const CHANNELS: [(&str, &str); 3] = [("R", "variance.R"), ("G", "variance.G"), ("B", "variance.B")];

/// Linear Rec.709 of one replicate through the box filter, `[side][side]`.
fn replicate(
    (scene, camera): &(Arc<Scene>, Camera),
    depth: (Option<u32>, u32),
    plan: &Plan,
    seed: u32,
) -> Vec<[f32; 3]> {
    let filter = SplatFilter::Box;
    let spec = FilmSpec {
        width: plan.side,
        height: plan.side,
        filter,
        variance: Some(VarianceForm::Product),
        sums: Default::default(),
    };
    let context = RenderContext {
        scene: scene.clone(),
        camera: camera.clone(),
        seed,
        window: UvWindow::PICTURE,
        max_depth: depth.0,
        rr_depth: depth.1,
        hide_emitters: false,
        places: None,
        photons: Default::default(),
    };
    let tracer = PathTracer { context };
    let mut film = ReferenceFilm::new(spec, 1).unwrap();
    let mut sink = Collect(Vec::new());
    let paths = plan.samples_per_pixel * u64::from(plan.side).pow(2);
    for index in 0..paths {
        tracer.trace(index, &mut (), &mut sink);
        if sink.0.len() >= 4096 {
            film.add(&sink.0).unwrap();
            sink.0.clear();
        }
    }
    film.add(&sink.0).unwrap();
    film.count_paths(PathCounts { camera: paths, light: 0 });
    film.flush().unwrap();
    linear_rgb(&film.develop().unwrap(), &Profile::srgb())
}

/// Mean of all replicates and the variance of that mean, pixel by pixel, for red, green and blue.
pub fn measure(scene: &Path, plan: &Plan) -> [Measured; 3] {
    let mut desc = pointillist::scene::load(scene, &[]).unwrap().desc;
    (desc.film.width, desc.film.height, desc.film.crop) = (plan.side, plan.side, None);
    let depth = (desc.integrator.max_depth, desc.integrator.rr_depth);
    let prepared = (Arc::new(Scene::prepare(&desc).unwrap()), Camera::of(&desc).unwrap());
    let seeds: Vec<u32> = plan.seeds.clone().collect();
    let pictures: Vec<Vec<[f32; 3]>> = std::thread::scope(|scope| {
        let render = |seeds: &[u32]| -> Vec<Vec<[f32; 3]>> {
            seeds.iter().map(|&seed| replicate(&prepared, depth, plan, seed)).collect()
        };
        let (first, second) = seeds.split_at(seeds.len().div_ceil(2));
        let other = scope.spawn(move || render(second));
        let mut all = render(first);
        all.extend(other.join().unwrap());
        all
    });
    std::array::from_fn(|channel| statistics(&pictures, channel, plan.side as usize))
}

fn statistics(pictures: &[Vec<[f32; 3]>], channel: usize, side: usize) -> Measured {
    let r = pictures.len() as f64;
    let (mut mean, mut variance) = (Vec::new(), Vec::new());
    for pixel in 0..side * side {
        let values = || pictures.iter().map(|p| f64::from(p[pixel][channel]));
        let average = values().sum::<f64>() / r;
        mean.push(average);
        variance.push(values().map(|v| (v - average).powi(2)).sum::<f64>() / (r - 1.0) / r);
    }
    Measured { width: side, height: side, mean, variance }
}
