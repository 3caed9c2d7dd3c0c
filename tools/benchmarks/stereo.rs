//! The price of the second eye: processor time and error of both eyes by one tracer over those of one camera alone with as many paths, one thread.
//!
//! Both eyes and each camera alone take turns seed by seed, so that what else the machine does meets all of them. relMSE needs no reference: the
//! mean of (a − b)² / 2 over all pairs of independent seeds is the variance, which is the squared error of a method without bias. Of `photon`, and
//! of the caustics of `vcm` in mirrors and glass, it is the noise alone: both eyes have the bias of one, since they see the photons of as many
//! indices.

use std::path::PathBuf;
use std::sync::Arc;

use glam::Vec3;

use pointillist::color::{Profile, Xyz};
use pointillist::scene::desc::{ConvergenceChoice, IntegratorKind, SceneDesc, StereoRig};
use pointillist::stream::{CHUNK, SampleSink, UvWindow, eye};
use pointillist::tracer::integrator::{
    Integrator, IntegratorVisitor, RenderContext, SeesPhotons, Stereo, visit,
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
    methods: Vec<IntegratorKind>,
    /// Pixels along a side of a picture
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..))]
    size: u32,
    /// Paths per pixel, of both eyes together and of one camera alone
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u64).range(1..))]
    spp: u64,
    /// Independent pictures of each
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..))]
    seeds: u32,
    /// Distance between the eyes, world units [default: 1/30 of the distance of what is in focus or in the middle]
    #[arg(long)]
    interocular: Option<f64>,
}

/// Linear RGB and luminance of each pixel.
type Picture = Vec<(Vec3, f32)>;

/// Sums per pixel, box filter: of camera samples with their weights, and of light samples.
struct PixelSums {
    size: usize,
    camera: Vec<(Xyz, f32)>,
    light: Vec<Xyz>,
}

impl PixelSums {
    fn new(size: usize) -> Self {
        Self { size, camera: vec![(Xyz::BLACK, 0.0); size * size], light: vec![Xyz::BLACK; size * size] }
    }

    fn pixel(&self, uv: [f32; 2]) -> usize {
        let [x, y] = uv.map(|c| ((c * self.size as f32) as usize).min(self.size - 1));
        y * self.size + x
    }

    fn add_camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        let pixel = self.pixel(uv);
        let (sum, weights) = &mut self.camera[pixel];
        (*sum, *weights) = (*sum + value * weight, *weights + weight);
    }

    fn add_light(&mut self, uv: [f32; 2], value: Xyz) {
        let pixel = self.pixel(uv);
        self.light[pixel] += value;
    }

    /// The picture of so many light paths.
    fn picture(&self, light_paths: u64) -> Picture {
        let matrix = Profile::srgb().from_xyz;
        let per_path = (self.size * self.size) as f32 / light_paths.max(1) as f32;
        let color = |((camera, weight), light): (&(Xyz, f32), &Xyz)| {
            let mean = if *weight > 0.0 { *camera * (1.0 / weight) } else { Xyz::BLACK };
            let v = mean + *light * per_path;
            (matrix * Vec3::new(v.x, v.y, v.z), v.y)
        };
        self.camera.iter().zip(&self.light).map(color).collect()
    }
}

/// A sample as a tracer sends it, of its own eye or of the other.
enum Sent {
    Camera { other: bool, uv: [f32; 2], value: Xyz, weight: f32 },
    Light { other: bool, uv: [f32; 2], value: Xyz },
}

/// Samples one after the other, as renders pass them on. What sums them up is no part of a tracer, and its time, that of the memory, would be
/// twice that of one eye.
#[derive(Default)]
struct Samples(Vec<Sent>);

impl SampleSink for Samples {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.0.push(Sent::Camera { other: false, uv, value, weight });
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.0.push(Sent::Light { other: false, uv, value });
    }

    fn camera_of_other_eye(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.0.push(Sent::Camera { other: true, uv, value, weight });
    }

    fn light_of_other_eye(&mut self, uv: [f32; 2], value: Xyz) {
        self.0.push(Sent::Light { other: true, uv, value });
    }
}

