//! Error times CPU time of the methods of light transport, one thread. They take turns seed by seed, so that what else the
//! machine does meets all of them.

use std::path::PathBuf;
use std::sync::Arc;

use glam::Vec3;

use pointillist::color::{Profile, Xyz};
use pointillist::stream::{SampleSink, UvWindow};
use pointillist::tracer::integrator::{
    BidirectionalTracer, Integrator, ParticleTracer, PathTracer, PhotonTracer, RenderContext, VcmTracer,
};
use pointillist::tracer::{Camera, PrepareOptions, Scene};

use super::common::{Outcome, thread_seconds};

/// What to compare.
#[derive(clap::Args)]
pub struct Arguments {
    /// The scene file
    scene: PathBuf,
    /// The methods in the order of the table
    #[arg(required = true)]
    methods: Vec<Method>,
    /// Pixels along a side of the picture
    #[arg(long, default_value_t = 128)]
    size: usize,
    /// Samples per pixel
    #[arg(long, default_value_t = 32)]
    spp: usize,
    /// Independent pictures of each method
    #[arg(long, default_value_t = 4)]
    seeds: u32,
}

/// A method of light transport.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Method {
    Path,
    Light,
    Bidirectional,
    Photon,
    Vcm,
}

/// Sums per pixel, box filter.
struct Picture {
    size: usize,
    camera: Vec<Xyz>,
    light: Vec<Xyz>,
    splats: u64,
}

impl SampleSink for Picture {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, _: f32) {
        let [x, y] = uv.map(|c| ((c * self.size as f32) as usize).min(self.size - 1));
        self.camera[y * self.size + x] += value;
    }
    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        let [x, y] = uv.map(|c| ((c * self.size as f32) as usize).min(self.size - 1));
        self.light[y * self.size + x] += value;
        self.splats += 1;
    }
}

/// The picture in linear RGB and luminance, with the seconds and splats it took.
struct Taken {
    rgb: Vec<(Vec3, f32)>,
    seconds: f64,
    splats: u64,
}

fn take<I: Integrator>(tracer: &I, size: usize, spp: usize) -> Taken {
    let n = size * size;
    let black = vec![Xyz::BLACK; n];
    let mut picture = Picture { size, camera: black.clone(), light: black, splats: 0 };
    let counts = tracer.paths_per_index();
    let indices = spp * n / counts.camera.max(counts.light) as usize;
    let mut scratch = I::Scratch::default();
    let start = thread_seconds();
    (0..indices as u64).for_each(|i| tracer.trace(i, &mut scratch, &mut picture));
    let seconds = thread_seconds() - start;
    let matrix = Profile::srgb().from_xyz;
    let camera = n as f32 / (indices as f32 * counts.camera.max(1) as f32);
    let light = n as f32 / (indices as f32 * counts.light.max(1) as f32);
    let rgb = picture.camera.iter().zip(&picture.light).map(|(a, b)| {
        let v = Vec3::new(a.x, a.y, a.z) * camera + Vec3::new(b.x, b.y, b.z) * light;
        (matrix * v, v.y)
    });
    Taken { rgb: rgb.collect(), seconds, splats: picture.splats }
}

fn render(context: &RenderContext, method: Method, seed: u32, size: usize, spp: usize) -> Taken {
    let context = RenderContext { seed, ..context.clone() };
    match method {
        Method::Path => take(&PathTracer { context }, size, spp),
        Method::Light => take(&ParticleTracer { context }, size, spp),
        Method::Bidirectional => take(&BidirectionalTracer { context }, size, spp),
        Method::Photon => take(&PhotonTracer::new(context, true), size, spp),
        Method::Vcm => take(&VcmTracer::new(context, true), size, spp),
    }
}

/// Renders every method with every seed, and prints error and time.
pub fn run(arguments: &Arguments) -> Outcome {
    let Arguments { scene: ref path, ref methods, size, spp, seeds } = *arguments;
    let desc = pointillist::scene::load(path, &[])?.desc;
    let scene = Arc::new(Scene::prepare(&desc)?);
    let options = PrepareOptions { width: size as u32, height: size as u32 };
    let camera = Camera::new(&desc.camera, &desc.film, &options)?.placed(&desc.space);
    let context = RenderContext::new(scene, camera, &desc.integrator, 0, UvWindow::PICTURE);
    let context = context.of_size([size as u32; 2]);
    let mut runs: Vec<Vec<Taken>> = methods.iter().map(|_| Vec::new()).collect();
    for seed in 0..seeds {
        for (&method, runs) in methods.iter().zip(&mut runs) {
            runs.push(render(&context, method, 100 + seed, size, spp));
        }
    }
    println!("{} {size}² {spp} spp {seeds} seeds; error is relMSE at 512² and 20 CPU s", path.display());
    println!(
        "{:<40}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}",
        "method", "us/path", "splats/p", "meanY", "relMSE", "error", "of Y"
    );
    for (method, runs) in methods.iter().zip(&runs) {
        let method = format!("{method:?}").to_lowercase();
        let n = (size * size) as f64;
        let seconds = runs.iter().map(|r| r.seconds).sum::<f64>() / runs.len() as f64;
        let (mut error, mut error_y, mut mean_y) = (0.0, 0.0, 0.0);
        for pixel in 0..size * size {
            let all: Vec<_> = runs.iter().map(|r| r.rgb[pixel]).collect();
            let k = all.len() as f32;
            let mean = all.iter().map(|p| p.0).sum::<Vec3>() / k;
            let y = all.iter().map(|p| p.1).sum::<f32>() / k;
            let variance = all.iter().map(|p| (p.0 - mean).length_squared() / 3.0).sum::<f32>() / (k - 1.0);
            let of_y = all.iter().map(|p| (p.1 - y).powi(2)).sum::<f32>() / (k - 1.0);
            error += f64::from(variance / (y * y + 0.01)) / n;
            error_y += f64::from(of_y / (y * y + 0.01)) / n;
            mean_y += f64::from(y) / n;
        }
        let scale = seconds * (512.0 * 512.0 / n) / 20.0;
        let us = seconds * 1e6 / (n * spp as f64);
        let splats = runs.iter().map(|r| r.splats as f64).sum::<f64>() / runs.len() as f64 / (n * spp as f64);
        println!(
            "{method:<40}{us:>9.3}{splats:>9.2}{mean_y:>9.4}{error:>9.5}{:>9.5}{:>9.5}",
            error * scale,
            error_y * scale
        );
    }
    Ok(())
}
