//! How true the stated errors of replicates are, and what they cost.
//!
//! Every scene is rendered again and again, each time with another seed, undivided and divided into two replicates. The reference
//! of each picture is the mean of all others, or with `--reference METHOD` a picture by another method, whose own error, as halves of its
//! runs differ, is taken off: it shows the bias of photon mapping, and what a method does not find. With a Gaussian filter, or a reference, there are divided
//! runs and the first table only.
//!
//! First table: stated over true error, half a 90 % interval's logarithm as stated and as the runs scatter, and how often the
//! intervals held the picture's true error.
//! Second table: error of each way to divide a run over that of an undivided one. Independent randomisations follow from the
//! undivided runs' own curve, V(n): R of them have V(N/R)/R. Aligned quarters of one sequence cost nothing; what they state is too
//! much, by as much as the quarters are better together than alone.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use pointillist::client::SplatFilter;
use pointillist::color::Xyz;
use pointillist::image::compare::luminance;
use pointillist::scene::desc::IntegratorKind;
use pointillist::scene::load;
use pointillist::stream::{Sample, SampleSink, UvWindow};
use pointillist::study::blur::BlurSchedule;
use pointillist::study::error_tile::TILE;
use pointillist::study::interval::Z90;
use pointillist::study::{AccumulatedSamples, ErrorField, ErrorMonitor, Interval, TileSubset};
use pointillist::tracer::integrator::{
    BidirectionalTracer, CAMERA_SUBPATHS, LAST_GENERATION, ParticleTracer, PathTracer, PhotonTracer,
    RenderContext, Replicated, SAMPLES_PER_GENERATION, VcmTracer,
};
use pointillist::tracer::witness;
use pointillist::tracer::{Camera, Integrator, Scene};
use rayon::prelude::*;

use super::common::Outcome;

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// Scene and method, in pairs; three usual pairs when not given
    #[arg(value_names = ["SCENE METHOD"])]
    scenes: Vec<String>,
    /// Pixels along a side of the picture
    #[arg(long, default_value_t = 128)]
    size: u32,
    /// Samples per pixel
    #[arg(long, default_value_t = 32)]
    spp: u64,
    /// Runs each way
    #[arg(long, default_value_t = 34)]
    runs: u32,
    /// The pixel filter
    #[arg(long, value_enum, default_value = "box")]
    filter: Filter,
    /// The method of a reference for all runs, instead of the mean of the others
    #[arg(long, value_name = "METHOD")]
    reference: Option<String>,
    /// Samples per pixel of that reference
    #[arg(long, default_value_t = 2048)]
    reference_spp: u64,
    /// State errors without witnesses of light that is found late
    #[arg(long)]
    no_witnesses: bool,
}

/// The pixel filter.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Filter {
    Box,
    Gaussian,
}

#[derive(Clone, Copy)]
struct Options {
    side: u32,
    spp: u64,
    runs: u32,
    filter: SplatFilter,
    /// Witnesses tell what this method has not found.
    witnesses: Option<IntegratorKind>,
    /// How the blur of the method shrinks, if it has any.
    blur: Option<BlurSchedule>,
}

/// One run at some number of samples.
struct Level {
    spp: u64,
    /// Linear RGB.
    picture: Vec<[f32; 3]>,
    /// Median, p95, p99, relMSE, as the replicates state them.
    stated: Option<[Interval; 4]>,
    /// Share of the squared error that is stated to be blur.
    blur: Option<f64>,
    /// Variance of the mean luminance, as aligned quarters of the run have it; of undivided runs.
    quarters: Option<Vec<f64>>,
}

type Run = Vec<Level>;

