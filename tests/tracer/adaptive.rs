//! Adaptive and steered sampling of the screen: the picture is the one of even sampling, and the error that it states is its own.

use std::sync::Arc;

use crate::support::welch::{moments, p_value, t};
use pointillist::color::{Profile, Xyz};
use pointillist::scene::desc::SceneDesc;
use pointillist::stream::{CHUNK, PathCounts, Sample, SampleSink, UvWindow};
use pointillist::study::{ErrorField, Replicates, TileSubset};
use pointillist::tracer::integrator::{
    BidirectionalTracer, PathTracer, PhotonTracer, RenderContext, Replicated, VcmTracer,
};
use pointillist::tracer::screen::{ScreenDensity, ScreenSampling};
use pointillist::tracer::{Camera, Integrator, Scene};

const SIDE: usize = 64;
const SEEDS: u32 = 16;
/// Pixels along a side of the blocks that are compared: four regions of the density.
const BLOCK: usize = 8;

/// A picture, and the luminances of its camera samples as if all had the same weight.
struct Pictures {
    replicates: Replicates,
    samples: Vec<Sample>,
    unweighted: Vec<[f64; 2]>,
}

impl SampleSink for Pictures {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, w: f32) {
        self.samples.push(Sample { uv, xyz: value * w, w });
        let [x, y] = uv.map(|c| ((c * SIDE as f32) as usize).min(SIDE - 1) / BLOCK);
        let [sum, count] = &mut self.unweighted[y * (SIDE / BLOCK) + x];
        (*sum, *count) = (*sum + f64::from(value.y), *count + 1.0);
    }

    fn light(&mut self, uv: [f32; 2], xyz: Xyz) {
        self.samples.push(Sample { uv, xyz, w: -1.0 });
    }
}

impl Pictures {
    fn new() -> Self {
        let mut replicates = Replicates::new([SIDE as u32; 2], 1.0);
        replicates.set_density_weights();
        Self { replicates, samples: Vec::new(), unweighted: vec![[0.0; 2]; (SIDE / BLOCK).pow(2)] }
    }

    /// Adds so many samples per pixel.
    fn trace<I: Integrator>(&mut self, tracer: &I, spp: u64) {
        let per = tracer.paths_per_index();
        let indices = spp * (SIDE * SIDE) as u64 / per.camera;
        let mut scratch = I::Scratch::default();
        for first in (0..indices).step_by(CHUNK as usize) {
            let chunk = first..(first + CHUNK).min(indices);
            let count = chunk.end - chunk.start;
            chunk.for_each(|index| tracer.trace(index, &mut scratch, self));
            let paths = PathCounts { camera: per.camera * count, light: per.light * count };
            self.replicates.add(first, paths, &std::mem::take(&mut self.samples));
        }
    }

    /// Weighted mean luminance of the blocks.
    fn blocks(&self) -> Vec<f64> {
        let picture = self.replicates.whole(0..SIDE);
        let mut sums = vec![[0.0; 2]; (SIDE / BLOCK).pow(2)];
        for (i, [_, y, _, w]) in picture.iter().enumerate() {
            let [sum, weight] = &mut sums[i / SIDE / BLOCK * (SIDE / BLOCK) + i % SIDE / BLOCK];
            (*sum, *weight) = (*sum + f64::from(y * w), *weight + f64::from(*w));
        }
        sums.iter().map(|[sum, weight]| sum / weight).collect()
    }

    fn rgb(&self) -> Vec<[f32; 3]> {
        let matrix = Profile::srgb().from_xyz;
        let picture = self.replicates.whole(0..SIDE);
        picture.iter().map(|[x, y, z, _]| (matrix * glam::Vec3::new(*x, *y, *z)).to_array()).collect()
    }
}

