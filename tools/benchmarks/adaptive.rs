//! Error times CPU time of a picture with adaptive sampling over that of one without, one thread, box filter. They take turns seed by
//! seed, and the pilot's time and samples are part of the picture.

use std::path::PathBuf;
use std::sync::Arc;

use glam::Vec3;

use pointillist::color::{Profile, Xyz};
use pointillist::scene::desc::IntegratorKind;
use pointillist::stream::{CHUNK, PathCounts, Sample, SampleSink, UvWindow};
use pointillist::study::{ErrorField, Replicates, TileSubset};
use pointillist::tracer::integrator::{
    BidirectionalTracer, Integrator, PathTracer, PhotonTracer, RenderContext, Replicated, VcmTracer,
};
use pointillist::tracer::screen::{ScreenDensity, ScreenSampling};
use pointillist::tracer::{Camera, PrepareOptions, Scene};

use super::common::{Outcome, thread_seconds};

/// What to compare.
#[derive(clap::Args)]
pub struct Arguments {
    /// The scene file
    scene: PathBuf,
    /// The methods
    #[arg(required = true)]
    methods: Vec<IntegratorKind>,
    /// Pixels along a side of the picture
    #[arg(long, default_value_t = 128)]
    size: usize,
    /// Samples per pixel
    #[arg(long, default_value_t = 64)]
    spp: u64,
    /// Share of the pilot
    #[arg(long, default_value_t = 0.0625)]
    pilot: f64,
    /// Independent pictures of each kind
    #[arg(long, default_value_t = 4)]
    seeds: u32,
}

/// Sums of the picture, and those by which its error is estimated.
struct Sums {
    replicates: Replicates,
    block: Vec<Sample>,
}

impl SampleSink for Sums {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, w: f32) {
        self.block.push(Sample { uv, xyz: value * w, w });
    }
    fn light(&mut self, uv: [f32; 2], xyz: Xyz) {
        self.block.push(Sample { uv, xyz, w: -1.0 });
    }
}

impl Sums {
    /// Traces so many paths; returns the seconds.
    fn trace<I: Integrator>(&mut self, tracer: &I, paths: u64) -> f64 {
        let per = tracer.paths_per_index();
        let indices = paths / per.camera.max(1);
        let mut scratch = I::Scratch::default();
        let mut seconds = 0.0;
        for first in (0..indices).step_by(CHUNK as usize) {
            let chunk = first..(first + CHUNK).min(indices);
            let count = chunk.end - chunk.start;
            let start = thread_seconds();
            chunk.for_each(|index| tracer.trace(index, &mut scratch, self));
            seconds += thread_seconds() - start;
            let paths = PathCounts { camera: per.camera * count, light: per.light * count };
            self.replicates.add(first, paths, &self.block);
            self.block.clear();
        }
        seconds
    }
}

/// A picture in linear RGB and luminance, and the seconds that it took.
type Taken = (Vec<(Vec3, f32)>, f64);

fn render<I: Integrator>(
    context: &RenderContext,
    make: impl Fn(RenderContext) -> I,
    arguments: &Arguments,
    adaptive: bool,
) -> Taken {
    let size = arguments.size;
    let mut sums = Sums { replicates: Replicates::new([size as u32; 2], 1.0), block: Vec::new() };
    let paths = arguments.spp * (size * size) as u64;
    let tracer = |screen: ScreenSampling| {
        let seed = screen.seed(context.seed);
        Replicated::new(&RenderContext { seed, screen, ..context.clone() }, true, &make)
    };
    let seconds = match adaptive {
        false => sums.trace(&tracer(ScreenSampling::Even), paths),
        true => {
            let pilot = (arguments.pilot * paths as f64) as u64;
            let seconds = sums.trace(&tracer(ScreenSampling::Pilot), pilot);
            let start = thread_seconds();
            let level = ScreenDensity::level((size * size) as f64);
            let errors = sums.replicates.region_errors(&UvWindow::PICTURE, level).unwrap();
            let density = ScreenDensity::new(&errors);
            let screen = ScreenSampling::adaptive(Arc::new(density), context.seed, &context.cells);
            let main = tracer(screen);
            let seconds = seconds + thread_seconds() - start;
            seconds + sums.trace(&main, paths - pilot)
        }
    };
    let matrix = Profile::srgb().from_xyz;
    let picture = sums.replicates.whole(0..size);
    (picture.iter().map(|[x, y, z, _]| (matrix * Vec3::new(*x, *y, *z), *y)).collect(), seconds)
}