/// Measures every pair of scene and method.
pub fn run(arguments: &Arguments) -> Outcome {
    let filter = match arguments.filter {
        Filter::Box => SplatFilter::Box,
        Filter::Gaussian => SplatFilter::Gaussian,
    };
    let options = Options {
        side: arguments.size,
        spp: arguments.spp,
        runs: arguments.runs,
        filter,
        witnesses: None,
        blur: None,
    };
    let mut last = None;
    let usual = [
        ["scenes/cornell.xml", "path"],
        ["scenes/cornell_spheres.xml", "bidirectional"],
        ["scenes/veach_plates.xml", "path"],
    ];
    if arguments.scenes.is_empty() {
        return usual
            .iter()
            .try_for_each(|[scene, method]| study(scene.as_ref(), method, arguments, options, &mut last));
    }
    let (pairs, []) = arguments.scenes.as_chunks::<2>() else {
        return Err("every scene takes a method: SCENE METHOD".into());
    };
    pairs.iter().try_for_each(|[scene, method]| study(scene.as_ref(), method, arguments, options, &mut last))
}

fn kind_of(method: &str) -> Result<IntegratorKind, String> {
    match method {
        "path" => Ok(IntegratorKind::Path),
        "light" => Ok(IntegratorKind::Light),
        "bidirectional" => Ok(IntegratorKind::Bidirectional),
        "photon" => Ok(IntegratorKind::Photon),
        "vcm" => Ok(IntegratorKind::Vcm),
        _ => Err(format!("{method}: the methods are path, light, bidirectional, photon and vcm")),
    }
}

/// The reference of the last scene: pairs that follow share it.
type LastReference = Option<(PathBuf, Rc<Reference>)>;

fn study(
    path: &Path,
    method: &str,
    arguments: &Arguments,
    options: Options,
    last: &mut LastReference,
) -> Outcome {
    let mut desc = load(path, &[])?.desc;
    (desc.film.width, desc.film.height, desc.film.crop) = (options.side, options.side, None);
    let (scene, camera) = (Arc::new(Scene::prepare(&desc)?), Camera::of(&desc)?);
    let run = |kind: IntegratorKind, options: Options, seed: u32, divided: bool| {
        let context =
            RenderContext::new(scene.clone(), camera.clone(), &desc.integrator, seed, UvWindow::PICTURE);
        let context = context.of_size([options.side; 2]);
        match kind {
            IntegratorKind::Path | IntegratorKind::Depth | IntegratorKind::Auto => {
                trace::<PathTracer>(&context, divided, options)
            }
            IntegratorKind::Light => trace::<ParticleTracer>(&context, divided, options),
            IntegratorKind::Bidirectional => trace::<BidirectionalTracer>(&context, divided, options),
            IntegratorKind::Photon => trace::<PhotonTracer>(&context, divided, options),
            IntegratorKind::Vcm => trace::<VcmTracer>(&context, divided, options),
        }
    };
    let all = |kind: IntegratorKind, options: Options, divided: bool| -> Vec<Run> {
        let first = if divided { 0 } else { 1 << 20 };
        (0..options.runs).into_par_iter().map(|n| run(kind, options, first + n, divided)).collect()
    };
    let own = kind_of(method)?;
    let blur = |last_generation| {
        let alpha = desc.integrator.photons.alpha.unwrap_or(0.0);
        let samples_per_index = if own == IntegratorKind::Vcm { CAMERA_SUBPATHS } else { 1 };
        Some(BlurSchedule {
            samples_per_generation: SAMPLES_PER_GENERATION,
            samples_per_index,
            alpha,
            last_generation,
        })
    };
    let options = Options {
        witnesses: (!arguments.no_witnesses).then_some(own),
        blur: match own {
            IntegratorKind::Photon => blur(LAST_GENERATION),
            IntegratorKind::Vcm => blur(u64::MAX),
            _ => None,
        },
        ..options
    };
    let other = match &arguments.reference {
        Some(_) if last.as_ref().is_some_and(|(scene, _)| scene == path) => {
            last.as_ref().map(|last| last.1.clone())
        }
        Some(method) => {
            if !arguments.reference_spp.is_power_of_two()
                || arguments.reference_spp < 2 * u64::from(REFERENCES)
            {
                return Err(format!("--reference-spp takes a power of two from {} on", 2 * REFERENCES).into());
            }
            let parts = Options {
                spp: arguments.reference_spp / u64::from(REFERENCES),
                runs: REFERENCES,
                witnesses: None,
                blur: None,
                ..options
            };
            // Seeds that no run has.
            let kind = kind_of(method)?;
            let seeds = (0..REFERENCES).into_par_iter().map(|n| run(kind, parts, (1 << 21) + n, true));
            let reference = Rc::new(Reference::of(&seeds.collect::<Vec<Run>>(), options.side)?);
            Some(last.insert((path.to_path_buf(), reference)).1.clone())
        }
        None => None,
    };
    // Undivided runs have the box filter: they are no reference for another.
    let whole = match options.filter {
        SplatFilter::Box if other.is_none() => all(own, options, false),
        _ => Vec::new(),
    };
    let divided = all(own, options, true);
    Report::new(options, whole, divided, other).print(&format!("{} {method}", path.display()));
    Ok(())
}