fn context(scene: &str, seed: u32) -> RenderContext {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene);
    let mut desc: SceneDesc = pointillist::scene::load(&path, &[]).expect("the scene can be read").desc;
    (desc.film.width, desc.film.height) = (SIDE as u32, SIDE as u32);
    let camera = Camera::of(&desc).unwrap();
    RenderContext::new(
        Scene::prepare(&desc).unwrap().into(),
        camera,
        &desc.integrator,
        seed,
        UvWindow::PICTURE,
    )
    .of_size([SIDE as u32; 2])
}

fn tracer<I>(
    context: &RenderContext,
    screen: ScreenSampling,
    make: impl Fn(RenderContext) -> I,
) -> Replicated<I> {
    let seed = screen.seed(context.seed);
    Replicated::new(&RenderContext { seed, screen, ..context.clone() }, true, make)
}

/// How the screen of a picture of 16 samples per pixel is sampled.
#[derive(Clone, Copy)]
enum Screen {
    Even,
    /// 4 samples by a pilot, and the rest by what it finds.
    Adaptive,
    /// 10 of them by stripes of 4 pixels, seven times as many in each second one, between even ones.
    Steered,
}

fn render<I: Integrator>(
    context: &RenderContext,
    make: impl Fn(RenderContext) -> I,
    screen: Screen,
) -> Pictures {
    let mut pictures = Pictures::new();
    match screen {
        Screen::Even => {
            pictures.trace(&tracer(context, ScreenSampling::Even, make), 16);
            return pictures;
        }
        Screen::Steered => {
            let stripes = (0..256).map(|region| f64::from(region & 1)).collect::<Vec<_>>();
            let density = Arc::new(ScreenDensity::new(&stripes));
            let most = density.relative().fold(0.0, f32::max);
            assert_eq!(most, 1.75, "all that a quarter of an even share leaves");
            // Of either replicate, which has half of the samples.
            let pixels = (SIDE * SIDE) as u64 / 2;
            let (seed, steered) = (context.seed, 2 * pixels..12 * pixels);
            let screen = ScreenSampling::steered(density, steered, seed, &context.cells);
            pictures.trace(&tracer(context, screen, make), 16);
            return pictures;
        }
        Screen::Adaptive => {}
    }
    pictures.trace(&tracer(context, ScreenSampling::Pilot, &make), 4);
    let level = ScreenDensity::level((SIDE * SIDE) as f64);
    let errors = pictures.replicates.region_errors(&UvWindow::PICTURE, level).expect("a pilot of all pixels");
    let density = ScreenDensity::new(&errors);
    let most = density.relative().fold(0.0, f32::max);
    assert!(most > 1.5, "nothing to distribute: {most}");
    let screen = ScreenSampling::adaptive(Arc::new(density), context.seed, &context.cells);
    pictures.trace(&tracer(context, screen, &make), 12);
    pictures
}

/// Pictures of all seeds, two threads.
fn repeat<I: Integrator>(
    scene: &str,
    first: u32,
    make: impl Fn(RenderContext) -> I + Sync,
    screen: Screen,
) -> Vec<Pictures> {
    let context = context(scene, 0);
    let picture = |seed| render(&RenderContext { seed: first + seed, ..context.clone() }, &make, screen);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| (SEEDS / 2..SEEDS).map(picture).collect::<Vec<_>>());
        let mut all: Vec<_> = (0..SEEDS / 2).map(picture).collect();
        all.extend(other.join().expect("no path panics"));
        all
    })
}

/// The least probability of the differences between blocks of two kinds of pictures, times the number of blocks.
fn agreement(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let of = |block: usize| {
        let [a, b] = [a, b].map(|all| moments(all.iter().map(|blocks| blocks[block])));
        let (t, freedom) = t(a, b, 0.0, f64::from(SEEDS));
        p_value(t, freedom)
    };
    (0..a[0].len()).map(of).fold(1.0, f64::min) * a[0].len() as f64
}