impl Samples {
    /// Adds the samples of a chunk of paths of this eye to the sums of both, and is empty then.
    fn add_to(&mut self, sums: &mut [PixelSums; 2], eye: usize) {
        for sample in self.0.drain(..) {
            match sample {
                Sent::Camera { other, uv, value, weight } => {
                    sums[eye ^ usize::from(other)].add_camera(uv, value, weight);
                }
                Sent::Light { other, uv, value } => sums[eye ^ usize::from(other)].add_light(uv, value),
            }
        }
    }
}

/// Sums of the paths of so many indices for each eye, and the processor seconds that it took to trace them. `eye_of` tells the eye of an index.
fn trace<I: Integrator>(
    tracer: &I,
    indices: u64,
    size: usize,
    eye_of: impl Fn(u64) -> usize,
) -> ([PixelSums; 2], f64) {
    let mut sums = [PixelSums::new(size), PixelSums::new(size)];
    let (mut scratch, mut samples, mut seconds) = (I::Scratch::default(), Samples::default(), 0.0);
    for chunk in 0..indices / CHUNK {
        let first = chunk * CHUNK;
        let start = thread_seconds();
        (first..first + CHUNK).for_each(|index| tracer.trace(index, &mut scratch, &mut samples));
        seconds += thread_seconds() - start;
        samples.add_to(&mut sums, eye_of(first));
    }
    (sums, seconds)
}

/// The pictures of both eyes, and the processor seconds that each took, or both together.
struct EyePictures {
    pictures: [Picture; 2],
    seconds: [f64; 2],
}

/// Renders a seed of a method: both eyes by one tracer, and each camera alone.
struct Turn<'a> {
    /// The contexts of the left and of the right camera alone.
    contexts: [RenderContext; 2],
    right: &'a Camera,
    size: usize,
    /// Camera paths, or light paths if there are none, of both eyes together and of one camera alone, at least.
    paths: u64,
}

impl Turn<'_> {
    fn take<I: Integrator>(self, make: impl Fn(RenderContext) -> I) -> [EyePictures; 2] {
        let Self { contexts, right, size, paths } = self;
        let both = Stereo::new(&contexts[0], right, &make);
        let counts = both.paths_per_index();
        // As many of each eye.
        let indices = paths.div_ceil(counts.camera.max(counts.light)).next_multiple_of(2 * CHUNK);
        let light_paths = counts.light * indices;
        let (sums, seconds) = trace(&both, indices, size, |index| eye(index).0);
        let pictures = sums.map(|sums| sums.picture(light_paths));
        let both = EyePictures { pictures, seconds: [seconds; 2] };
        let [left, right] = contexts.map(|context| {
            let ([sums, _], seconds) = trace(&make(context), indices, size, |_| 0);
            (sums.picture(light_paths), seconds)
        });
        [both, EyePictures { pictures: [left.0, right.0], seconds: [left.1, right.1] }]
    }
}

impl IntegratorVisitor for Turn<'_> {
    type Output = [EyePictures; 2];

    fn visit<I: Integrator + From<RenderContext>>(self) -> Self::Output {
        self.take(I::from)
    }

    fn visit_with_photons<I: Integrator + From<RenderContext> + SeesPhotons>(self) -> Self::Output {
        self.take(|context| I::without_photons(context, true))
    }
}

/// relMSE of one eye over its independent pictures.
fn error(pictures: &[&Picture]) -> f64 {
    let (count, pixels) = (pictures.len() as f32, pictures[0].len());
    let of_pixel = |pixel: usize| {
        let all = || pictures.iter().map(|picture| picture[pixel]);
        let mean = all().map(|(rgb, _)| rgb).sum::<Vec3>() / count;
        let y = all().map(|(_, y)| y).sum::<f32>() / count;
        let variance = all().map(|(rgb, _)| (rgb - mean).length_squared() / 3.0).sum::<f32>() / (count - 1.0);
        f64::from(variance / (y * y + 0.01))
    };
    (0..pixels).map(of_pixel).sum::<f64>() / pixels as f64
}