fn mean_of(pictures: &[&[[f32; 3]]]) -> Vec<[f32; 3]> {
    let pixels = pictures.first().map_or(0, |picture| picture.len());
    let mean = |i: usize, c: usize| {
        pictures.iter().map(|picture| f64::from(picture[i][c])).sum::<f64>() / pictures.len() as f64
    };
    (0..pixels).map(|i| [0, 1, 2].map(|c| mean(i, c) as f32)).collect()
}

/// Independent runs whose mean is a reference.
const REFERENCES: u32 = 16;

/// A picture by another method.
struct Reference {
    /// Linear RGB.
    picture: Vec<[f32; 3]>,
    /// Its own median, p95 and p99, and its relMSE.
    own: [f64; 4],
}

impl Reference {
    /// The mean of some runs. What it has of error follows from how they differ.
    fn of(runs: &[Run], side: u32) -> Result<Self, String> {
        let lasts: Vec<&[[f32; 3]]> =
            runs.iter().filter_map(|run| run.last()).map(|last| last.picture.as_slice()).collect();
        let (first, second) = lasts.split_at(lasts.len() / 2);
        let halves = ErrorField::against(&mean_of(first), &mean_of(second), [side as usize; 2]);
        let apart = halves.ok_or("the reference has no error")?.estimate(TileSubset::All);
        let [a, b, c] = apart.relative.map(|i| 0.5 * i.value);
        Ok(Self { picture: mean_of(&lasts), own: [a, b, c, 0.25 * apart.rel_mse.value] })
    }
}

/// Traces and takes stock at every doubling.
fn trace<I: Integrator + From<RenderContext>>(
    context: &RenderContext,
    divided: bool,
    options: Options,
) -> Run {
    let integrator = Replicated::new(context, divided, I::from);
    let pixels = u64::from(options.side).pow(2);
    let per = integrator.paths_per_index();
    let each = per.camera.max(per.light);
    let mut accumulated = AccumulatedSamples::new([options.side; 2], options.filter.energy());
    let mut monitor = ErrorMonitor::new([options.side; 2], None);
    if let Some(schedule) = options.blur {
        (monitor, accumulated) = (monitor.with_blur(), accumulated.with_blur(schedule));
    }
    let witnesses = options.witnesses.and_then(|method| witness::pair(context.clone(), TILE as u32, method));
    if let Some(witnesses) = witnesses {
        monitor.set_witnesses(Box::new(witnesses));
    }
    let (mut scratch, mut sink) = (Default::default(), Sink::new(options.side as usize));
    let (mut levels, mut index, mut snapshots) = (Run::new(), 0, BTreeMap::new());
    // Half samples per pixel, so that quarters of every level are among them.
    for halves in 1..=2 * options.spp {
        let end = (halves * pixels).div_ceil(2 * each);
        while index < end {
            sink.samples.clear();
            integrator.trace(index, &mut scratch, &mut sink);
            if divided {
                accumulated.add(index, per, &sink.samples);
            } else {
                sink.add();
            }
            index += 1;
        }
        let spp = halves / 2;
        let quarter = |n: u64| n.is_power_of_two() || n.is_multiple_of(3) && (n / 3).is_power_of_two();
        if !divided && quarter(halves) {
            snapshots.insert(halves, (sink.sums.clone(), index * per.light));
        }
        if halves % 2 == 0 && spp.is_power_of_two() && spp >= 2 {
            levels.push(match divided {
                true => stated(spp, &accumulated, &mut monitor),
                false => whole(spp, &snapshots),
            });
        }
    }
    levels
}

