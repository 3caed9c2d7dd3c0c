//! Rays per second of the tracer's tree, beside Embree 3 and obvhs's compressed tree: same meshes, same rays, in turn.
//!
//! It takes about six minutes. Words leave the rest out: meshes
//! `spheres`, `bigmesh`; kernels `scalar`, `avx2`, `avx512`, others `obvhs`, `high` (Embree's best tree, measured only if
//! named); rays `primary`, `shuffled`, `path`, `shadow`; threads `1`, `2`. `quick` measures an eighth of it.
//! Embree as it is by default and Embree robust are the yardsticks; without the library the rest is measured.

use std::sync::{Arc, RwLock};

use glam::Vec3;
use pointillist::tracer::accel::{Accel, Shapes, SimdKernel};

mod agree;
mod contest;
mod embree;
mod lists;
mod others;
mod table;

use super::common::{Outcome, timed};
use super::meshes::{self, Model};
use contest::{Contestant, Effort, Question};
use embree::{Device, Mode, Scene};
use lists::Kind;
use others::{Obvhs, Ours};

/// Every word, by what it chooses from.
const WORDS: [&[&str]; 5] = [
    &["spheres", "bigmesh"],
    &["scalar", "avx2", "avx512", "obvhs", "high"],
    &["primary", "shuffled", "path", "shadow"],
    &["1", "2"],
    &["quick"],
];

/// What to measure.
#[derive(clap::Args)]
pub struct Arguments {
    /// Measures these and leaves out the others of their kind; `quick` measures an eighth, `high` adds Embree's best tree
    #[arg(value_parser = WORDS.concat())]
    words: Vec<String>,
}

impl Arguments {
    fn says(&self, word: &str) -> bool {
        self.words.iter().any(|w| w == word)
    }

    /// True for a word given, and for all of its kind when none is.
    fn has(&self, word: &str) -> bool {
        let kind = WORDS.iter().find(|kind| kind.contains(&word));
        self.says(word) || kind.is_none_or(|kind| !kind.iter().any(|w| self.says(w)))
    }
}

/// Measures both meshes.
pub fn run(choice: &Arguments) -> Outcome {
    let device = Device::open().inspect_err(|e| println!("{e}")).ok();
    if let Some(device) = &device {
        println!("Embree {}, one ray at a time", embree::version_text(device.version()));
    }
    println!("Kernels this processor lacks: {}", lacking());
    for make in [meshes::spheres, meshes::bigmesh] {
        let model = make();
        if choice.has(model.name) {
            measure(&model, device.as_ref(), choice);
        }
    }
    Ok(())
}

fn lacking() -> String {
    let names: Vec<&str> =
        SimdKernel::ALL.into_iter().filter(|k| !k.is_available()).map(SimdKernel::name).collect();
    if names.is_empty() { "none".into() } else { names.join(", ") }
}

/// Builds `times` times; the last one, and the seconds of all.
fn build<T>(times: usize, make: impl Fn() -> (T, f64)) -> (T, Vec<f64>) {
    let mut seconds = Vec::new();
    loop {
        let (made, took) = make();
        seconds.push(took);
        if seconds.len() == times {
            return (made, seconds);
        }
    }
}

/// All tables of one mesh.
fn measure(model: &Model, device: Option<&Arc<Device>>, choice: &Arguments) {
    let (vertices, faces) = model.merged();
    let triangles: Vec<[Vec3; 3]> = faces.iter().map(|f| f.map(|v| vertices[v as usize])).collect();
    let times = if choice.says("quick") { 1 } else { 3 };
    println!("\n{}: {} triangles", model.name, triangles.len());
    println!("  {:<8} {:>6} {:>10} {:>10}  (all threads, of {times})", "", "B/tri", "best s", "median s");
    let mut contestants: Vec<Box<dyn Contestant>> = Vec::new();
    for mode in [Mode::Default, Mode::Robust, Mode::High] {
        let Some(device) = device.filter(|_| mode != Mode::High || choice.says("high")) else { continue };
        let commit = || {
            let scene = Scene::new(device, &vertices, &faces, mode);
            let seconds = scene.as_ref().map_or(f64::NAN, |s| s.seconds);
            (scene, seconds)
        };
        match build(times, commit) {
            (Err(e), _) => println!("{e}"),
            (Ok(scene), seconds) => {
                table::built(scene.name(), scene.bytes(), triangles.len(), seconds);
                contestants.push(Box::new(scene));
            }
        }
    }
    if choice.has("obvhs") {
        let (obvhs, seconds) = build(times, || timed(|| Obvhs::new(&triangles)));
        table::built(obvhs.name(), obvhs.bytes(), triangles.len(), seconds);
        contestants.push(Box::new(obvhs));
    }
    let shapes = || Shapes { triangles: &triangles, ..Shapes::default() };
    let (accel, seconds) = build(times, || timed(|| Accel::new(shapes(), &[], &[])));
    table::built("ours", accel.bytes(), triangles.len(), seconds);
    let lists = lists::rays(model, &accel, &triangles);
    let accel = Arc::new(RwLock::new(accel));
    for kernel in SimdKernel::ALL.into_iter().filter(|k| k.is_available() && choice.has(k.name())) {
        contestants.push(Box::new(Ours { accel: accel.clone(), kernel }));
    }
    let reference = contestants.iter().position(|c| c.name() == "robust").unwrap_or(0);
    agree::agree(&contestants, reference, &lists, if choice.says("quick") { 16 } else { 4 });
    if choice.has("obvhs") {
        println!("  (the walk of obvhs 0.4.0 drops hits nearer than 1e-4)");
    }
    let effort = match choice.says("quick") {
        true => Effort { rounds: (3, 3), part: 8, seconds: 2.0 },
        false => Effort { rounds: (12, 4), part: 4, seconds: 9.0 },
    };
    for threads in [1, 2].into_iter().filter(|t| choice.has(&t.to_string())) {
        println!(
            "{}, threads: {threads}; Mrays/s (median of rounds), ratio to Embree ± its error, ratio to robust",
            model.name
        );
        table::head(&contestants);
        for (kind, list) in Kind::ALL.into_iter().zip(&lists).filter(|(kind, _)| choice.has(kind.name())) {
            for question in [Question::Closest, Question::Occluded] {
                if kind != Kind::Shadow || question == Question::Occluded {
                    let rounds = contest::contest(&contestants, question, list, threads, effort);
                    table::row(&contestants, kind.name(), question, &rounds);
                }
            }
        }
    }
}
