//! Independent small renderings of a scene: their mean is the picture, their spread its error.
//!
//! Shared by the golden test and by the tool that makes the golden pictures.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pointillist::client::develop::linear_rgb;
use pointillist::client::reference::ReferenceFilm;
use pointillist::client::{Film, FilmSpec, SplatFilter, VarianceForm};
use pointillist::color::{Profile, Xyz};
use pointillist::image::compare::Measured;
use pointillist::scene::desc::IntegratorDesc;
use pointillist::stream::{PathCounts, Sample, SampleSink, UvWindow};
use pointillist::tracer::integrator::{PathTracer, RenderContext};
use pointillist::tracer::medium::MediumIndex;
use pointillist::tracer::sampler::cells::ScreenCells;
use pointillist::tracer::{Camera, Integrator, Scene};

/// What is rendered: width and height in pixels, samples per pixel of one replicate, seeds.
pub struct Plan {
    pub size: [u32; 2],
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

/// Linear Rec.709 of one replicate by path tracing, through the box filter, `[height][width]`.
fn replicate(
    (scene, camera): &(Arc<Scene>, Camera),
    integrator: &IntegratorDesc,
    plan: &Plan,
    seed: u32,
) -> Vec<[f32; 3]> {
    let filter = SplatFilter::Box;
    let spec = FilmSpec {
        width: plan.size[0],
        height: plan.size[1],
        filter,
        variance: Some(VarianceForm::Product),
        sums: Default::default(),
    };
    let context = RenderContext {
        scene: scene.clone(),
        camera: camera.clone(),
        other_eye: None,
        seed,
        window: UvWindow::PICTURE,
        max_depth: integrator.max_depth,
        rr_depth: integrator.rr_depth,
        hide_emitters: integrator.hide_emitters,
        places: None,
        screen: Default::default(),
        cells: ScreenCells::of_pixels(plan.size.map(f64::from)),
        medium: MediumIndex::VACUUM,
        on_boundary: false,
        photons: Default::default(),
    };
    let tracer = PathTracer { context };
    let mut film = ReferenceFilm::new(spec, 1).unwrap();
    let mut sink = Collect(Vec::new());
    let paths = plan.samples_per_pixel * plan.size.map(u64::from).iter().product::<u64>();
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

/// The size of the golden picture of a scene for one plugin: half of its film, so that a pixel gets enough samples; all of a crop.
pub fn plugin_size(scene: &Path) -> [u32; 2] {
    let film = pointillist::scene::load(scene, &[]).unwrap().desc.film;
    film.crop.map_or([film.width / 2, film.height / 2], |crop| [crop.width, crop.height])
}

/// The scenes for one plugin each of the repository at `root`, in alphabetical order.
pub fn plugin_scenes(root: &Path) -> Vec<PathBuf> {
    let folder = root.join("scenes/plugins");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut scenes: Vec<_> = files.filter(|file| file.extension().is_some_and(|e| e == "xml")).collect();
    scenes.sort();
    scenes
}

/// Mean of all replicates and the variance of that mean, pixel by pixel, for red, green and blue.
pub fn measure(scene: &Path, plan: &Plan) -> [Measured; 3] {
    let mut desc = pointillist::scene::load(scene, &[]).unwrap().desc;
    if desc.film.crop.is_none() {
        [desc.film.width, desc.film.height] = plan.size;
    }
    let prepared = (Arc::new(Scene::prepare(&desc).unwrap()), Camera::of(&desc).unwrap());
    let seeds: Vec<u32> = plan.seeds.clone().collect();
    let pictures: Vec<Vec<[f32; 3]>> = std::thread::scope(|scope| {
        let render = |seeds: &[u32]| -> Vec<Vec<[f32; 3]>> {
            seeds.iter().map(|&seed| replicate(&prepared, &desc.integrator, plan, seed)).collect()
        };
        let (first, second) = seeds.split_at(seeds.len().div_ceil(2));
        let other = scope.spawn(move || render(second));
        let mut all = render(first);
        all.extend(other.join().unwrap());
        all
    });
    std::array::from_fn(|channel| statistics(&pictures, channel, plan.size.map(|n| n as usize)))
}

fn statistics(pictures: &[Vec<[f32; 3]>], channel: usize, [width, height]: [usize; 2]) -> Measured {
    let r = pictures.len() as f64;
    let (mut mean, mut variance) = (Vec::new(), Vec::new());
    for pixel in 0..width * height {
        let values = || pictures.iter().map(|p| f64::from(p[pixel][channel]));
        let average = values().sum::<f64>() / r;
        mean.push(average);
        variance.push(values().map(|v| (v - average).powi(2)).sum::<f64>() / (r - 1.0) / r);
    }
    Measured { width, height, mean, variance }
}