/// A level of a divided run.
fn stated(spp: u64, accumulated: &AccumulatedSamples, monitor: &mut ErrorMonitor) -> Level {
    let known = accumulated.replicates().pixels().unwrap_or_default();
    monitor.take_checkpoint(accumulated, spp as f64);
    let status = monitor.status();
    let is_known = status.checkpoints.last().is_some_and(|last| last.seconds == spp as f64);
    let f = status.estimate;
    let stated = is_known.then_some([f.relative[0], f.relative[1], f.relative[2], f.rel_mse]);
    Level {
        spp,
        picture: known.iter().map(|pixel| pixel.mean).collect(),
        stated,
        blur: status.blur,
        quarters: None,
    }
}

/// Sums and light paths after so many half samples per pixel.
type Snapshots = BTreeMap<u64, (Vec<[f64; 8]>, u64)>;

/// A level of an undivided run, box filter: its picture, and what its quarters say.
fn whole(spp: u64, snapshots: &Snapshots) -> Level {
    let halves = 2 * spp;
    let none = (vec![[0.0; 8]; snapshots[&halves].0.len()], 0);
    let at = |n: u64| if n == 0 { &none } else { &snapshots[&n] };
    let between = |a: u64, b: u64| -> Vec<[f64; 3]> {
        let ((before, l0), (after, l1)) = (at(a), at(b));
        let scale = before.len() as f64 / ((l1 - l0) as f64).max(1.0);
        let pixel = |(a, b): (&[f64; 8], &[f64; 8])| {
            let sum: [f64; 8] = std::array::from_fn(|i| b[i] - a[i]);
            [0, 1, 2].map(|c| if sum[3] > 0.0 { sum[c] / sum[3] } else { 0.0 } + sum[4 + c] * scale)
        };
        before.iter().zip(after).map(pixel).collect()
    };
    let rgb = |xyz: &[f64; 3]| {
        let xyz = glam::Vec3::from(xyz.map(|v| v as f32));
        (pointillist::color::Profile::srgb().from_xyz * xyz).to_array()
    };
    let picture: Vec<[f32; 3]> = between(0, halves).iter().map(rgb).collect();
    let parts: Vec<Vec<[f64; 3]>> = (0..4).map(|q| between(q * halves / 4, (q + 1) * halves / 4)).collect();
    let variance = |i: usize| {
        let y: Vec<f64> = parts.iter().map(|part| part[i][1]).collect();
        let mean = y.iter().sum::<f64>() / 4.0;
        y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / 12.0
    };
    let quarters = Some((0..picture.len()).map(variance).collect());
    Level { spp, picture, stated: None, blur: None, quarters }
}

/// What all runs say together.
struct Report {
    options: Options,
    whole: Vec<Run>,
    divided: Vec<Run>,
    /// Sum of the last level of all runs.
    sum: Vec<[f64; 3]>,
    other: Option<Rc<Reference>>,
}

impl Report {
    fn new(options: Options, whole: Vec<Run>, divided: Vec<Run>, other: Option<Rc<Reference>>) -> Self {
        let mut sum = vec![[0.0; 3]; (options.side as usize).pow(2)];
        for last in whole.iter().chain(&divided).filter_map(|run| run.last()) {
            for (sum, x) in sum.iter_mut().zip(&last.picture) {
                *sum = std::array::from_fn(|c| sum[c] + f64::from(x[c]));
            }
        }
        Self { options, whole, divided, sum, other }
    }