/// Welch's test of each block, at a level of 1 % for all together; and of the whole picture. Without the weights it must fail at a tenth of
/// that level.
fn agrees_with_even_sampling<I: Integrator>(make: impl Fn(RenderContext) -> I + Sync + Copy, screen: Screen) {
    let even = repeat("cornell_spheres.xml", 100, make, Screen::Even);
    let adaptive = repeat("cornell_spheres.xml", 200, make, screen);
    let blocks = |all: &[Pictures]| all.iter().map(Pictures::blocks).collect::<Vec<_>>();
    let whole = |all: &[Vec<f64>]| all.iter().map(|b| vec![b.iter().sum::<f64>()]).collect::<Vec<_>>();
    let (a, b) = (blocks(&even), blocks(&adaptive));
    let (each, all) = (agreement(&a, &b), agreement(&whole(&a), &whole(&b)));
    println!("least probability of a block {each:.3}, of the picture {all:.3}");
    assert!(each > 0.01 && all > 0.01, "{each:e} {all:e}");
    let naive = |all: &[Pictures]| {
        let mean = |pictures: &Pictures| pictures.unweighted.iter().map(|[sum, n]| sum / n).collect();
        all.iter().map(mean).collect::<Vec<Vec<f64>>>()
    };
    let naive = agreement(&naive(&even), &naive(&adaptive));
    println!("without weights {naive:e}");
    assert!(naive < 1e-3, "case too easy: samples of equal weight agree, too: {naive:e}");
}

#[test]
fn path_tracing_agrees_with_even_sampling() {
    agrees_with_even_sampling(PathTracer::from, Screen::Adaptive);
}

#[test]
fn bidirectional_path_tracing_agrees_with_even_sampling() {
    agrees_with_even_sampling(BidirectionalTracer::from, Screen::Adaptive);
}

#[test]
fn steered_paths_agree_with_even_ones() {
    agrees_with_even_sampling(PathTracer::from, Screen::Steered);
}

#[test]
fn steered_paths_from_both_ends_agree_with_even_ones() {
    agrees_with_even_sampling(BidirectionalTracer::from, Screen::Steered);
}

/// Before and after the steered paths the samples are those of an even screen, bit for bit.
#[test]
fn only_steered_paths_differ_from_those_of_an_even_screen() {
    fn check<I: Integrator>(make: impl Fn(RenderContext) -> I) {
        let context = context("cornell_spheres.xml", 5);
        let density = Arc::new(ScreenDensity::new(&(0..64).map(f64::from).collect::<Vec<_>>()));
        let of = |screen| {
            let tracer = make(RenderContext { screen, ..context.clone() });
            let per_index = tracer.paths_per_index().camera;
            let mut scratch = I::Scratch::default();
            // The steered ones are 1024 paths from number 1024 on.
            [0..1024, 1024..2048, 2048..3072].map(|paths: std::ops::Range<u64>| {
                let mut samples = Samples::default();
                (paths.start / per_index..paths.end / per_index)
                    .for_each(|index| tracer.trace(index, &mut scratch, &mut samples));
                samples
            })
        };
        let [before, between, after] = of(ScreenSampling::Even);
        let steered = of(ScreenSampling::steered(density.clone(), 1024..2048, 5, &context.cells));
        assert!(steered[0] == before && steered[2] == after, "even samples changed");
        assert!(steered[1] != between, "no sample was steered");
    }
    check(PathTracer::from);
    check(BidirectionalTracer::from);
}