/// relMSE of pictures by their spread around their mean.
fn error(runs: &[Taken]) -> f64 {
    let (pixels, k) = (runs[0].0.len(), runs.len() as f32);
    let error = |pixel: usize| {
        let mean = runs.iter().map(|run| run.0[pixel].0).sum::<Vec3>() / k;
        let y = runs.iter().map(|run| run.0[pixel].1).sum::<f32>() / k;
        let squares = runs.iter().map(|run| (run.0[pixel].0 - mean).length_squared() / 3.0).sum::<f32>();
        f64::from(squares / (k - 1.0) / (y * y + 0.01))
    };
    (0..pixels).map(error).sum::<f64>() / pixels as f64
}

/// The relative error that 95 % of the picture stays below, by the spread of pictures around their mean.
fn p95(runs: &[Taken], size: usize) -> f64 {
    let k = runs.len() as f32;
    let mean = |pixel: usize| (runs.iter().map(|run| run.0[pixel].0).sum::<Vec3>() / k).to_array();
    let mean: Vec<_> = (0..size * size).map(mean).collect();
    let of = |run: &Taken| {
        let picture: Vec<_> = run.0.iter().map(|pixel| pixel.0.to_array()).collect();
        let field = ErrorField::against(&picture, &mean, [size; 2]).unwrap();
        field.estimate(TileSubset::All).relative[1].value
    };
    runs.iter().map(of).sum::<f64>() / f64::from(k) * f64::from(k / (k - 1.0)).sqrt()
}

/// Renders with every method and every seed, and prints error and time.
pub fn run(arguments: &Arguments) -> Outcome {
    let size = arguments.size;
    let desc = pointillist::scene::load(&arguments.scene, &[])?.desc;
    let scene = Arc::new(Scene::prepare(&desc)?);
    let options = PrepareOptions { width: size as u32, height: size as u32 };
    let camera = Camera::new(&desc.camera, &desc.film, &options)?.placed(&desc.space);
    let context = RenderContext::new(scene, camera, &desc.integrator, 0, UvWindow::PICTURE);
    let context = context.of_size([size as u32; 2]);
    let Arguments { spp, seeds, .. } = *arguments;
    println!("{} {size}² {spp} spp {seeds} seeds", arguments.scene.display());
    for &method in &arguments.methods {
        let mut runs: [Vec<Taken>; 2] = Default::default();
        for seed in 0..seeds {
            let context = RenderContext { seed: 100 + seed, ..context.clone() };
            for (adaptive, runs) in [false, true].into_iter().zip(&mut runs) {
                runs.push(match method {
                    IntegratorKind::Bidirectional => {
                        render(&context, BidirectionalTracer::from, arguments, adaptive)
                    }
                    IntegratorKind::Photon => {
                        render(&context, |c| PhotonTracer::new(c, true), arguments, adaptive)
                    }
                    IntegratorKind::Vcm => render(&context, |c| VcmTracer::new(c, true), arguments, adaptive),
                    _ => render(&context, PathTracer::from, arguments, adaptive),
                });
            }
        }
        let [even, adaptive] = runs.each_ref().map(|runs| {
            (error(runs), runs.iter().map(|run| run.1).sum::<f64>() / f64::from(seeds), p95(runs, size))
        });
        println!(
            "{:<14} even {:.5} in {:.2} s, adaptive {:.5} in {:.2} s: gain at equal time {:.2}; of the error of 95 % of the picture {:.2}",
            method.name(),
            even.0,
            even.1,
            adaptive.0,
            adaptive.1,
            even.0 * even.1 / (adaptive.0 * adaptive.1),
            even.2.powi(2) * even.1 / (adaptive.2.powi(2) * adaptive.1)
        );
    }
    Ok(())
}