    /// True figures of a run at a level, against the mean of the others or the reference, whose own error is taken off.
    fn truth(&self, run: &Run, level: usize) -> [f64; 4] {
        let (Some(last), size) = (run.last(), [self.options.side as usize; 2]) else { return [0.0; 4] };
        if let Some(reference) = &self.other {
            let Reference { picture, own } = reference.as_ref();
            let Some(field) = ErrorField::against(&run[level].picture, picture, size) else {
                return [0.0; 4];
            };
            let figures = field.estimate(TileSubset::All);
            let [a, b, c] =
                [0, 1, 2].map(|i| (figures.relative[i].value.powi(2) - own[i].powi(2)).max(0.0).sqrt());
            return [a, b, c, (figures.rel_mse.value - own[3]).max(0.0)];
        }
        let others = (self.whole.len() + self.divided.len()) as f64 - 1.0;
        let without =
            |(s, x): (&[f64; 3], &[f32; 3])| [0, 1, 2].map(|c| ((s[c] - f64::from(x[c])) / others) as f32);
        let reference: Vec<[f32; 3]> = self.sum.iter().zip(&last.picture).map(without).collect();
        let off = 1.0 + run[level].spp as f64 / last.spp as f64 / others;
        let Some(field) = ErrorField::against(&run[level].picture, &reference, size) else { return [0.0; 4] };
        let figures = field.estimate(TileSubset::All);
        let [a, b, c] = figures.relative.map(|i| i.value / off.sqrt());
        [a, b, c, figures.rel_mse.value / off]
    }

    /// Mean relMSE of some runs at a level.
    fn error(&self, runs: &[Run], level: usize) -> f64 {
        runs.iter().map(|run| self.truth(run, level)[3]).sum::<f64>() / runs.len() as f64
    }

    fn print(&self, name: &str) {
        let Options { side, runs, filter, .. } = self.options;
        println!("{name}, {side}x{side}, {runs} runs each way, {filter:?}");
        println!(
            "   spp  median: stated/true, held     p95                           p99                           root of relMSE"
        );
        let count = self.divided[0].len();
        for level in 0..count {
            let truths: Vec<[f64; 4]> = self.divided.iter().map(|run| self.truth(run, level)).collect();
            let cells: Vec<String> = (0..4).map(|figure| self.held(level, figure, &truths)).collect();
            println!("{:6}  {}", self.divided[0][level].spp, cells.join("    "));
        }
        if let Some(reference) = self.other.as_ref().filter(|_| self.divided.len() > 1) {
            (0..count).for_each(|level| {
                println!("{:6}  {}", self.divided[0][level].spp, self.bias(level, reference))
            });
        }
        if self.whole.is_empty() {
            return;
        }
        let curve: Vec<(f64, f64)> = (0..count)
            .map(|level| (self.whole[0][level].spp as f64, self.error(&self.whole, level)))
            .collect();
        println!(
            "   spp  root of relMSE   2 independent (as rendered)   4      16     growing from 2 to 4   quarters: cost, stated/true"
        );
        for level in 2..count {
            let (n, v) = curve[level];
            let independent = |r: f64| (at(&curve, n / r) / r / v).sqrt();
            // Four from a quarter of the samples on: two have 5/16, two 3/16 of them.
            let parts = [5.0 / 16.0, 5.0 / 16.0, 3.0 / 16.0, 3.0 / 16.0];
            let growing: f64 = parts.iter().map(|p| p * p * at(&curve, p * n)).sum();
            println!(
                "{n:6}  {:.5}          {:.3} ({:.3})                 {:.3}  {}  {:.3}                 1.000, {:.3}",
                v.sqrt(),
                independent(2.0),
                (self.error(&self.divided, level) / v).sqrt(),
                independent(4.0),
                if n >= 32.0 { format!("{:.3}", independent(16.0)) } else { "–    ".to_string() },
                (growing / v).sqrt(),
                self.quarters(level)
            );
        }
    }

    /// Which share of the relMSE all runs have in common, and which share of the squared relative error is stated to be blur.
    fn bias(&self, level: usize, reference: &Reference) -> String {
        let runs = self.divided.len() as f64;
        let pictures: Vec<&[[f32; 3]]> =
            self.divided.iter().map(|run| run[level].picture.as_slice()).collect();
        let size = [self.options.side as usize; 2];
        let Some(field) = ErrorField::against(&mean_of(&pictures), &reference.picture, size) else {
            return String::new();
        };
        let all = self.error(&self.divided, level);
        let common = field.estimate(TileSubset::All).rel_mse.value - reference.own[3];
        let bias = (common - all / runs) / (1.0 - 1.0 / runs) / all;
        let known: Vec<f64> = self.divided.iter().filter_map(|run| run[level].blur).collect();
        let stated = known.iter().sum::<f64>() / known.len().max(1) as f64;
        format!(
            "bias {:.1} % of relMSE; stated in {} runs: {:.1} %",
            100.0 * bias,
            known.len(),
            100.0 * stated
        )
    }