/// Mean processor time and relMSE of an eye.
fn mean_of_eyes(turns: &[EyePictures]) -> (f64, f64) {
    let seconds = turns.iter().flat_map(|turn| turn.seconds).sum::<f64>() / (2 * turns.len()) as f64;
    let errors = [0, 1].map(|eye| error(&turns.iter().map(|turn| &turn.pictures[eye]).collect::<Vec<_>>()));
    (seconds, 0.5 * (errors[0] + errors[1]))
}

/// The cameras of two eyes that converge at what is in focus or in the middle of the square picture.
fn eyes(desc: &SceneDesc, scene: &Scene, interocular: Option<f64>) -> Outcome<(StereoRig, [Camera; 2])> {
    let middle = Camera::of(desc)?.ray([0.5; 2], [0.5; 2]).and_then(|ray| scene.closest(&ray));
    let axis = desc.camera.to_world.matrix3.z_axis.normalize_or_zero();
    let origin = desc.space.point(desc.camera.to_world.translation);
    let depth = middle.map(|hit| (hit.point.p.as_dvec3() - origin).dot(axis) / desc.space.scale);
    let rig = StereoRig::of(interocular, ConvergenceChoice::Subject, &desc.camera, depth)?;
    let [left, right] = rig.eyes(&desc.camera, 1.0)?;
    let options = PrepareOptions::from_film(&desc.film);
    let camera = |eye| Camera::new(eye, &desc.film, &options).map(|camera| camera.placed(&desc.space));
    Ok((rig, [camera(&left)?, camera(&right)?]))
}

/// Renders every method with every seed, and prints times, errors and the price.
pub fn run(arguments: &Arguments) -> Outcome {
    let Arguments { scene: ref path, ref methods, size, spp, seeds, interocular } = *arguments;
    if let Some(kind) = methods.iter().find(|kind| **kind == IntegratorKind::Auto || !kind.shows_light()) {
        return Err(
            format!("`{}` is no method of light transport: its noise says nothing", kind.name()).into()
        );
    }
    let mut desc = pointillist::scene::load(path, &[])?.desc;
    (desc.film.width, desc.film.height) = (size, size);
    let scene = Arc::new(Scene::prepare(&desc)?);
    let (rig, cameras) = eyes(&desc, &scene, interocular)?;
    let contexts = cameras.clone().map(|camera| {
        RenderContext::new(scene.clone(), camera, &desc.integrator, 0, UvWindow::PICTURE).of_size([size; 2])
    });
    let mut turns: Vec<[Vec<EyePictures>; 2]> = methods.iter().map(|_| Default::default()).collect();
    for seed in 100..100 + seeds {
        for (&kind, [both, alone]) in methods.iter().zip(&mut turns) {
            let contexts = contexts.clone().map(|context| RenderContext { seed, ..context });
            let paths = spp * u64::from(size) * u64::from(size);
            let turn = Turn { contexts, right: &cameras[1], size: size as usize, paths };
            let [eyes, one] = visit(kind, turn);
            both.push(eyes);
            alone.push(one);
        }
    }
    println!("{} {size}², {spp} paths per pixel, {seeds} seeds; {rig}", path.display());
    println!(
        "both eyes by one tracer over one camera alone with as many paths; relMSE is the variance over seeds"
    );
    println!(
        "{:<16}{:>10}{:>10}{:>8}{:>10}{:>10}{:>8}{:>8}",
        "method", "s, both", "s, alone", "ratio", "error", "alone", "ratio", "price"
    );
    for (kind, [both, alone]) in methods.iter().zip(&turns) {
        let ((time, error), (time_alone, error_alone)) = (mean_of_eyes(both), mean_of_eyes(alone));
        let (of_time, of_error) = (time / time_alone, error / error_alone);
        println!(
            "{:<16}{time:>10.3}{time_alone:>10.3}{of_time:>8.3}{error:>10.5}{error_alone:>10.5}{of_error:>8.3}{:>8.3}",
            kind.name(),
            of_time * of_error
        );
    }
    Ok(())
}
