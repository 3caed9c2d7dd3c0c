//! How often the warning that light is still being found was right.
//!
//! Every scene is rendered by path tracing and bidirectionally, and compared with a long bidirectional reference at every
//! quadrupling of the samples. A warning is right where the true error of 95 % of the picture, in the geometric mean over the
//! runs, is more than 1.2 times the stated one; so is it to tell there that light is not yet found. A warning elsewhere is a
//! false alarm. The thresholds of the warning were chosen by the scenes of the first table; the second has the others.

use std::path::Path;
use std::sync::Arc;

use pointillist::scene::desc::IntegratorKind;
use pointillist::scene::desc::SceneDesc;
use pointillist::scene::load;
use pointillist::stream::UvWindow;
use pointillist::study::error_tile::TILE;
use pointillist::study::largest::LargestShares;
use pointillist::study::late::LateLight;
use pointillist::study::{AccumulatedSamples, ErrorField, ErrorMonitor, TileSubset};
use pointillist::tracer::integrator::{BidirectionalTracer, PathTracer, RenderContext, Replicated};
use pointillist::tracer::witness;
use pointillist::tracer::{Camera, Integrator, Scene};

use super::common::Outcome;
use super::replicates::Sink;

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// Pixels along a side of the picture
    #[arg(long, default_value_t = 128)]
    size: u32,
    /// Samples per pixel of the last level; levels are powers of 4
    #[arg(long, default_value_t = 64)]
    spp: u64,
    /// Samples per pixel of the reference
    #[arg(long, default_value_t = 4096)]
    reference: u64,
    /// Renders of each
    #[arg(long, default_value_t = 4)]
    runs: u32,
    /// Print every render
    #[arg(long)]
    each: bool,
    /// Scenes of the second table; the usual ones of both when not given
    scenes: Vec<std::path::PathBuf>,
}

/// The scenes by which the thresholds were chosen, and the others.
const SCENES: [&[&str]; 2] = [
    &["cornell", "cornell_spheres", "caustic", "prism", "furnace", "veach_plates"],
    &["veach_door", "rough", "cove", "brushed", "staircase2/scene", "veach-bidir/scene"],
];

/// True error over stated error above which a warning is wanted.
const WANTED: f64 = 1.2;

/// Warnings that were right, false alarms, warnings that were missing, silence that was right.
type Score = [usize; 4];

/// Measures all scenes.
pub fn run(arguments: &Arguments) -> Outcome {
    let file = |name: &&str| format!("scenes/{name}.xml").into();
    let usual = SCENES.map(|names| names.iter().map(file).collect::<Vec<std::path::PathBuf>>());
    let tables = if arguments.scenes.is_empty() { usual } else { [Vec::new(), arguments.scenes.clone()] };
    for (title, scenes) in ["by which the thresholds were chosen", "others"].iter().zip(tables) {
        println!(
            "Scenes {title}\nscene, method, spp: true/stated median, 95 %, 99 %; largest sample; missing; warned, told"
        );
        let mut score = Score::default();
        for scene in &scenes {
            study(scene, arguments, &mut score)?;
        }
        let [right, alarms, missed, silent] = score;
        println!(
            "told and wanted {right}, false alarms {alarms}, missed {missed}, rightly silent {silent}\n"
        );
    }
    Ok(())
}

/// What one run says at one level.
struct Level {
    spp: u64,
    /// Logarithms of true over stated error: median, 95 %, 99 %.
    ratios: [f64; 3],
    late: LateLight,
    /// Upper end over stated error: 95 %, relMSE.
    above: [f64; 2],
    /// The error is said to be larger than stated.
    warned: bool,
    /// That is said, or that the picture lacks light.
    told: bool,
}

/// A scene at the size of a measurement.
pub(super) struct Subject {
    desc: SceneDesc,
    scene: Arc<Scene>,
    camera: Camera,
    side: u32,
}

impl Subject {
    pub(super) fn open(path: &Path, side: u32) -> Outcome<Self> {
        let mut desc = load(path, &[])?.desc;
        (desc.film.width, desc.film.height, desc.film.crop) = (side, side, None);
        Ok(Self { scene: Arc::new(Scene::prepare(&desc)?), camera: Camera::of(&desc)?, desc, side })
    }

    pub(super) fn context(&self, seed: u32) -> RenderContext {
        let (scene, camera) = (self.scene.clone(), self.camera.clone());
        let context = RenderContext::new(scene, camera, &self.desc.integrator, seed, UvWindow::PICTURE);
        context.of_size([self.side; 2])
    }

    /// The picture with so many samples per pixel, by paths from both ends, linear Rec.709. Two threads.
    pub(super) fn reference(&self, spp: u64) -> Vec<[f32; 3]> {
        let half = |seed: u32| {
            let mut all = Vec::new();
            let look = &mut |_, accumulated: &AccumulatedSamples| all = picture(accumulated);
            trace::<BidirectionalTracer>(&self.context(seed), &[spp / 2], self.side, look);
            all
        };
        let (a, b) = std::thread::scope(|scope| {
            let other = scope.spawn(|| half(1 << 20));
            (half(1 << 21), other.join().unwrap_or_default())
        });
        let mean = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]));
        a.iter().zip(&b).map(mean).collect()
    }
}

fn picture(accumulated: &AccumulatedSamples) -> Vec<[f32; 3]> {
    let pixels = accumulated.replicates().pixels().unwrap_or_default();
    pixels.iter().map(|pixel| pixel.mean).collect()
}