    /// One figure of the replicates: stated over true; half the logarithm of its 90 % interval, as stated and (in brackets) as the
    /// runs scatter; the share of intervals that held.
    fn held(&self, level: usize, figure: usize, truths: &[[f64; 4]]) -> String {
        let (mut held, mut logs, mut squares, mut width, mut known) = (0.0, 0.0, 0.0, 0.0, 0.0f64);
        for (run, truth) in self.divided.iter().zip(truths) {
            let Some(stated) = run[level].stated.map(|stated| stated[figure]) else { continue };
            let root = if figure == 3 { 0.5 } else { 1.0 };
            held += f64::from(u8::from(stated.holds(truth[figure])));
            let log = root * (stated.value / truth[figure]).ln();
            (logs, squares) = (logs + log, squares + log * log);
            width += root * (stated.high / stated.low).ln() / 2.0;
            known += 1.0;
        }
        let k = known.max(1.0);
        let scatter = Z90 * ((squares - logs * logs / k).max(0.0) / (k - 1.0).max(1.0)).sqrt();
        format!("{:.3} ±{:.3} ({scatter:.3}) {:3.0} %", (logs / k).exp(), width / k, 100.0 * held / k)
    }

    /// Error stated by the quarters over the true one, of luminance.
    fn quarters(&self, level: usize) -> f64 {
        let n = self.whole.len() as f64;
        let (mut said, mut was) = (0.0, 0.0);
        for i in 0..self.sum.len() {
            let y: Vec<f64> = self.whole.iter().map(|run| luminance(run[level].picture[i])).collect();
            let mean = y.iter().sum::<f64>() / n;
            let scale = n * (mean * mean + 0.01);
            was += y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / (n - 1.0) * n / scale;
            said += self.whole.iter().filter_map(|run| Some(run[level].quarters.as_ref()?[i])).sum::<f64>()
                / scale;
        }
        (said / was).sqrt()
    }
}

/// relMSE after `n` samples, between the points of a curve or beyond its ends by the nearest two.
fn at(curve: &[(f64, f64)], n: f64) -> f64 {
    let right = curve.iter().position(|point| point.0 >= n).unwrap_or(curve.len() - 1).max(1);
    let [(n0, v0), (n1, v1)] = [curve[right - 1], curve[right]];
    v0 * (v1 / v0).powf((n / n0).ln() / (n1 / n0).ln())
}

/// Takes the samples of an index.
pub(super) struct Sink {
    pub(super) samples: Vec<Sample>,
    side: usize,
    /// `[X, Y, Z, W]` of the camera stream and of the light stream.
    sums: Vec<[f64; 8]>,
}

impl Sink {
    pub(super) fn new(side: usize) -> Self {
        Self { samples: Vec::new(), side, sums: vec![[0.0; 8]; side * side] }
    }

    fn add(&mut self) {
        for Sample { uv, xyz, w } in &self.samples {
            let [x, y] = uv.map(|c| (c * self.side as f32) as usize);
            if uv.iter().all(|c| *c >= 0.0) && x < self.side && y < self.side {
                let sum = &mut self.sums[y * self.side + x][if *w > 0.0 { 0 } else { 4 }..];
                for (sum, value) in sum.iter_mut().zip([xyz.x, xyz.y, xyz.z, *w]) {
                    *sum += f64::from(value);
                }
            }
        }
    }
}

impl SampleSink for Sink {
    fn camera(&mut self, uv: [f32; 2], value: Xyz, weight: f32) {
        self.samples.push(Sample { uv, xyz: value * weight, w: weight });
    }

    fn light(&mut self, uv: [f32; 2], value: Xyz) {
        self.samples.push(Sample { uv, xyz: value, w: -1.0 });
    }
}
