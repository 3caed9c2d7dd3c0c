//! Independent small renderings of a scene: their mean is the picture, their spread its error.
//!
//! Shared by the golden test and by the tool that makes the golden pictures.

use std::path::Path;
use std::sync::Arc;

use pointillist::client::develop::linear_xyz;
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{FilmSpec, SplatFilter, VarianceForm};
use pointillist::color::Xyz;
use pointillist::image::compare::Measured;
use pointillist::stream::{PathCounts, Sample, SampleSink, UvWindow};
use pointillist::tracer::integrator::PathTracer;
use pointillist::tracer::{Integrator, PrepareOptions, Scene};

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

/// Luminance of one replicate through the box filter, `[side][side]`.
fn replicate(scene: &Arc<Scene>, depth: (Option<u32>, u32), plan: &Plan, seed: u32) -> Vec<f64> {
    let filter = SplatFilter::Box;
    let spec = FilmSpec { width: plan.side, height: plan.side, filter, variance: VarianceForm::Product };
    let tracer = PathTracer {
        scene: scene.clone(),
        seed,
        window: UvWindow::PICTURE,
        max_depth: depth.0,
        rr_depth: depth.1,
        hide_emitters: false,
    };
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
    linear_xyz(&film.develop().unwrap()).into_iter().map(|xyz| f64::from(xyz[1])).collect()
}

/// Mean luminance of all replicates and the variance of that mean, pixel by pixel.
pub fn measure(scene: &Path, plan: &Plan) -> Measured {
    let mut desc = pointillist::scene::load(scene, &[]).unwrap().desc;
    (desc.film.width, desc.film.height, desc.film.crop) = (plan.side, plan.side, None);
    let depth = (desc.integrator.max_depth, desc.integrator.rr_depth);
    let prepared = Arc::new(Scene::prepare(&desc, PrepareOptions::from_film(&desc.film)).unwrap());
    let seeds: Vec<u32> = plan.seeds.clone().collect();
    let half = seeds.len().div_ceil(2);
    let pictures: Vec<Vec<f64>> = std::thread::scope(|scope| {
        let render = |seeds: &[u32]| -> Vec<Vec<f64>> {
            seeds.iter().map(|&seed| replicate(&prepared, depth, plan, seed)).collect()
        };
        let (first, second) = seeds.split_at(half);
        let other = scope.spawn(move || render(second));
        let mut all = render(first);
        all.extend(other.join().unwrap());
        all
    });
    let r = pictures.len() as f64;
    let (mut mean, mut variance) = (Vec::new(), Vec::new());
    for pixel in 0..pictures[0].len() {
        let average = pictures.iter().map(|p| p[pixel]).sum::<f64>() / r;
        let squares = pictures.iter().map(|p| (p[pixel] - average).powi(2)).sum::<f64>();
        mean.push(average);
        variance.push(squares / (r - 1.0) / r);
    }
    Measured { width: plan.side as usize, height: plan.side as usize, mean, variance }
}