fn study(path: &Path, arguments: &Arguments, score: &mut Score) -> Outcome {
    let side = arguments.size;
    let size = [side as usize; 2];
    let subject = Subject::open(path, side)?;
    let reference = subject.reference(arguments.reference);
    let methods: [(IntegratorKind, Tracing<'_>); 2] = [
        (IntegratorKind::Path, &trace::<PathTracer>),
        (IntegratorKind::Bidirectional, &trace::<BidirectionalTracer>),
    ];
    let spp: Vec<u64> = (1..).map(|k| 1 << (2 * k)).take_while(|spp| *spp <= arguments.spp).collect();
    for (method, trace) in methods {
        let run = |seed: u32| {
            let mut levels = Vec::new();
            let context = subject.context(seed);
            let mut monitor = ErrorMonitor::new([side; 2], None);
            if let Some(witnesses) = witness::pair(context.clone(), TILE as u32, method) {
                monitor.set_witnesses(Box::new(witnesses));
            }
            trace(&context, &spp, side, &mut |spp, accumulated| {
                monitor.take_checkpoint(accumulated, spp as f64);
                let truth = ErrorField::against(&picture(accumulated), &reference, size);
                let Some(truth) = truth.map(|field| field.estimate(TileSubset::All)) else { return };
                let status = monitor.status();
                let ratio = |i: usize| {
                    let [truth, stated] = [truth, status.estimate].map(|e| e.relative[i].value.max(1e-6));
                    (truth / stated).ln()
                };
                levels.push(Level {
                    spp,
                    ratios: [0, 1, 2].map(ratio),
                    late: status.late,
                    above: [status.estimate.relative[1], status.estimate.rel_mse].map(|i| i.high / i.value),
                    warned: status.late.warning().is_some(),
                    told: status.late.warning().is_some() || status.late.unfound().is_some(),
                });
            });
            levels
        };
        let part = |odd| (0..arguments.runs).filter(move |n| n % 2 == odd).map(run);
        let runs: Vec<Vec<Level>> = std::thread::scope(|scope| {
            let other = scope.spawn(|| part(1).collect::<Vec<_>>());
            let mut all: Vec<_> = part(0).collect();
            all.extend(other.join().unwrap_or_default());
            all
        });
        for (i, spp) in spp.iter().enumerate() {
            let at: Vec<&Level> =
                runs.iter().filter_map(|run| run.get(i).filter(|l| l.spp == *spp)).collect();
            let n = at.len().max(1) as f64;
            let mean = |f: &dyn Fn(&Level) -> f64| at.iter().map(|level| f(level)).sum::<f64>() / n;
            let ratios = [0, 1, 2].map(|i| mean(&|level| level.ratios[i]).exp());
            for Level { ratios, late, above, warned, told, .. } in at.iter().filter(|_| arguments.each) {
                let LargestShares { one, one_per_tile, large_in } = late.largest;
                println!(
                    "  each {}, {}, {spp}: {:.3}; {one:.4}, {one_per_tile:.4}, {large_in:.3}; {:.4}, {:.4}; {:.2}, {:.2}; {warned}, {told}",
                    path.display(),
                    method.name(),
                    ratios[1].exp(),
                    late.missing.unwrap_or(f64::NAN),
                    late.caustics,
                    above[0],
                    above[1],
                );
            }
            let warned = at.iter().filter(|level| level.warned).count();
            let wanted = ratios[1] > WANTED;
            let told = at.iter().filter(|level| level.told).count();
            // To be told of light that is missing is right also where the stated error counts all of it; whether it is missing there is not judged.
            let said = if wanted { told } else { warned };
            score[usize::from(!wanted)] += said;
            score[2 + usize::from(!wanted)] += at.len() - said;
            println!(
                "{}, {}, {spp}: {:.2}, {:.2}, {:.2}; {:.4}; {:.3}; {warned}, {told} of {}{}",
                path.display(),
                method.name(),
                ratios[0],
                ratios[1],
                ratios[2],
                mean(&|level| level.late.largest.one),
                mean(&|level| level.late.missing.unwrap_or(f64::NAN)),
                at.len(),
                if wanted { ", wanted" } else { "" }
            );
        }
    }
    Ok(())
}

/// Traces a render of one method and looks at it at these samples per pixel.
type Tracing<'a> = &'a (dyn Fn(&RenderContext, &[u64], u32, Look<'_>) + Sync);

/// Looks at the samples after so many per pixel.
type Look<'a> = &'a mut dyn FnMut(u64, &AccumulatedSamples);

fn trace<I: Integrator + From<RenderContext>>(
    context: &RenderContext,
    levels: &[u64],
    side: u32,
    look: Look<'_>,
) {
    let integrator = Replicated::new(context, true, I::from);
    let per = integrator.paths_per_index();
    let each = per.camera.max(per.light);
    let mut accumulated = AccumulatedSamples::new([side; 2], 1.0);
    let (mut scratch, mut sink, mut index) = (Default::default(), Sink::new(side as usize), 0);
    for &spp in levels {
        let end = (spp * u64::from(side).pow(2)).div_ceil(each);
        while index < end {
            sink.samples.clear();
            integrator.trace(index, &mut scratch, &mut sink);
            accumulated.add(index, per, &sink.samples);
            index += 1;
        }
        look(spp, &accumulated);
    }
}