/// The error that 16 pictures state over the one they have.
#[test]
fn the_stated_error_holds() {
    for (scene, bound) in [("cornell.xml", 0.08), ("brushed.xml", 0.12)] {
        let pictures = repeat(scene, 300, PathTracer::from, Screen::Adaptive);
        let rgb: Vec<Vec<[f32; 3]>> = pictures.iter().map(Pictures::rgb).collect();
        let n = f32::from(SEEDS as u16);
        let mean = |i: usize| [0, 1, 2].map(|c| rgb.iter().map(|picture| picture[i][c]).sum::<f32>() / n);
        let mean: Vec<[f32; 3]> = (0..SIDE * SIDE).map(mean).collect();
        let (mut stated, mut real) = ([0.0; 2], [0.0; 2]);
        for (picture, rgb) in pictures.iter().zip(&rgb) {
            let pixels = picture.replicates.pixels().unwrap();
            let (says, _) = picture.replicates.error(&pixels).unwrap();
            let is = ErrorField::against(rgb, &mean, [SIDE; 2]).unwrap();
            for (sums, field) in [(&mut stated, says), (&mut real, is)] {
                let estimate = field.estimate(TileSubset::All);
                let [median, p95, _] = estimate.relative.map(|interval| interval.value);
                *sums = [sums[0] + median, sums[1] + p95];
            }
        }
        // The mean of the pictures contains each of them.
        let unbiased = f64::from(n / (n - 1.0)).sqrt();
        for (stated, real) in stated.iter().zip(&real) {
            let ratio = stated / (real * unbiased);
            println!("{scene}: stated over true error {ratio:.3}");
            assert!((ratio - 1.0).abs() < bound, "{scene}: {ratio}");
        }
    }
}

/// All samples of an adaptive tracer.
#[derive(Default, PartialEq, Debug)]
struct Samples(Vec<([u32; 2], [u32; 3], u32)>);

impl SampleSink for Samples {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, w: f32) {
        self.0.push((uv.map(f32::to_bits), [value.x, value.y, value.z].map(f32::to_bits), w.to_bits()));
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.camera(uv, value, -1.0);
    }
}

/// A context that gets another size has the regions of that size, whose paths are other ones where the corner of the sequence is another.
#[test]
fn regions_follow_the_size() {
    let density = Arc::new(ScreenDensity::new(&(0..64).map(f64::from).collect::<Vec<_>>()));
    let context = context("cornell_spheres.xml", 5);
    let starts =
        |context: &RenderContext| (0..256).map(|path| context.screen.start(path)).collect::<Vec<_>>();
    let adaptive = |context: RenderContext| {
        let screen = ScreenSampling::adaptive(density.clone(), context.seed, &context.cells);
        RenderContext { screen, ..context }
    };
    let [before, after] = [512, 256].map(|side| starts(&adaptive(context.clone().of_size([side; 2]))));
    assert_ne!(before, after);
    assert_eq!(after, starts(&adaptive(context.of_size([512; 2])).of_size([256; 2])));
}

/// The samples of an index do not depend on what the worker has traced before.
#[test]
fn samples_depend_on_the_index_alone() {
    fn check<I: Integrator>(make: impl Fn(RenderContext) -> I) {
        let errors: Vec<f64> = (0..64).map(|region| f64::from(region * region)).collect();
        let context = context("cornell_spheres.xml", 5);
        let screen = ScreenSampling::adaptive(Arc::new(ScreenDensity::new(&errors)), 5, &context.cells);
        let tracer = make(RenderContext { screen, ..context });
        let of = |indices: &[u64]| {
            let mut scratch = I::Scratch::default();
            indices
                .iter()
                .map(|&index| {
                    let mut samples = Samples::default();
                    tracer.trace(index, &mut scratch, &mut samples);
                    samples
                })
                .collect::<Vec<_>>()
        };
        let there = of(&[3, 100, 101, 900]);
        let mut back = of(&[900, 101, 100, 3]);
        back.reverse();
        assert_eq!(there, back);
        assert!(
            there
                .iter()
                .flat_map(|samples| &samples.0)
                .any(|(.., w)| ![1.0, -1.0].contains(&f32::from_bits(*w)))
        );
    }
    check(PathTracer::from);
    check(BidirectionalTracer::from);
    check(|context| PhotonTracer::new(context, true));
    check(|context| VcmTracer::new(context, true));
}
